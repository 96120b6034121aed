"""The figures of the collision monitor: how old an echo counts, how wide its cone is, and what counts as seen."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from tests.support.monitor_scans import MS, SECOND, echo, is_seen, monitor, obstacles, scan

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot
from chefbot.safety import local_memory as memory
from chefbot.safety.collision_monitor import FREE
from chefbot.safety.monitor_polygons import CREEP_SPEED, safe_fraction
from chefbot.safety.monitor_text import MIN_DRIVING_SPEED

LATENCY = 0.1
LIDAR, CAMERA, JACKAL = load_robot("chefbot_lidar"), load_robot("chefbot"), load_robot("jackal")


def test_a_twist_of_nothing_is_free_wherever_the_robot_stands() -> None:
    one = monitor(LIDAR)
    one.process_scan(scan(0.17), SE2(0.0, 0.0, 0.0))
    assert one.check(0.0, 0.0, IDENTITY, SECOND, LATENCY) == FREE == (1.0, "", None)
    assert one.check(0.3, 0.0, IDENTITY, SECOND, LATENCY).fraction < 0.2


@pytest.mark.parametrize(("age_ms", "stops"), [(0, True), (300, True), (301, False)])
def test_an_echo_counts_for_300_ms(age_ms: int, stops: bool) -> None:
    one = monitor(CAMERA)
    one.process_echo(echo(0.02))
    found = one.check(0.35, 0.0, IDENTITY, SECOND + age_ms * MS, LATENCY)
    assert ("ultrasonic" in found.limit) == stops


def test_an_empty_cone_stops_nothing() -> None:
    one = monitor(LIDAR)
    one.process_echo(echo(math.inf))
    assert one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY) == FREE


def ranger_at(x: float, y: float, yaw: float, field_of_view: float) -> Robot:
    """Return the robot with a lidar and its ranger mounted elsewhere."""
    ranger = LIDAR.sensors.ultrasonic
    assert ranger is not None
    mount = msgspec.structs.replace(ranger.mount, x=x, y=y, yaw=yaw)
    changed = msgspec.structs.replace(ranger, mount=mount, field_of_view=field_of_view)
    return msgspec.structs.replace(LIDAR, sensors=msgspec.structs.replace(LIDAR.sensors, ultrasonic=changed))


@pytest.mark.parametrize(("yaw", "v"), [(0.0, 0.3), (math.pi, -0.3)])
def test_a_ranger_looks_where_it_is_mounted(yaw: float, v: float) -> None:
    sign = math.copysign(1.0, v)
    one = monitor(ranger_at(sign * 0.1, 0.0, yaw, 0.3))
    one.process_echo(echo(0.1))
    assert one.check(v, 0.0, IDENTITY, SECOND, LATENCY).fraction < 0.2
    assert one.check(-v, 0.0, IDENTITY, SECOND, LATENCY) == FREE


def test_a_ranger_may_look_to_one_side() -> None:
    """Before the robot on its left, 35 degrees from ahead: on the path of a curve to the left only."""
    one = monitor(ranger_at(0.1, 0.03, math.radians(35.0), 0.1))
    one.process_echo(echo(0.2))
    left = one.check(0.3, 1.5, IDENTITY, SECOND, LATENCY)
    assert left.fraction < 0.8 and left.limit.endswith("ahead on the left")
    assert left.point is not None
    expected = 0.1 + 0.2 * math.cos(math.radians(35.0)), 0.03 + 0.2 * math.sin(math.radians(35.0))
    assert math.dist((left.point.x, left.point.y), expected) < 0.011, "within the cone"
    assert one.check(0.3, -1.5, IDENTITY, SECOND, LATENCY) == FREE


def test_an_echo_counts_at_its_distance_and_with_its_age() -> None:
    """A surface straight ahead is 0.12 m from the stop polygon; 0.04 m of it are the ranger's margin."""
    one = monitor(ranger_at(0.0, 0.0, 0.0, math.radians(80.0)))
    one.process_echo(echo(0.28))
    found = one.check(0.35, 0.0, IDENTITY, SECOND + 250 * MS, LATENCY)
    free_time = (0.28 - LIDAR.circumscribed_radius - 0.01 - 0.04) / 0.35
    braking_time = 0.35 / (0.6 * Limits.of(LIDAR).acceleration)
    assert found.fraction == pytest.approx(safe_fraction(free_time, LATENCY, braking_time))
    assert found.point == ("ultrasonic ranger", pytest.approx(0.28), pytest.approx(0.0), pytest.approx(0.25))


def test_an_echo_ends_no_turn_and_no_slow_drive() -> None:
    """A disc that rotates in place comes no nearer; 0.03 m before the margin are enough at 0.1 m/s."""
    one = monitor(LIDAR)
    one.process_echo(echo(0.09))
    for v, w in ((0.0, 1.0), (0.0, 5e-324), (0.1, 0.0)):
        assert one.check(v, w, IDENTITY, SECOND, LATENCY) == FREE
    assert one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction < 1.0


