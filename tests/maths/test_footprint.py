"""The collision check of a polygonal footprint against shapely, and the footprints of robots."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LinearRing, box

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.footprint import Footprint, disc
from chefbot.maths.footprint_collision import lethal_distance, lethal_on_edges
from chefbot.maths.se2 import SE2
from chefbot.robot.load import built_in_robots, load_robot

CELL, SIDE = 0.05, 40
JACKAL = load_robot("jackal")
CORNERS = JACKAL.footprint.polygon()
POSES = st.builds(SE2, st.floats(0.5, 1.5), st.floats(0.5, 1.5), st.floats(-math.pi, math.pi))


def costmap(cells: list[tuple[int, int]]) -> Costmap:
    grid = np.zeros((SIDE, SIDE), np.uint8)
    for cell in cells:
        grid[cell] = LETHAL
    return Costmap(grid, CELL, 0.0, 0.0, CORNERS)


def overlap(pose: SE2, cell: tuple[int, int]) -> float:
    """Return the length of the footprint's edges in a cell, m."""
    row, column = cell
    square = box(column * CELL, row * CELL, (column + 1) * CELL, (row + 1) * CELL)
    return float(LinearRing(pose.apply(CORNERS)).intersection(square).length)


@given(POSES, st.tuples(st.integers(0, SIDE - 1), st.integers(0, SIDE - 1)))
def test_a_cell_on_an_edge_collides_and_no_other(pose: SE2, cell: tuple[int, int]) -> None:
    found, length = costmap([cell]).lethal_on_footprint(pose), overlap(pose, cell)
    if length > CELL:  # two edges of a corner may each have half of it
        assert found > 0
    if length == 0.0:
        assert found == 0


@given(POSES, st.integers(0, SIDE - 1))
def test_an_edge_crosses_no_wall_unseen(pose: SE2, column: int) -> None:
    wall = [(row, column) for row in range(SIDE)]
    xs = pose.apply(CORNERS)[:, 0]
    low, high = column * CELL, (column + 1) * CELL
    if xs.min() < low - 1e-9 and xs.max() > high + 1e-9:
        assert costmap(wall).lethal_on_footprint(pose) > 0
    if xs.max() < low or xs.min() > high:
        assert costmap(wall).lethal_on_footprint(pose) == 0


@given(POSES, st.floats(-6.0, 6.0), st.tuples(st.integers(0, SIDE - 1), st.integers(0, SIDE - 1)))
def test_a_rotation_towards_a_cell_comes_nearer(pose: SE2, angle: float, cell: tuple[int, int]) -> None:
    costs = costmap([cell])
    headings = [SE2(pose.x, pose.y, pose.yaw + angle * k / 30) for k in range(1, 31)]
    if overlap(pose, cell) == 0.0 and max(overlap(heading, cell) for heading in headings) > 2.0 * CELL:
        assert costs.comes_nearer_by_rotating(pose, angle)
    x, y = (cell[1] + 0.5) * CELL - pose.x, (cell[0] + 0.5) * CELL - pose.y
    if math.hypot(x, y) > JACKAL.circumscribed_radius + CELL:
        assert not costs.comes_nearer_by_rotating(pose, angle)


