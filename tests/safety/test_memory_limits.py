"""The memory of obstacles and seen ground against a search of all its cells, and at the limits of its distances."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.safety.local_memory import (
    CAMERA,
    GROUND,
    LIDAR,
    UPRIGHT,
    VIEW,
    LocalMemory,
    clear_rays,
    cover_body,
    mark_points,
    new_memory,
    points_around,
    time_on_seen_ground,
)

Floats = NDArray[np.float64]
RESOLUTION = 0.1
ORIGIN, DISC = np.zeros(3), np.zeros((0, 2))
NOSE = np.array([[-0.3, -0.2], [0.2, -0.2], [0.45, 0.0], [0.2, 0.2], [-0.3, 0.2]])
"""A body whose front is a wedge."""
ALL_LAYERS, BOTH = np.ones(3, np.bool_), np.ones(2, np.bool_)
offsets = st.floats(-0.1, 0.1)


def memory(resolution: float = RESOLUTION) -> LocalMemory:
    """Return an empty memory that reaches ten cells in each direction."""
    return new_memory(10.0 * resolution, resolution)


def mark(one: LocalMemory, x: float, y: float, layer: int = LIDAR) -> None:
    """Store a point in odom directly."""
    n, r = one.seen_ns.shape[1], one.resolution
    row, column = math.floor(y / r) % n, math.floor(x / r) % n
    one.hit_ns[layer, row, column], one.hit_xy[layer, row, column] = 1, (x, y)


def found(
    one: LocalMemory, pose: Floats = ORIGIN, reach: float = 0.9, room: int = 500
) -> list[tuple[float, float, int]]:
    """Return x, y (in base_link) and layer of the points around a pose, in order."""
    points, layers, stamps = np.zeros((room, 2)), np.zeros(room, np.int64), np.zeros(room, np.int64)
    count = points_around(one, pose, reach, 0, points, layers, stamps)
    assert 0 <= count <= room
    rows = zip(points[:count].round(9).tolist(), layers[:count].tolist(), strict=True)
    return sorted((x, y, layer) for (x, y), layer in rows)


def in_base(pose: Floats, x: float, y: float) -> tuple[float, float]:
    """Return a point of odom in base_link."""
    c, s, dx, dy = math.cos(pose[2]), math.sin(pose[2]), x - pose[0], y - pose[1]
    return c * dx + s * dy, c * dy - s * dx


def is_inside(x: float, y: float, radius: float, corners: Floats) -> bool:
    """Return whether a point in base_link is inside a disc or a polygon."""
    if not len(corners):
        return math.hypot(x, y) < radius
    edges = np.roll(corners, -1, axis=0) - corners
    return bool((edges[:, 0] * (y - corners[:, 1]) - edges[:, 1] * (x - corners[:, 0]) > 0.0).all())


# -- the body


@pytest.mark.parametrize(("radius", "corners"), [(0.498, DISC), (0.58, DISC), (0.5, NOSE)])
@pytest.mark.parametrize("seed", range(1, 16, 2))
def test_cells_below_the_body_are_those_with_their_middle_inside(
    radius: float, corners: Floats, seed: int
) -> None:
    """Wherever the robot is and looks, also at the borders of a cell; points inside of the body are removed."""
    rng = np.random.default_rng(seed)
    pose = np.array(
        [*rng.choice([0.001, 0.05, 0.099], 2) + rng.integers(-30, 30, 2) * 0.1, rng.uniform(-3, 3)]
    )
    one, n = memory(), 22
    points = pose[:2] + rng.uniform(-0.6, 0.6, (60, 2))
    for x, y in points.tolist():
        mark(one, x, y, CAMERA)
    held = {tuple(xy) for xy in one.hit_xy[CAMERA][one.hit_ns[CAMERA] > 0].tolist()}
    cover_body(one, pose, radius, corners, 8)
    left = {tuple(xy) for xy in one.hit_xy[CAMERA][one.hit_ns[CAMERA] > 0].tolist()}
    gone = set()
    for row in range(math.floor(pose[1] / 0.1) - 9, math.floor(pose[1] / 0.1) + 10):
        for column in range(math.floor(pose[0] / 0.1) - 9, math.floor(pose[0] / 0.1) + 10):
            below = is_inside(*in_base(pose, (column + 0.5) * 0.1, (row + 0.5) * 0.1), radius, corners)
            for kind in (GROUND, VIEW):
                known = one.seen_ns[kind, row % n, column % n] == 8
                assert known == below
                assert not known or one.seen_cell[kind, row % n, column % n].tolist() == [column, row]
            if below:
                gone |= {
                    (x, y)
                    for x, y in held
                    if (math.floor(x / 0.1), math.floor(y / 0.1)) == (column, row)
                    and is_inside(*in_base(pose, x, y), radius - 0.05, corners)
                }
    assert left == held - gone and gone


def test_the_skin_itself_is_outside() -> None:
    """In numbers that binary fractions hold: a cell with its middle at the edge is not below the body."""
    for corners, radius in (
        (DISC, 0.5),
        (np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]), 0.8),
    ):
        one = memory(0.5)
        cover_body(one, np.array([0.25, 0.25, 0.0]), radius, corners, 8)
        assert one.seen_ns[GROUND, 0, 0] == 8 and one.seen_ns[GROUND, 0, 1] == -1 == one.seen_ns[GROUND, 1, 0]


# -- points


@settings(max_examples=30)
@given(
    st.lists(st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8)), max_size=40),
    st.tuples(offsets, offsets, st.floats(-3.0, 3.0)), st.sampled_from([0.2, 0.35, 0.5, 0.7]),
)  # fmt: skip
def test_all_points_within_reach_are_found_from_anywhere(
    points: list[tuple[float, float]], pose: tuple[float, float, float], reach: float
) -> None:
    one, here = memory(), np.array(pose)
    for x, y in points:
        mark(one, x, y, UPRIGHT)
    held = one.hit_xy[UPRIGHT][one.hit_ns[UPRIGHT] > 0].tolist()
    expected = sorted(in_base(here, x, y) for x, y in held if math.dist((x, y), pose[:2]) <= reach)
    got = np.array(found(one, here, reach)).reshape(-1, 3)
    assert got[:, :2] == pytest.approx(np.array(expected).reshape(-1, 2), abs=1e-8)


@pytest.mark.parametrize("x", [-0.1, 0.0, 0.05, 0.1])
def test_with_a_large_reach_each_point_is_found_once(x: float) -> None:
    """A reach beyond the grid does not go around it."""
    one = memory()
    mark_points(one, ORIGIN, np.linspace(-3.1, 3.1, 100), np.full(100, 0.99), 1, LIDAR)
    count = int((one.hit_ns > 0).sum())
    seen = found(one, np.array([x, x, 0.0]), 9.0)
    assert len(seen) == len(set(seen)) <= count
    assert len(seen) == count or x != 0.0


def test_the_outermost_cells_within_reach_are_looked_at() -> None:
    one, here = memory(), np.array([0.01, 0.01, 0.0])
    for x, y in ((-0.485, 0.01), (0.01, -0.485), (0.505, 0.01), (0.01, 0.505)):
        mark(one, x, y)
    assert len(found(one, here, 0.5)) == 4
    assert len(found(one, here, 0.5, room=3)) == 3, "no more than there is room for"


def test_the_reach_itself_counts() -> None:
    one = memory()
    mark(one, -0.5, 0.0)
    assert len(found(one, reach=0.5)) == 1 and found(one, reach=0.499) == []


def test_a_far_point_hides_no_near_one_in_its_cell() -> None:
    one = memory()
    mark(one, 0.59, 0.0, LIDAR)
    mark(one, 0.51, 0.0, CAMERA)
    assert found(one, reach=0.55) == [(0.51, 0.0, CAMERA)]


@pytest.mark.parametrize("seed", range(1, 40, 2))
def test_of_two_points_in_a_cell_the_nearer_one_stays(seed: int) -> None:
    """In whatever order its beams come, wherever it is; and beams after them are not lost."""
    rng = np.random.default_rng(seed)
    sensor = np.array([*rng.uniform(-3.0, 3.0, 2), rng.uniform(-3.0, 3.0)])
    middle = np.floor((sensor[:2] + rng.uniform(-0.5, 0.5, 2)) / 0.1) * 0.1 + 0.05
    points = middle + rng.uniform(-0.049, 0.049, (2, 2))
    other = middle + np.array([0.2, 0.1])
    beams = [*points, other]
    distances = [math.dist(point, sensor[:2]) for point in beams]
    bearings = [math.atan2(y - sensor[1], x - sensor[0]) - sensor[2] for x, y in beams]
    nearest = points[int(distances[1] < distances[0])]
    for order in ([0, 1, 2], [1, 0, 2]):
        one = memory()
        mark_points(one, sensor, np.array(bearings)[order], np.array(distances)[order], 5, LIDAR)
        held = one.hit_xy[LIDAR][one.hit_ns[LIDAR] == 5]
        assert sorted(held.tolist()) == pytest.approx(np.array(sorted([nearest.tolist(), other.tolist()])))


def test_a_ray_of_one_place_clears_its_cell() -> None:
    one = memory()
    mark(one, 0.55, 0.0)
    clear_rays(one, ORIGIN, np.zeros(1), np.full(1, 0.52), np.full(1, 0.52), 2, ALL_LAYERS, BOTH)
    assert found(one) == []


def test_a_ray_ends_with_the_memory() -> None:
    """Ten cells from the sensor, which is at the end of a cell."""
    one = memory()
    for x in (0.95, 1.05):
        mark(one, x, 0.05)
    clear_rays(
        one, np.array([-0.04, 0.05, 0.0]), np.zeros(1), np.zeros(1), np.full(1, 5.0), 2, ALL_LAYERS, BOTH
    )
    assert found(one, reach=1.5) == [(1.05, 0.05, LIDAR)]


# -- seen ground


def seen_at_random(rng: np.random.Generator, pose: Floats) -> LocalMemory:
    """Return a memory in which nine of ten cells around a pose were seen."""
    one, n = memory(), 22
    row0, column0 = math.floor(pose[1] / 0.1), math.floor(pose[0] / 0.1)
    for row in range(row0 - 10, row0 + 11):
        for column in range(column0 - 10, column0 + 11):
            one.seen_cell[:, row % n, column % n] = (column, row)
            one.seen_ns[:, row % n, column % n] = 9 if rng.random() < 0.9 else -1
    return one


@pytest.mark.parametrize("seed", range(1, 200, 2))
def test_the_time_on_seen_ground_is_that_of_the_exact_arc(seed: int) -> None:
    """A point of the body, looked at a cell of its path apart, against the circle about the centre of rotation."""
    rng = np.random.default_rng(seed)
    pose = np.array([*rng.uniform(-2.0, 2.0, 2), rng.uniform(-3.0, 3.0)])
    point = rng.uniform(-0.4, 0.4, 2)
    v, w = rng.uniform(-0.5, 0.5), float(rng.choice([0.0, rng.uniform(-2.0, 2.0)]))
    one, n = seen_at_random(rng, pose), 22
    speed = math.hypot(v - w * point[1], w * point[0])
    step, duration = RESOLUTION / speed, 0.6 / speed
    expected = math.inf
    for k in range(1, int(duration / step) + 2):
        yaw = w * k * step
        dx, dy = (math.sin(yaw) * v / w, (1.0 - math.cos(yaw)) * v / w) if w else (v * k * step, 0.0)
        dx, dy = (
            dx + math.cos(yaw) * point[0] - math.sin(yaw) * point[1],
            dy + math.sin(yaw) * point[0] + math.cos(yaw) * point[1],
        )
        x = pose[0] + math.cos(pose[2]) * dx - math.sin(pose[2]) * dy
        y = pose[1] + math.sin(pose[2]) * dx + math.cos(pose[2]) * dy
        if one.seen_ns[GROUND, math.floor(y / 0.1) % n, math.floor(x / 0.1) % n] < 0:
            expected = (k - 1) * step
            break
    time = time_on_seen_ground(one, pose, v, w, point[None], duration, 0, 0, GROUND)
    assert time == pytest.approx(expected, abs=1e-9)