def test_a_narrow_cone_has_narrow_edges() -> None:
    """A curve passes the surface ten degrees to both sides of the middle, and would meet it at forty."""
    one = monitor(ranger_at(0.0, 0.0, 0.0, math.radians(20.0)))
    one.process_echo(echo(0.28))
    assert (
        one.check(0.3, 3.0, IDENTITY, SECOND, LATENCY)
        == FREE
        == one.check(0.3, -3.0, IDENTITY, SECOND, LATENCY)
    )


def test_the_whole_cone_of_a_ranger_may_hold_the_surface() -> None:
    """A cone of 80 degrees: its edges, 0.18 m to the sides, are beside a straight path and on that of a curve."""
    one = monitor(ranger_at(0.0, 0.0, 0.0, math.radians(80.0)))
    one.process_echo(echo(0.28))
    for w in (3.0, -3.0):  # on a circle of 0.1 m the body passes the middle of the cone, but not its edge
        curve = one.check(0.3, w, IDENTITY, SECOND, LATENCY)
        assert curve.fraction < 1.0 and ("on the left" in curve.limit) == (w > 0.0)
    middle = one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY)
    assert middle.limit.endswith("0.13 m ahead")


def test_a_ray_without_return_is_free_as_far_as_lidar_measures() -> None:
    """A short lidar does not clear what the robot knows beyond its range, and sees no ground there."""
    for range_max, cleared in ((0.3, False), (0.7, True)):
        one = monitor(LIDAR)
        one.process_scan(scan(0.5), SE2(0.0, 0.0, 0.0))
        one.process_scan(scan(math.inf, 2.0, range_max), SE2(0.0, 0.0, 0.0))
        assert (len(one.points(IDENTITY, 2 * SECOND, 0.8)) == 0) == cleared
        assert is_seen(one, 0.25, memory.GROUND) and is_seen(one, 0.6, memory.GROUND) == cleared


def test_the_scan_of_a_camera_marks_and_clears_in_its_plane() -> None:
    """As the obstacle scan does, which has all heights, but in each direction the nearest obstacle only."""
    one = monitor(CAMERA)
    one.process_obstacles(obstacles(0.4, math.inf, 0.0, top=9.0), IDENTITY)
    assert len(one.points(IDENTITY, SECOND, 0.5)) > 0
    one.process_scan(scan(0.7, 2.0), SE2(0.0, 0.0, 0.0))
    assert len(one.points(IDENTITY, 2 * SECOND, 0.5)) == 0
    assert len(one.points(IDENTITY, 2 * SECOND, 0.8)) > 200, "a point in each cell"
    assert not is_seen(one, 0.6, memory.GROUND), "but no floor is seen by it"


def test_seen_floor_is_ground_what_is_before_it_is_in_view_only() -> None:
    """Nearer than its picture begins the camera looks over the floor; beyond the obstacle it sees nothing."""
    one = monitor(CAMERA)
    one.process_obstacles(obstacles(0.7, 0.4, 0.6), SE2(0.0, 0.0, 0.0))
    expected = {0.25: (False, True), 0.5: (True, True), 0.655: (False, True), 0.9: (False, False)}
    for x, (ground, view) in expected.items():
        assert is_seen(one, x, memory.GROUND) == ground, x
        assert is_seen(one, x, memory.VIEW) == view, x


def backing(unseen_from: float) -> float:
    """Return the fraction of backing at 0.1 m/s where the ground was seen up to a distance from the axle."""
    one = monitor(CAMERA)
    for bearing in np.linspace(-math.pi, math.pi, 400):
        memory.clear_rays(
            one._memory, np.zeros(3), np.array([bearing]), np.zeros(1), np.array([unseen_from]), SECOND,
            np.zeros(3, np.bool_), np.ones(2, np.bool_),
        )  # fmt: skip
    return one.check(-0.1, 0.0, IDENTITY, SECOND, LATENCY).fraction


def test_backing_ends_two_cells_before_unseen_ground() -> None:
    """Of two seen cells behind its outline a quarter of one is left; it stands when they end at its skin."""
    cell, r = 0.025, CAMERA.circumscribed_radius
    assert backing(r + 2 * cell) == pytest.approx(CREEP_SPEED / 0.1) == backing(r + 8 * cell)
    braking_time = 0.1 / (0.6 * Limits.of(CAMERA).acceleration)
    assert backing(r + cell) == pytest.approx(safe_fraction(0.25 * cell / 0.1, LATENCY, braking_time))
    assert backing(r) == 0.0


@pytest.mark.parametrize("v", [-0.01, -0.02, -0.04, -0.1])
@pytest.mark.parametrize("w", [0.0, 0.05, 0.5, -0.5])
def test_a_slow_robot_does_not_back_step_by_step(v: float, w: float) -> None:
    """The ground below it counts as seen; if it looked no farther than it brakes, it made its own path behind it."""
    for yaw in np.arange(0.1, 6.0, 0.4):
        one, pose, driven = monitor(CAMERA), SE2(0.013, -0.007, float(yaw)), 0.0
        for k in range(60):
            fraction = one.check(v, w, pose, SECOND + k * 50 * MS, LATENCY).fraction
            pose = pose @ SE2(0.05 * fraction * v, 0.0, 0.05 * fraction * w)
            driven += 0.05 * fraction * abs(v)
        assert driven < 0.25 * one.polygons.resolution