@given(POSES, st.lists(st.floats(-0.2, 0.2), min_size=1, max_size=6), st.floats(-0.03, 0.03))
def test_what_is_ahead_never_keeps_a_robot_from_backing_up(
    pose: SE2, beside: list[float], depth: float
) -> None:
    marks = pose.apply(np.array([[CORNERS[:, 0].max() + depth, y] for y in beside]))
    costs = costmap([(int(y // CELL), int(x // CELL)) for x, y in marks])
    backwards = [pose @ SE2(-0.02 * k, 0.0, 0.0) for k in range(15)]
    assert not costs.comes_nearer(backwards)


@given(POSES, st.tuples(st.integers(0, SIDE - 1), st.integers(0, SIDE - 1)), st.floats(-0.6, 0.6))
def test_a_cell_that_comes_under_an_edge_is_met(pose: SE2, cell: tuple[int, int], distance: float) -> None:
    poses = [pose @ SE2(distance * k / 30, 0.0, 0.0) for k in range(31)]
    if overlap(pose, cell) == 0.0 and max(overlap(at, cell) for at in poses) > 1.5 * CELL:
        assert costmap([cell]).comes_nearer(poses)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 8.0))
def test_the_nearest_lethal_cell_has_the_distance(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((9, 11)) < 0.1, LETHAL, 0).astype(np.uint8)
    x, y = rng.uniform(-2.0, 12.0, 2)
    rows, columns = np.nonzero(cells == LETHAL)
    dx, dy = (np.maximum(np.maximum(low - at, at - low - 1), 0.0) for low, at in ((columns, x), (rows, y)))
    expected = min([reach, *np.hypot(dx, dy)])
    assert lethal_distance(cells, x, y, reach) == pytest.approx(expected)


def test_a_disc_has_no_edges() -> None:
    costs = Costmap(np.full((SIDE, SIDE), LETHAL, np.uint8), CELL, 0.0, 0.0, disc(0.2).polygon(0.02))
    assert costs.lethal_on_footprint(SE2(1.0, 1.0, 0.3)) == 0
    assert not costs.comes_nearer_by_rotating(SE2(1.0, 1.0, 0.3), 3.0)


def test_padding_moves_every_edge_outwards() -> None:
    padded = JACKAL.footprint.polygon(0.02)
    assert np.abs(padded) == pytest.approx(np.abs(CORNERS) + 0.02)


@pytest.mark.parametrize("name", sorted(built_in_robots()))
def test_the_radii_enclose_the_footprint(name: str) -> None:
    footprint: Footprint = load_robot(name).footprint
    if footprint.corners:
        distances = np.hypot(*footprint.polygon().T)
        assert distances.max() == pytest.approx(footprint.circumscribed_radius)
        ring = LinearRing(footprint.polygon())
        assert ring.is_ccw
        assert ring.distance(box(0, 0, 0, 0).centroid) == pytest.approx(footprint.inscribed_radius)
    else:
        assert footprint.inscribed_radius == footprint.circumscribed_radius


def test_the_jackal_has_the_size_of_its_data_sheet() -> None:
    x, y = CORNERS[:, 0], CORNERS[:, 1]
    assert (np.ptp(x), np.ptp(y)) == pytest.approx((0.508, 0.430))
    assert JACKAL.inscribed_radius == pytest.approx(0.215)


def test_many_turns_are_checked_as_one() -> None:
    pose = SE2(1.0, 1.0, 0.3)
    for cells in ([], [(SIDE // 2, column) for column in range(SIDE)]):
        assert costmap(cells).comes_nearer_by_rotating(pose, 1e12) is bool(cells)
        assert costmap(cells).comes_nearer_by_rotating(pose, -1e12) is bool(cells)


ODD = st.integers(-700, 700).map(lambda k: 0.0137 * k + 0.00123)
"""Numbers that put no point of an edge on the border of a cell."""
POLYGONS = st.lists(st.tuples(ODD, ODD), min_size=3, max_size=6).map(np.array)
GRIDS = st.integers(0, 2**32).map(
    lambda seed: np.random.default_rng(seed).choice([0, INSCRIBED, LETHAL, UNKNOWN], (12, 9)).astype(np.uint8)
)


def points_on_edges(x: float, y: float, yaw: float, corners: np.ndarray) -> np.ndarray:
    """Return the points (n, 2) at which edges are looked at: from each corner on, at most half a cell apart."""
    turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    placed = corners @ turn + (x, y)
    edges = []
    for begin, end in zip(placed, np.roll(placed, -1, axis=0), strict=True):
        count = max(1, math.ceil(2.0 * float(np.linalg.norm(end - begin))))
        edges.append(begin + np.arange(count)[:, None] / count * (end - begin))
    return np.vstack(edges)


@settings(max_examples=40)
@given(GRIDS, ODD, ODD, ODD, POLYGONS)
def test_only_points_in_lethal_cells_of_the_costmap_count(
    cells: np.ndarray, x: float, y: float, yaw: float, corners: np.ndarray
) -> None:
    expected = 0
    for px, py in points_on_edges(x, y, yaw, corners):
        inside = 0 <= px < cells.shape[1] and 0 <= py < cells.shape[0]
        expected += bool(inside and cells[int(py), int(px)] == LETHAL)
    assert lethal_on_edges(cells, x, y, yaw, corners) == expected


@settings(max_examples=40)
@given(GRIDS, ODD, ODD, ODD, POLYGONS)
def test_a_costmap_and_a_robot_turned_together_collide_alike(
    cells: np.ndarray, x: float, y: float, yaw: float, corners: np.ndarray
) -> None:
    turned = np.ascontiguousarray(np.rot90(cells, -1))  # a quarter counter-clockwise: rows count upwards
    found = lethal_on_edges(turned, cells.shape[0] - y, x, yaw + math.pi / 2, corners)
    assert found == lethal_on_edges(cells, x, y, yaw, corners)
