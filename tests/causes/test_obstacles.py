"""The cells in the way: nearest obstacle, first blocked pose, local and global detours."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.causes.detours import MIN_DEVIATION, DetourDetector
from chefbot.causes.obstacles import blocked_index, deviation, in_the_way, nearest_lethal, remaining
from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2


def costmap(*obstacles: tuple[float, float]) -> Costmap:
    """Return a costmap of 5 m x 5 m from the origin on, with single lethal cells and 0.2 m of inscribed cost."""
    cells = np.zeros((100, 100), np.uint8)
    rows, columns = np.mgrid[0:100, 0:100]
    x, y = (columns + 0.5) * 0.05, (rows + 0.5) * 0.05
    for ox, oy in obstacles:
        cells[np.hypot(x - ox, y - oy) <= 0.2] = INSCRIBED
    for ox, oy in obstacles:
        cells[int(oy / 0.05), int(ox / 0.05)] = LETHAL
    return Costmap(cells, 0.05, 0.0, 0.0)


def straight(y: float, start: float = 0.5, end: float = 4.5) -> NDArray[np.float64]:
    x = np.arange(start, end, 0.05)
    return np.column_stack([x, np.full_like(x, y), np.zeros_like(x)])


@pytest.mark.parametrize("seed", range(1, 20, 2))
def test_the_nearest_obstacle_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    obstacles = [tuple(point) for point in rng.uniform(0.1, 4.9, (20, 2)).tolist()]
    costs = costmap(*obstacles)
    rows, columns = np.nonzero(costs.cells == LETHAL)
    x, y = rng.uniform(0.0, 5.0, 2).tolist()
    distances = np.hypot((columns + 0.5) * 0.05 - x, (rows + 0.5) * 0.05 - y)
    found = nearest_lethal(costs, x, y)
    if distances.min() > 0.8:
        assert found is None
    else:
        assert found is not None and math.dist(found, (x, y)) == pytest.approx(float(distances.min()))


def test_outside_the_costmap_there_is_no_obstacle() -> None:
    costs = costmap((2.0, 2.0))
    assert nearest_lethal(costs, -30.0, 2.0) is None and nearest_lethal(costs, 2.0, 90.0) is None


def test_an_obstacle_on_the_path_comes_before_a_nearer_one() -> None:
    costs = costmap((1.7, 1.02), (0.52, 0.48))
    found = in_the_way(costs, straight(1.0), SE2(0.6, 1.0, 0.0))
    assert found is not None and found.x == pytest.approx(1.7, abs=0.05)
    beside = in_the_way(costs, straight(3.0), SE2(0.6, 1.0, 0.0))
    assert beside is not None and beside.x == pytest.approx(0.52, abs=0.05)


def test_unknown_cells_do_not_block() -> None:
    costs = costmap()
    costs.cells[:] = UNKNOWN
    assert blocked_index(costs, straight(1.0)) is None


def test_only_the_path_ahead_counts() -> None:
    ahead = remaining(straight(1.0), SE2(2.0, 1.0, 0.0), 1.0)
    assert ahead[0, 0] == pytest.approx(2.0) and ahead[-1, 0] == pytest.approx(3.0, abs=0.06)


def test_the_deviation_is_that_of_the_farthest_pose() -> None:
    path = straight(1.0)
    bent = path.copy()
    bent[10:20, 1] += 0.3
    assert deviation(bent, path, SE2(0.5, 1.0, 0.0)) == pytest.approx(0.3)
    assert deviation(path, path, SE2(0.5, 1.0, 0.0)) == 0.0


def test_a_plan_around_an_obstacle_on_the_old_one_is_a_detour() -> None:
    goal, robot = SE2(4.45, 1.0, 0.0), SE2(0.5, 1.0, 0.0)
    around = straight(1.0)
    around[20:50, 1] += 1.2 * MIN_DEVIATION
    detector = DetourDetector()
    assert detector.process(straight(1.0), goal, robot, costmap()) is None
    detour = detector.process(around, goal, robot, costmap((2.4, 1.02)))
    assert detour is not None and detour.obstacle.x == pytest.approx(2.4, abs=0.05)
    assert detour.deviation == pytest.approx(1.2 * MIN_DEVIATION) and detour.extra_length > 0.5
    assert detector.process(around, goal, robot, costmap((2.4, 1.02))) is None  # the same plan


def test_no_detour_without_an_obstacle_or_to_another_goal() -> None:
    goal, robot = SE2(4.45, 1.0, 0.0), SE2(0.5, 1.0, 0.0)
    free, elsewhere = DetourDetector(), DetourDetector()
    for detector in (free, elsewhere):
        detector.process(straight(1.0), goal, robot, costmap())
    assert free.process(straight(2.0), goal, robot, costmap()) is None
    assert elsewhere.process(straight(2.0), SE2(4.45, 2.0, 0.0), robot, costmap((2.4, 1.02))) is None
