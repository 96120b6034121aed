"""Which walls of the map no sensor confirms, against a search of all cells."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.costmap.unseen_walls import CONFIRMATION_DISTANCE, unseen_walls
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import SE2

NOTHING = np.empty((0, 2))
Floats = NDArray[np.float64]


def random_map(rng: np.random.Generator) -> Grid:
    cells = rng.choice([UNKNOWN, FREE, OCCUPIED], (40, 60), p=[0.2, 0.6, 0.2]).astype(np.int8)
    return Grid(cells, 0.05, *rng.uniform(-2.0, 0.0, 2).tolist())


def in_order(points: Sequence[Floats] | Floats) -> Floats:
    """Return points in an order that does not depend on theirs."""
    return np.array(sorted(np.round(points, 9).tolist())).reshape(-1, 2)


@pytest.mark.parametrize("seed", range(1, 40, 2))
def test_only_cells_without_a_measured_point_are_returned(seed: int) -> None:
    """Wherever the robot is and looks, also at the border of the map and beyond it."""
    rng = np.random.default_rng(seed)
    grid, reach = random_map(rng), float(rng.uniform(0.2, 1.2))
    robot = SE2(*rng.uniform(-3.0, 4.0, 2).tolist(), float(rng.uniform(-math.pi, math.pi)))
    measured = rng.uniform(-reach, reach, (int(rng.integers(0, 30)), 2))
    expected = []
    for row, column in np.argwhere(grid.cells == OCCUPIED).tolist():
        (wall,) = robot.inverse().apply(np.array([grid.centre(row, column)]))
        if math.hypot(*wall) <= reach and all(
            math.dist(wall, point) > CONFIRMATION_DISTANCE for point in measured
        ):
            expected.append(wall)
    got = unseen_walls(grid, robot, reach, measured)
    assert in_order(got) == pytest.approx(in_order(expected), abs=1e-9)


def test_a_door_post_of_glass_stays_and_one_of_wood_is_measured() -> None:
    """The measured post is not drawn a second time, a little beside."""
    cells = np.zeros((20, 20), np.int8)
    cells[10, 4] = cells[10, 14] = OCCUPIED
    walls = unseen_walls(
        Grid(cells, 0.05, 0.0, 0.0), SE2(0.5, 0.2, math.pi / 2), 1.0, np.array([[0.3, 0.24]])
    )
    assert walls == pytest.approx(np.array([[0.325, -0.225]]))


def test_a_map_without_walls_near_has_none() -> None:
    far = Grid(np.full((4, 4), OCCUPIED, np.int8), 0.05, 30.0, 30.0)
    assert unseen_walls(far, SE2(0.0, 0.0, 0.0), 1.0, NOTHING).shape == (0, 2)
