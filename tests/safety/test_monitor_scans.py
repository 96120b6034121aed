"""What scans mark, clear and show in the collision monitor: each returns what its sensor knows, and no more."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from tests.support.monitor_scans import SECOND, monitor, obstacles, scan

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.safety import local_memory as memory
from chefbot.safety.collision_monitor import CollisionMonitor
from chefbot.safety.params import CollisionMonitorParams

LIDAR, CAMERA, JACKAL = load_robot("chefbot_lidar"), load_robot("chefbot"), load_robot("jackal")
NOTHING = math.inf


def distances(one: CollisionMonitor, now_s: float = 3.0, reach: float = 0.9) -> list[float]:
    """Return the distances of all remembered points, in order."""
    points = one.points(IDENTITY, round(now_s * SECOND), reach)
    return sorted(np.hypot(*points.T).tolist())


def with_noise(noise: float) -> Robot:
    """Return the robot with a lidar of another noise, m."""
    assert LIDAR.sensors.lidar is not None
    lidar = msgspec.structs.replace(LIDAR.sensors.lidar, noise=noise)
    return msgspec.structs.replace(LIDAR, sensors=msgspec.structs.replace(LIDAR.sensors, lidar=lidar))


def with_camera(z: float, pitch: float) -> Robot:
    """Return the camera robot with its camera at another height (m) and pitch (rad, downwards)."""
    camera = CAMERA.sensors.depth_camera
    assert camera is not None
    mounted = msgspec.structs.replace(camera, mount=msgspec.structs.replace(camera.mount, z=z, pitch=pitch))
    return msgspec.structs.replace(
        CAMERA, sensors=msgspec.structs.replace(CAMERA.sensors, depth_camera=mounted)
    )


# -- the planar scan


@pytest.mark.parametrize(("noise", "excess", "clears"), [
    (0.01, -0.01, False), (0.01, 0.039, False), (0.01, 0.041, True), (0.0, 0.0, True), (0.0, -0.001, False),
])  # fmt: skip
def test_returns_near_the_minimum_range_clear_nothing(noise: float, excess: float, clears: bool) -> None:
    """Of a surface at the minimum range only those returns remain that are too long: up to four deviations."""
    one = monitor(with_noise(noise))
    one.process_scan(scan(0.3), IDENTITY)
    one.process_scan(scan(0.5 + excess, 2.0, range_min=0.5), IDENTITY)
    assert (min(distances(one)) > 0.4) == clears


@pytest.mark.parametrize("invalid", [0.0, -1.0, -math.inf, math.nan])
def test_invalid_ranges_mark_and_clear_nothing(invalid: float) -> None:
    one = monitor(LIDAR)
    one.process_scan(scan(0.5), IDENTITY)
    before, seen = distances(one), one._memory.seen_ns.copy()
    one.process_scan(scan(invalid, 2.0), IDENTITY)
    assert distances(one) == before and np.array_equal(one._memory.seen_ns, seen)


def test_the_maximum_range_is_not_an_obstacle() -> None:
    """Some lidars send it where they measure nothing."""
    one = monitor(LIDAR)
    one.process_scan(scan(0.5, range_max=0.5), IDENTITY)
    assert distances(one) == []
    one.process_scan(scan(0.499, 2.0, range_max=0.5), IDENTITY)
    assert distances(one)[0] == pytest.approx(0.499)


def test_a_surface_does_not_clear_what_is_behind_it() -> None:
    one = monitor(LIDAR)
    one.process_scan(scan(0.6), IDENTITY)
    before = distances(one)
    one.process_scan(scan(0.55, 2.0), IDENTITY)
    assert [d for d in distances(one) if d > 0.59] == before


def test_a_scan_clears_from_where_its_sensor_sees() -> None:
    """A lidar sees past what is nearer than it measures; a camera's planar scan begins at its minimum range."""
    lidar, camera = monitor(LIDAR), monitor(CAMERA)
    lidar.process_scan(scan(0.3), IDENTITY)
    lidar.process_scan(scan(0.7, 2.0, range_min=0.5), IDENTITY)
    assert min(distances(lidar)) > 0.6
    camera.process_obstacles(obstacles(0.4, NOTHING, 0.0, top=9.0), IDENTITY)
    camera.process_scan(scan(0.7, 2.0, range_min=0.5), IDENTITY)
    assert distances(camera)[0] == pytest.approx(0.4)
    camera.process_scan(scan(0.7, 2.5, range_min=0.2), IDENTITY)
    assert distances(camera)[0] == pytest.approx(0.7)


def test_a_wall_behind_a_low_box_is_remembered() -> None:
    """The obstacle scan shows the nearest only; with the box out of view, the wall beside it is still there."""
    one = monitor(CAMERA)
    one.process_obstacles(obstacles(0.5, 0.3, 0.5), IDENTITY)
    one.process_scan(scan(0.8), IDENTITY)
    found = distances(one)
    assert any(abs(distance - 0.5) < 0.02 for distance in found)
    assert any(abs(distance - 0.8) < 0.02 for distance in found)


def test_what_a_cameras_scan_shows_is_the_cameras() -> None:
    one = monitor(CAMERA)
    one.process_scan(scan(0.25), IDENTITY)
    assert "depth camera" in one.check(0.3, 0.0, IDENTITY, SECOND, 0.1).limit


def test_a_fine_scan_clears_all_that_it_passes() -> None:
    one = monitor(LIDAR)
    for distance in (0.3, 0.4, 0.5):  # what can matter is nearer than 0.55 m
        one.process_scan(scan(distance), IDENTITY)
    one.process_scan(scan(NOTHING, 2.0, beams=7200), IDENTITY)
    assert distances(one) == []