@pytest.mark.parametrize(("gap", "free"), [(2, True), (3, False)])
def test_two_cells_between_rays_may_be_unseen(gap: int, free: bool) -> None:
    """Behind the robot a strip across its path was not seen; a strip narrower than three points does not matter."""
    one = monitor(CAMERA)
    cell, seen = one.polygons.resolution, one._memory
    n = seen.seen_ns.shape[1]
    for row in range(-12, 12):
        for column in range(-16, 12):
            if column >= -7 or not 0 <= row < gap:
                seen.seen_ns[:, row % n, column % n] = SECOND
                seen.seen_cell[:, row % n, column % n] = (column, row)
    fraction = one.check(-0.1, 0.0, SE2(0.3 * cell, 0.1 * cell, 0.0), SECOND, 1.0).fraction
    assert (fraction == pytest.approx(CREEP_SPEED / 0.1)) == free


@pytest.mark.parametrize(("gap", "free"), [(5, True), (8, False)])
def test_ahead_half_the_width_may_be_unseen_of_late(gap: int, free: bool) -> None:
    """A strip across the path that was seen once is new ground again for a robot as wide as twelve cells."""
    one = monitor(CAMERA)
    cell, seen = one.polygons.resolution, one._memory
    n = seen.seen_ns.shape[1]
    for row in range(-12, 12):
        for column in range(-12, 20):
            strip = column >= 7 and abs(row + 0.5) < gap / 2.0
            seen.seen_ns[:, row % n, column % n] = 1 if strip else 100 * SECOND
            seen.seen_cell[:, row % n, column % n] = (column, row)
    offset = 0.5 * cell * (gap % 2)  # the middle of the strip is before the robot
    one.process_obstacles(obstacles(math.inf, math.inf, 0.0, 100.0), SE2(9.0, 9.0, 0.0))
    fraction = one.check(0.35, 0.0, SE2(0.3 * cell, offset, 0.0), 100 * SECOND, LATENCY).fraction
    assert fraction == pytest.approx(1.0 if free else 0.5)


def test_a_millimetre_per_second_backwards_is_not_motion() -> None:
    """A turn on the spot has it by rounding; a hundredth more is a motion backwards."""
    one = monitor(CAMERA)
    for v, w in ((-MIN_DRIVING_SPEED, 0.0), (-0.5 * MIN_DRIVING_SPEED, 1.0), (0.5 * MIN_DRIVING_SPEED, 1.0)):
        assert one.check(v, w, IDENTITY, SECOND, LATENCY) == FREE
    assert one.check(-1.01 * MIN_DRIVING_SPEED, 0.0, IDENTITY, SECOND, LATENCY).fraction == 0.0


def test_a_rectangle_turns_slowly_over_unseen_ground() -> None:
    """Its corners sweep over what is beside it; a sensor that works could have looked there before."""
    one = monitor(JACKAL)
    assert one.check(0.0, 1.0, IDENTITY, SECOND, LATENCY) == FREE
    fast = one.check(0.0, 2.0, IDENTITY, SECOND, LATENCY)
    assert (
        0.5 < fast.fraction < 1.0 and fast.limit == "no sensor has recently seen the ground beside the robot"
    )
    one.process_scan(scan(2.0), SE2(5.0, 5.0, 0.0))
    assert CREEP_SPEED < one.check(0.0, 2.0, IDENTITY, SECOND, LATENCY).fraction < 0.5


def test_a_scan_without_ranges_changes_nothing() -> None:
    one = monitor(LIDAR)
    one.process_scan(scan(0.5), SE2(0.0, 0.0, 0.0))
    before = one.points(IDENTITY, SECOND, 0.8).copy()
    empty = msgspec.structs.replace(scan(0.5, 2.0), angle_increment=0.0, ranges=np.empty(0, np.float32))
    one.process_scan(empty, SE2(0.0, 0.0, 0.0))
    none = np.empty(0, np.float32)
    one.process_obstacles(ObstacleScan(Header.of(2 * SECOND, "camera"), 0.0, 0.0, 8.0, *[none] * 5), IDENTITY)
    assert np.array_equal(one.points(IDENTITY, 2 * SECOND, 0.8), before)


@pytest.mark.parametrize("clockwise", [False, True])
def test_a_scan_may_run_clockwise_and_be_fine(clockwise: bool) -> None:
    """Of 7200 beams some are left out for clearing; the post that one of them shows is marked in any case."""
    fine = scan(math.inf, beams=7200)
    fine.ranges[3600 + 1800] = 0.4
    if clockwise:
        fine = msgspec.structs.replace(
            fine, angle_min=fine.angle_max, angle_max=fine.angle_min, angle_increment=-fine.angle_increment
        )
    one = monitor(LIDAR)
    one.process_scan(fine, SE2(0.0, 0.0, 0.0))
    ((x, y),) = one.points(IDENTITY, SECOND, 0.8)
    assert (x, y) == pytest.approx((0.0, -0.4 if clockwise else 0.4), abs=0.01)
