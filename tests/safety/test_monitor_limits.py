"""The figures of the collision monitor: how old an echo counts, how wide its cone is, and what counts as seen."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.safety import local_memory as memory
from chefbot.safety.collision_monitor import FREE, CollisionMonitor
from chefbot.safety.params import CollisionMonitorParams
from chefbot.safety.zones import CREEP_SPEED

SECOND, MS = 1_000_000_000, 1_000_000
LATENCY = 0.1
LIDAR, CAMERA = load_robot("chefbot_lidar"), load_robot("chefbot")


def monitor(robot: Robot) -> CollisionMonitor:
    return CollisionMonitor(robot, CollisionMonitorParams(), 0.04)


def echo(distance: float, time_ms: int = 1000) -> Range:
    return Range(Header.of(time_ms * MS, "ultrasonic_link"), 0, 0.5, 0.02, 4.0, distance)


def scan(distance: float, at_s: float = 1.0, range_max: float = 8.0, beams: int = 360) -> LaserScan:
    """Return a scan that shows the same distance all around."""
    step = 2.0 * math.pi / beams
    ranges = np.full(beams, distance, np.float32)
    return LaserScan(
        Header.of(round(at_s * SECOND), "laser"),
        -math.pi,
        math.pi - step,
        step,
        0.0,
        0.1,
        0.1,
        range_max,
        ranges,
    )


def obstacles(at: float, clear_from: float, clear_to: float, at_s: float = 1.0) -> ObstacleScan:
    """Return an obstacle scan of directions up to half a radian to each side."""
    values = [np.full(160, value, np.float32) for value in (at, clear_from, clear_to, 0.0, 0.1)]
    return ObstacleScan(Header.of(round(at_s * SECOND), "camera_depth_frame"), -0.5, 1.0 / 159, 8.0, *values)


def is_seen(one: CollisionMonitor, x: float, kind: int) -> bool:
    """Return whether the ground there, on the x axis of odom, counts as seen."""
    cell, outline = one.zones.resolution, np.zeros((1, 2))
    pose = np.array([x - cell, 0.0, 0.0])
    time = memory.time_on_seen_ground(one._memory, pose, cell, 0.0, outline, 0.5, 0, 0, kind)
    return time == math.inf


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


def test_the_whole_cone_of_a_ranger_may_hold_the_surface() -> None:
    """A cone of 80 degrees: its edges, 0.18 m to the sides, are beside a straight way and on that of a curve."""
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


def test_the_scan_of_a_camera_only_clears() -> None:
    """Made of its picture, it shows one height; obstacles of all heights come in the obstacle scan."""
    one = monitor(CAMERA)
    one.process_scan(scan(0.4), SE2(0.0, 0.0, 0.0))
    assert len(one.points(IDENTITY, SECOND, 0.8)) == 0
    one.process_obstacles(
        msgspec.structs.replace(obstacles(0.4, math.inf, 0.0), top=np.full(160, 9.0, np.float32)), IDENTITY
    )
    assert len(one.points(IDENTITY, SECOND, 0.8)) > 0
    one.process_scan(scan(0.7, 2.0), SE2(0.0, 0.0, 0.0))
    assert len(one.points(IDENTITY, 2 * SECOND, 0.8)) == 0, "upright things in the plane are cleared by it"
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
    """It creeps while known ground reaches a cell beyond its skin, and stands when it ends at the skin."""
    cell, r = 0.025, CAMERA.circumscribed_radius
    assert backing(r + 8 * cell) == pytest.approx(CREEP_SPEED / 0.1) == backing(r + cell)
    assert backing(r) == 0.0


@pytest.mark.parametrize(("gap", "free"), [(2, True), (3, False)])
def test_two_cells_between_rays_may_be_unseen(gap: int, free: bool) -> None:
    """Behind the robot a strip across its way was not seen; a strip narrower than three points does not matter."""
    one = monitor(CAMERA)
    cell, seen = one.zones.resolution, one._memory
    n = seen.seen_ns.shape[1]
    for row in range(-12, 12):
        for column in range(-16, 12):
            if column >= -7 or not 0 <= row < gap:
                seen.seen_ns[:, row % n, column % n] = SECOND
                seen.seen_cell[:, row % n, column % n] = (column, row)
    fraction = one.check(-0.1, 0.0, SE2(0.3 * cell, 0.1 * cell, 0.0), SECOND, 1.0).fraction
    assert (fraction == pytest.approx(CREEP_SPEED / 0.1)) == free


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