@pytest.mark.parametrize("robot", [LIDAR, JACKAL], ids=lambda robot: robot.name)
def test_of_fine_rays_one_passes_through_each_cell(robot: Robot) -> None:
    """More cost time and clear nothing more: at the end of the memory they are a cell apart."""
    one = monitor(robot)
    cell, farthest = one.polygons.resolution, one.reach
    for increment in (cell / farthest / 7.5, -cell / farthest / 7.5):
        assert one._thinning(increment) == 7
    assert one._thinning(cell / farthest * 1.1) == 1 == one._thinning(0.0) == one._thinning(1.0)


# -- layers


def test_a_lidar_does_not_clear_what_is_below_its_plane() -> None:
    one = monitor(LIDAR)
    one.process_obstacles(obstacles(0.4, NOTHING, 0.0), IDENTITY)
    one.process_scan(scan(0.7, 2.0), IDENTITY)
    assert distances(one)[0] == pytest.approx(0.4)


def test_a_camera_does_not_clear_what_the_lidar_saw() -> None:
    """Glass may show the camera the floor behind it."""
    one = monitor(LIDAR)
    one.process_scan(scan(0.5), IDENTITY)
    before = distances(one)
    one.process_obstacles(obstacles(NOTHING, 0.0, 0.8, 2.0), IDENTITY)
    assert distances(one) == before


@pytest.mark.parametrize("top", [0.1, 9.0])
def test_seen_floor_clears_what_the_camera_saw(top: float) -> None:
    one = monitor(CAMERA)
    one.process_obstacles(obstacles(0.5, NOTHING, 0.0, top=top), IDENTITY)
    assert distances(one)
    one.process_obstacles(obstacles(NOTHING, 0.0, 0.8, 2.0), IDENTITY)
    assert distances(one) == []


# -- ground


def test_over_seen_floor_the_camera_has_looked_as_well() -> None:
    one = monitor(CAMERA)
    one.process_obstacles(obstacles(NOTHING, 0.413, 0.9), SE2(0.013, 0.007, 0.3))
    floor, view = one._memory.seen_ns[memory.GROUND], one._memory.seen_ns[memory.VIEW]
    assert (floor == SECOND).any() and (view[floor == SECOND] == SECOND).all()


def test_a_camera_without_data_has_seen_no_ground() -> None:
    one = monitor(CAMERA)
    one.process_obstacles(obstacles(NOTHING, NOTHING, 0.0), IDENTITY)
    assert (one._memory.seen_ns == memory.NEVER_NS).all()


def test_floor_without_a_beginning_is_not_seen() -> None:
    """Then nobody knows how much of it was in the picture."""
    one = monitor(CAMERA)
    for clear_from in (NOTHING, math.nan):
        one.process_obstacles(obstacles(NOTHING, clear_from, 0.6), IDENTITY)
    assert (one._memory.seen_ns[memory.GROUND] == memory.NEVER_NS).all()


def test_ground_that_was_seen_at_time_zero_was_seen() -> None:
    """The clock of a simulation begins at zero: half a minute later the robot is slow there, and does not creep."""
    one = monitor(CAMERA)
    for yaw in np.arange(0.0, 2.0 * math.pi, 0.2).tolist():
        one.process_obstacles(obstacles(NOTHING, 0.0, 0.9, 0.0), SE2(0.0, 0.0, yaw))
    assert one.check(0.35, 0.0, IDENTITY, 60 * SECOND, 0.1).fraction == pytest.approx(0.5)


# -- time and place


@pytest.mark.parametrize(("age_ms", "left"), [(0, True), (5000, True), (5001, False)])
@pytest.mark.parametrize("begin_s", [0, 1, 100])
def test_points_are_kept_for_the_requested_time(begin_s: int, age_ms: int, left: bool) -> None:
    one = CollisionMonitor(LIDAR, CollisionMonitorParams(obstacle_memory_time=5.0), 0.04)
    one.process_scan(scan(0.5, begin_s), IDENTITY)
    assert bool(distances(one, begin_s + age_ms / 1000.0)) == left


@pytest.mark.parametrize(("z", "pitch", "blind"), [
    (1.0, 0.0, 0.07 + 1.0 / 0.4150),  # the lower edge of the picture is 22.54 degrees below its middle
    (1.0, math.radians(22.46), 0.07 + 1.0),
    (0.3, -0.6, 0.07 + 0.3 / math.tan(0.1)),  # it hardly sees the floor
])  # fmt: skip
def test_the_memory_reaches_the_first_floor_in_the_picture(z: float, pitch: float, blind: float) -> None:
    """Up to where a camera sees the floor, and around a body that has driven there."""
    one = monitor(with_camera(z, pitch))
    farthest, cell = blind + 2.0 * CAMERA.circumscribed_radius, one.polygons.resolution
    for distance, kept in ((farthest - 0.003, True), (farthest + cell + 0.003, False)):
        one.process_obstacles(obstacles(distance, NOTHING, 0.0, distance), IDENTITY)
        assert bool(distances(one, distance, 20.0)) == kept
        one = monitor(with_camera(z, pitch))


def test_without_a_camera_the_memory_is_as_large_as_the_polygons() -> None:
    one = monitor(JACKAL)
    farthest, cell = one.polygons.reach + 2.0 * JACKAL.circumscribed_radius, one.polygons.resolution
    one.process_scan(scan(farthest + cell), IDENTITY)
    assert distances(one, 1.0, 20.0) == []
    one.process_scan(scan(farthest), IDENTITY)
    assert distances(one, 1.0, 20.0)[0] == pytest.approx(farthest)
