"""The memory of obstacles and seen ground: what is kept, for how long, and what removes it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.support.local_memories import (
    ALL_LAYERS,
    BOTH,
    NO_LAYER,
    ORIGIN,
    RESOLUTION,
    Floats,
    at,
    clear,
    found,
    free_time,
    is_seen,
    mark,
    memory,
    see_all,
)

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
)

DISC = np.zeros((0, 2))
RECTANGLE = np.array([[-0.3, -0.2], [0.4, -0.2], [0.4, 0.2], [-0.3, 0.2]])
ONLY_VIEW, NEITHER = np.array([False, True]), np.array([False, False])


# -- points


def test_a_new_memory_is_empty_and_large_enough() -> None:
    one = memory()
    assert (
        one.seen_ns.shape == (2, 22, 22) and one.hit_ns.shape == (3, 22, 22) and one.resolution == RESOLUTION
    )
    assert one.hit_xy.shape == (3, 22, 22, 2) and one.seen_cell.shape == (2, 22, 22, 2)
    assert new_memory(0.95, RESOLUTION).seen_ns.shape == (2, 22, 22)
    assert len(found(one)) == 0
    for kind in (GROUND, VIEW):
        assert free_time(one, 0.1, 0.0, at(0.0, 0.0)[None], kind=kind) == 0.0


@given(
    st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-4.0, 4.0), st.floats(-3.1, 3.1), st.floats(0.0, 0.85)
)  # fmt: skip
def test_a_point_is_where_it_was_seen_from_anywhere(
    x: float, y: float, yaw: float, angle: float, r: float
) -> None:
    """Marked by a sensor that is turned, and seen from a robot beside it; the grid goes along."""
    one, sensor = memory(), at(x, y, yaw)
    mark_points(one, sensor, at(angle), at(r), 5, CAMERA)
    beside = at(x + 0.05, y - 0.02, yaw + 1.0)
    assert found(one, sensor) == pytest.approx(
        np.array([[r * math.cos(angle), r * math.sin(angle), CAMERA, 5]]), abs=1e-9
    )
    dx, dy = r * math.cos(yaw + angle) - 0.05, r * math.sin(yaw + angle) + 0.02
    c, s = math.cos(yaw + 1.0), math.sin(yaw + 1.0)
    ((px, py, _, _),) = found(one, beside, 1.0)
    assert (px, py) == pytest.approx((c * dx + s * dy, c * dy - s * dx), abs=1e-9)


@pytest.mark.parametrize("r", [math.nan, math.inf, -0.1, -math.inf, 1.01, 1e30])
def test_what_is_not_a_distance_within_reach_marks_nothing(r: float) -> None:
    one = memory()
    mark_points(one, ORIGIN, at(0.0, 1.0), at(r, 0.5), 5, LIDAR)
    assert len(found(one)) == 1, "and the ranges after it count"
    mark_points(one, ORIGIN, at(2.0), at(1.0), 5, LIDAR)
    assert len(found(one, reach=1.01)) == 2, "the reach itself counts"
    mark_points(one, ORIGIN, at(3.0), at(0.0), 5, LIDAR)
    assert len(found(one)) == 2, "a point at the sensor as well"


def test_of_points_in_a_cell_the_one_nearest_to_the_sensor_stays() -> None:
    one = memory()
    mark_points(one, ORIGIN, at(0.1, 0.1, 0.1), at(0.56, 0.52, 0.58), 5, LIDAR)
    assert np.hypot(*found(one)[0, :2]) == pytest.approx(0.52)
    mark_points(one, ORIGIN, at(0.1), at(0.57), 6, LIDAR)
    assert found(one)[0] == pytest.approx([0.57 * math.cos(0.1), 0.57 * math.sin(0.1), LIDAR, 6]), "newer"
    moved = at(1.0, 0.0, 0.0)
    mark_points(one, moved, at(math.pi, math.pi), at(0.49, 0.41), 7, LIDAR)
    assert found(one)[0, 0] == pytest.approx(0.51) or found(one)[0, 0] == pytest.approx(0.59)
    assert math.hypot(found(one)[0, 0] - 1.0, found(one)[0, 1]) == pytest.approx(0.41), (
        "from where it was seen"
    )


def test_layers_hold_their_points_apart() -> None:
    one = memory()
    for layer in (LIDAR, CAMERA, UPRIGHT):
        mark(one, 0.5 + 0.01 * layer, 0.05, 5 + layer, layer)
    assert found(one)[:, 2:].tolist() == [[0, 5], [1, 6], [2, 7]]
    clear(one, 0.1, 0.0, 0.8, 9, np.array([False, True, False]))
    assert found(one)[:, 2].tolist() == [LIDAR, UPRIGHT]


def test_a_point_ages() -> None:
    one = memory()
    mark(one, 0.5, 0.0, 100)
    assert len(found(one, oldest_ns=100)) == 1 and len(found(one, oldest_ns=101)) == 0


def test_a_point_of_stamp_zero_counts() -> None:
    """The clock of a simulation begins at zero."""
    one = memory()
    mark(one, 0.5, 0.0, 0)
    assert len(found(one, oldest_ns=0)) == 1 and len(found(one, oldest_ns=-5)) == 1


@pytest.mark.parametrize(("reach", "count"), [(0.5001, 4), (0.4999, 0), (5.0, 4)])
def test_points_count_up_to_the_reach_on_all_sides(reach: float, count: int) -> None:
    one = memory()
    for x, y in ((0.3, 0.4), (-0.5, 0.0), (0.4, -0.3), (0.0, -0.5)):
        mark(one, x, y)
    assert len(found(one, reach=reach)) == count
    assert len(found(one, at(2.2, 0.0, 0.0), 0.9)) == 0, "a whole grid farther there is another place"


def test_without_room_for_all_points_the_near_ones_are_taken() -> None:
    """A robot among many marks must not overlook the one before its bumper, wherever that lies in the grid."""
    for bearing in np.linspace(-3.0, 3.0, 13):
        one = memory()
        for angle in np.linspace(-math.pi, math.pi, 300):
            for r in (0.6, 0.75, 0.9):
                mark_points(one, ORIGIN, at(float(angle)), at(r), 1, LIDAR)
        mark(one, 0.25 * math.cos(bearing), 0.25 * math.sin(bearing))
        nearest = found(one, room=20)
        assert len(nearest) == 20
        assert np.hypot(nearest[:, 0], nearest[:, 1]).min() == pytest.approx(0.25)
        assert len(np.unique(found(one, room=1000), axis=0)) == len(found(one, room=1000)) > 60, "each once"


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)), max_size=30), st.floats(0.05, 0.8))
def test_all_points_within_reach_are_found(points: list[tuple[float, float]], reach: float) -> None:
    one = memory()
    for x, y in points:
        mark(one, x, y)
    held = one.hit_xy[LIDAR][one.hit_ns[LIDAR] > 0]
    expected = held[np.hypot(*held.T) <= reach]
    got = found(one, reach=reach)[:, :2]
    assert sorted(map(tuple, got.tolist())) == sorted(map(tuple, expected.tolist()))


# -- what a ray removes, and the ground that it shows


@pytest.mark.parametrize(("start", "end", "left"), [
    (0.0, 0.8, False), (0.0, 0.62, False), (0.0, 0.38, True), (0.45, 0.8, False), (0.65, 0.9, True),
    (-1.0, 0.8, False), (0.0, math.inf, False), (0.0, -1.0, True), (0.8, 0.0, True),
    (math.nan, 0.8, True), (0.0, math.nan, True),
])  # fmt: skip
def test_a_ray_removes_what_it_passes(start: float, end: float, left: bool) -> None:
    for sensor in (ORIGIN, at(0.02, 0.03, -2.0)):
        one = memory()
        mark(one, 0.55, 0.05)
        bearing = math.atan2(0.05 - sensor[1], 0.55 - sensor[0]) - sensor[2]
        clear(one, bearing, start, end, sensor=sensor)
        assert (len(found(one)) == 1) == left
        clear(one, bearing + math.pi, 0.0, 0.9, sensor=sensor)
        assert (len(found(one)) == 1) == left, "what is behind stays"


def test_only_a_later_ray_removes() -> None:
    one = memory()
    mark(one, 0.55, 0.05, 7)
    for stamp_ns in (6, 7):
        clear(one, 0.09, 0.0, 0.9, stamp_ns)
        assert len(found(one)) == 1
    clear(one, 0.09, 0.0, 0.9, 8)
    assert len(found(one)) == 0


@pytest.mark.parametrize(
    ("bearing", "spacing", "left"), [(0.03, 0.02, True), (0.07, 0.02, False), (0.03, 0.2, False)]
)
def test_a_ray_that_grazes_the_cell_beside_a_point_leaves_it(
    bearing: float, spacing: float, left: bool
) -> None:
    """The point may be an edge; rays that are farther apart than it is from them show all that can be shown."""
    one = memory()
    mark(one, 0.55, 0.05)
    angles = at(bearing, bearing - spacing)
    clear_rays(one, ORIGIN, angles, at(0.0, 0.0), at(0.9, 0.9), 2, ALL_LAYERS, BOTH)
    assert (len(found(one)) == 1) == left
    assert is_seen(one, 0.55, 0.05), "the ground in the cell is seen all the same"


@settings(deadline=None)
@given(st.floats(0.3, 0.9), st.floats(-3.1, 3.1), st.floats(0.02, 0.1), st.floats(0.0, 1.0))
def test_rays_all_around_leave_no_point_that_was_there(
    r: float, bearing: float, spacing: float, phase: float
) -> None:
    one = memory()
    mark(one, r * math.cos(bearing), r * math.sin(bearing))
    angles = np.arange(-math.pi, math.pi, spacing) + phase * spacing
    free = np.full(angles.shape, 0.95)
    clear_rays(one, ORIGIN, angles, np.zeros_like(angles), free, 2, ALL_LAYERS, BOTH)
    assert found(one, reach=1.0).shape[0] == 0


def test_a_ray_that_is_not_a_number_does_not_end_the_others() -> None:
    one = memory()
    mark(one, 0.55, 0.05)
    clear_rays(one, ORIGIN, at(0.5, 0.09), at(math.nan, 0.0), at(0.9, 0.9), 2, ALL_LAYERS, BOTH)
    assert len(found(one)) == 0


def test_a_ray_reaches_across_the_memory_and_no_farther() -> None:
    """Beyond it, the cells stand for places on the other side."""
    one = memory()
    mark(one, 0.95, 0.05)
    mark(one, -0.95, 0.05)
    clear(one, 0.0, 0.0, 50.0, sensor=at(0.0, 0.05, 0.0))
    assert found(one, reach=1.0)[:, 0].tolist() == pytest.approx([-0.95])


@pytest.mark.parametrize(
    ("shows", "seen"), [(BOTH, (True, True)), (ONLY_VIEW, (False, True)), (NEITHER, (False, False))]
)
def test_a_ray_shows_floor_or_only_the_view(shows: NDArray[np.bool_], seen: tuple[bool, bool]) -> None:
    one = memory()
    clear(one, 0.0, 0.25, 0.87, 9, NO_LAYER, shows, at(0.0, 0.05, 0.0))
    for kind in (GROUND, VIEW):
        for x, over in ((0.25, True), (0.75, True), (0.15, False), (0.95, False)):
            assert is_seen(one, x, 0.05, kind=kind) == (seen[kind] and over)


def test_seen_ground_is_forgotten_and_renewed() -> None:
    one = memory()
    for stamp_ns in (10, 5):  # an older ray does not make it older
        clear(one, 0.0, 0.0, 0.8, stamp_ns, NO_LAYER, BOTH, at(0.0, 0.05, 0.0))
        assert is_seen(one, 0.35, 0.05, 10) and not is_seen(one, 0.35, 0.05, 11)
    clear(one, 0.0, 0.0, 0.8, 20, NO_LAYER, BOTH, at(0.0, 0.05, 0.0))
    assert is_seen(one, 0.35, 0.05, 20)


@pytest.mark.parametrize(("dx", "dy"), [(2.2, 0.0), (0.0, -2.2), (-2.2, 2.2)])
def test_a_cell_stands_for_one_place_only(dx: float, dy: float) -> None:
    """The same cell a whole grid farther was not seen."""
    one = memory()
    see_all(one, 9)
    assert is_seen(one, 0.25, 0.15) and not is_seen(one, 0.25 + dx, 0.15 + dy)


# -- the body


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (3.33, -7.77, 2.0), (-0.05, 0.05, -1.2)])
@pytest.mark.parametrize("corners", [DISC, RECTANGLE], ids=["disc", "rectangle"])
def test_below_the_body_is_nothing_and_the_ground_is_known(pose: tuple[float, ...], corners: Floats) -> None:
    """Points in the body go, those at its skin and outside stay; the ground is known where the body is."""
    one, here = memory(), at(*pose)
    c, s = math.cos(here[2]), math.sin(here[2])
    radius = 0.45 if len(corners) else 0.35
    inside = [(0.0, 0.0), (0.2, 0.1), (-0.2, -0.1), (0.2, -0.1), (-0.2, 0.1)]
    outside = [(0.45, 0.0), (-0.42, 0.0), (0.0, 0.38), (0.0, -0.38), (0.5, 0.5)]
    for x, y in inside + outside:
        mark_points(one, here, at(math.atan2(y, x)), at(math.hypot(x, y)), 5, UPRIGHT)
    cover_body(one, here, radius, corners, 8)
    assert sorted(map(tuple, found(one, here, 1.0)[:, :2].round(6).tolist())) == sorted(outside)
    for x, y, known in (
        (0.0, 0.0, True),
        (0.2, 0.1, True),
        (-0.2, -0.1, True),
        (0.7, 0.0, False),
        (0.0, -0.6, False),
    ):
        for kind in (GROUND, VIEW):
            assert is_seen(one, here[0] + c * x - s * y, here[1] + s * x + c * y, 8, kind) == known


def test_a_point_at_the_skin_stays_although_its_cell_is_covered() -> None:
    """The middle of the cell is below the body, the point in it is at the skin: half a cell inside of it."""
    one = memory()
    mark(one, 0.31, 0.05)
    mark(one, -0.29, -0.05)
    cover_body(one, ORIGIN, 0.36, DISC, 8)
    assert found(one)[:, :2].tolist() == pytest.approx(np.array([[0.31, 0.05]]))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_whole_rectangle_is_covered(sign: float) -> None:
    """Also its corners, 0.447 m away, in any heading; and nothing beside it."""
    one = memory()
    here = at(0.0, 0.0, sign * math.pi / 4)
    cover_body(one, here, 0.4473, RECTANGLE, 8)
    n = one.seen_ns.shape[1]
    for row in range(-8, 8):
        for column in range(-8, 8):
            x, y = (column + 0.5) * 0.1, (row + 0.5) * 0.1
            bx, by = (x + sign * y) * math.sqrt(0.5), (y - sign * x) * math.sqrt(0.5)
            inside = -0.3 <= bx <= 0.4 and -0.2 <= by <= 0.2
            for kind in (GROUND, VIEW):
                assert (one.seen_ns[kind, row % n, column % n] == 8) == inside
                assert not inside or one.seen_cell[kind, row % n, column % n].tolist() == [column, row]


# -- the time on seen ground


def seen_disc() -> LocalMemory:
    """Return a memory in which the ground is seen up to 0.9 m around the origin."""
    one = memory()
    see_all(one, 9)
    return one


def test_a_robot_that_stands_stays_on_its_ground() -> None:
    assert free_time(memory(), 0.0, 0.0, RECTANGLE) == math.inf
    assert free_time(memory(), 0.0, 1.0, at(0.0, 0.0)[None]) == math.inf, "a point at the axle does not move"


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
@pytest.mark.parametrize(("v", "expected"), [(0.5, 1.0), (-0.5, 1.2), (-0.25, 2.4)])
def test_straight_paths_end_with_the_seen_ground(yaw: float, v: float, expected: float) -> None:
    """From 0.4 m before or 0.3 m behind the axle to 0.9 m away; a step is a cell."""
    time = free_time(seen_disc(), v, 0.0, RECTANGLE, at(0.0, 0.0, yaw), 5.0)
    assert time == pytest.approx(expected, abs=0.25 / abs(v) * 0.6)
    assert free_time(seen_disc(), v, 0.0, RECTANGLE, at(0.0, 0.0, yaw), 0.5 * expected) == math.inf


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_arc_ends_with_the_seen_ground(sign: float) -> None:
    """On a circle of 0.5 m, 0.9 m from the start are a chord: 2 r sin(a / 2) = 0.9, a = 2.24 rad."""
    point = at(0.0, 0.0)[None]
    for v, w in ((0.5, sign), (-0.5, sign)):
        time = free_time(seen_disc(), v, w, point, duration=6.0)
        assert time == pytest.approx(2.24, abs=0.35)
        assert free_time(seen_disc(), v, w, point, duration=1.5) == math.inf


def test_on_an_arc_the_robot_turns_to_its_side() -> None:
    """Only the left half of the ground was seen: a turn to the left stays on it, one to the right does not."""
    one = memory()
    for angle in np.linspace(-0.2, math.pi + 0.2, 200):
        clear(one, float(angle), 0.0, 0.9, 9, NO_LAYER)
    nose = at(0.2, 0.0)[None]
    for heading in (0.0, math.pi):
        left = 1.0 if heading == 0.0 else -1.0
        assert free_time(one, 0.1, left * 1.5, nose, at(0.0, 0.1, heading), 1.0) == math.inf
        assert free_time(one, 0.1, -left * 1.5, nose, at(0.0, 0.1, heading), 1.5) < 1.5
        assert free_time(one, 0.0, left * 1.5, nose, at(0.0, 0.0, heading), 1.0) == math.inf
        assert free_time(one, 0.0, -left * 1.5, nose, at(0.0, 0.0, heading), 1.5) < 1.5


@pytest.mark.parametrize(("tolerated", "stays"), [(2, False), (3, True)])
def test_a_few_neighbours_may_be_over_unseen_ground(tolerated: int, stays: bool) -> None:
    """Three points side by side are ahead of the seen ground; points apart from each other do not add up."""
    one = seen_disc()
    inner = [[0.0, 0.1 * k] for k in range(-2, 3)]
    together = np.array(inner + [[1.2, 0.0]] * 3 + inner)
    apart = np.array([[1.2, 0.0], [0.0, 0.0]] * 5)
    assert (free_time(one, 0.1, 0.0, together, duration=0.5, tolerated=tolerated) == math.inf) == stays
    assert free_time(one, 0.1, 0.0, apart, duration=0.5, tolerated=1) == math.inf


def test_stamp_zero_is_seen_and_never_is_not() -> None:
    one = memory()
    assert not is_seen(one, 0.05, 0.05, -10)
    see_all(one, 0)
    assert is_seen(one, 0.05, 0.05, -10)
