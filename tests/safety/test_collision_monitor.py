"""The collision monitor on scans without a simulator: what it stops, slows, remembers and lets go."""

from __future__ import annotations

import math
import time

import msgspec
import numpy as np
import pytest

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot
from chefbot.safety.collision_monitor import FREE, CollisionMonitor
from chefbot.safety.monitor_polygons import CREEP_SPEED, PLANNED_BRAKING_FRACTION, safe_fraction
from chefbot.safety.params import CollisionMonitorParams

SECOND = 1_000_000_000
LATENCY = 0.1
Pair = tuple[float, float]
LIDAR, CAMERA, JACKAL = load_robot("chefbot_lidar"), load_robot("chefbot"), load_robot("jackal")


def monitor(robot: Robot) -> CollisionMonitor:
    return CollisionMonitor(robot, CollisionMonitorParams(), 0.04)


def scan(robot: Robot, points: list[tuple[float, float]], at_s: float = 1.0) -> LaserScan:
    """Return a scan from the lidar that shows points in base_link, each 2 cm wide, and nothing else."""
    lidar = robot.sensors.lidar
    assert lidar is not None
    angles = lidar.angle_min + lidar.angle_increment * np.arange(lidar.beams)
    ranges = np.full(lidar.beams, np.inf, np.float32)
    for x, y in points:
        distance, bearing = math.hypot(x - lidar.mount.x, y), math.atan2(y, x - lidar.mount.x)
        ranges[np.abs(np.remainder(angles - bearing + math.pi, 2 * math.pi) - math.pi) < 0.01 / distance] = (
            distance
        )
    header = Header.of(round(at_s * 1e9), "laser")
    limits = (0.0, 1.0 / lidar.rate, lidar.range_min, lidar.range_max)
    return LaserScan(header, float(angles[0]), float(angles[-1]), lidar.angle_increment, *limits, ranges)


def camera_scan(at: float = math.inf, at_s: float = 1.0, clear: float = 3.0) -> ObstacleScan:
    """Return an obstacle scan of the chefbot's camera: an obstacle straight ahead, and free floor before it."""
    angles = np.linspace(-0.5, 0.5, 160)
    ranges = np.where(np.abs(angles) < 0.1, at, np.inf).astype(np.float32)
    ends = np.minimum(ranges - 0.02, clear).astype(np.float32)
    starts = np.where(ends > 0.72, 0.72, np.inf).astype(np.float32)
    ends = np.where(ends > 0.72, ends, 0.0).astype(np.float32)
    step = float(angles[1] - angles[0])
    low, high = np.zeros(160, np.float32), np.full(160, 0.1, np.float32)
    return ObstacleScan(
        Header.of(round(at_s * 1e9), "camera_depth_frame"), -0.5, step, 8.0, ranges, starts, ends, low, high
    )


def lidar_pose(robot: Robot) -> SE2:
    assert robot.sensors.lidar is not None
    return robot.sensors.lidar.mount.planar


def seeing(robot: Robot, *points: tuple[float, float]) -> CollisionMonitor:
    one = monitor(robot)
    one.process_scan(scan(robot, list(points)), lidar_pose(robot))
    return one


def having_looked_around(robot: Robot = CAMERA) -> CollisionMonitor:
    """Return the monitor of a camera robot that has turned about where nothing stands."""
    one = monitor(robot)
    for yaw in np.arange(0.0, 2.0 * math.pi, 0.2).tolist():
        one.process_obstacles(camera_scan(), SE2(0.0, 0.0, yaw) @ SE2(0.07, 0.0, 0.0))
    return one


DIRECTIONS = [
    ((0.4, 0.0), (0.35, 0.0), "ahead"),
    ((0.33, 0.2), (0.35, 1.2), "ahead on the left"),
    ((-0.4, 0.0), (-0.35, 0.0), "behind"),
    ((-0.33, -0.2), (-0.35, 1.2), "behind on the right"),
]


@pytest.mark.parametrize(("point", "twist", "where"), DIRECTIONS)
def test_an_obstacle_on_the_arc_is_named_with_its_place(
    point: tuple[float, float], twist: tuple[float, float], where: str
) -> None:
    found = seeing(LIDAR, point).check(*twist, IDENTITY, SECOND, LATENCY)
    distance = math.hypot(*point) - LIDAR.circumscribed_radius
    assert found.fraction < 1.0
    assert found.limit == f"the lidar sees an obstacle {distance:.2f} m {where}"


@pytest.mark.parametrize(("point", "twist", "_"), DIRECTIONS)
def test_the_way_back_from_an_obstacle_is_free(
    point: tuple[float, float], twist: tuple[float, float], _: str
) -> None:
    assert seeing(LIDAR, point).check(-twist[0], -twist[1], IDENTITY, SECOND, LATENCY).fraction == 1.0
    assert seeing(LIDAR, point).check(0.0, 1.2, IDENTITY, SECOND, LATENCY).fraction == 1.0


@pytest.mark.parametrize("robot", [LIDAR, JACKAL], ids=lambda robot: robot.name)
@pytest.mark.parametrize("speed", [0.2, 0.6, 1.0])
def test_the_fraction_stops_before_the_obstacle(robot: Robot, speed: float) -> None:
    """Latency and braking with the planned deceleration end before the margin, and not far before it."""
    limits, front = Limits.of(robot), robot.footprint.front
    v = speed * limits.speed
    for gap in (0.05, 0.1, 0.3, 1.0):
        fraction = seeing(robot, (front + gap, 0.0)).check(v, 0.0, IDENTITY, SECOND, LATENCY).fraction
        f = fraction * v
        needed = f * LATENCY + f * f / (2 * PLANNED_BRAKING_FRACTION * limits.acceleration)
        assert needed <= gap - 0.02 + 1e-6
        assert fraction == 1.0 or needed >= gap - 0.02 - 0.021


def test_a_robot_beside_a_wall_drives_slowly_when_it_is_near() -> None:
    def along(gap: float) -> float:
        wall = [(x, LIDAR.circumscribed_radius + gap) for x in np.arange(-0.5, 0.6, 0.05)]
        return seeing(LIDAR, *wall).check(0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction

    assert along(0.03) == 1.0
    assert along(0.015) == pytest.approx(0.5, abs=0.05)


def test_what_is_far_enough_limits_nothing() -> None:
    """At 0.1 m/s the robot stops within 0.027 m; the obstacle is 0.03 m before the margin."""
    assert seeing(LIDAR, (0.21, 0.0)).check(0.1, 0.0, IDENTITY, SECOND, LATENCY) == FREE
    assert seeing(LIDAR, (0.2, 0.0)).check(0.1, 0.0, IDENTITY, SECOND, LATENCY).point is not None


def test_of_two_obstacles_the_one_that_stops_is_named() -> None:
    """One is a centimetre before the bumper, the other beside it, where only the slow polygon reaches."""
    front, side = JACKAL.footprint.polygon().max(axis=0)
    one = seeing(JACKAL, (0.1, side + 0.015), (front + 0.005, 0.0))
    found = one.check(0.2, 0.5, IDENTITY, SECOND, LATENCY)
    assert found.fraction == 0.0 and found.limit.endswith("0.00 m ahead")


def test_the_corner_of_a_rectangle_does_not_turn_into_a_wall() -> None:
    side = JACKAL.footprint.polygon()[:, 1].max()
    one = seeing(JACKAL, (0.0, side + 0.05), (0.1, side + 0.05))
    assert one.check(0.0, 1.0, IDENTITY, SECOND, LATENCY).fraction < 0.9
    assert one.check(0.3, 0.0, IDENTITY, SECOND, LATENCY).fraction == 1.0


def test_what_a_camera_saw_is_remembered_nearer_than_it_sees() -> None:
    """A low box seen at 0.97 m is 0.17 m ahead later, where the camera sees nothing; only time makes it go."""
    one = monitor(CAMERA)
    for k in range(34):
        x = 0.02 * k
        one.process_obstacles(camera_scan(0.9 - x if x < 0.4 else math.inf, 0.1 * k), SE2(x + 0.07, 0.0, 0.0))
        one.check(0.2, 0.0, SE2(x, 0.0, 0.0), k * SECOND // 10, LATENCY)
    near = SE2(0.65, 0.0, 0.0)
    found = one.check(0.35, 0.0, near, 4 * SECOND, LATENCY)
    assert found.fraction < 0.9 and found.limit == "the depth camera saw an obstacle 0.17 m ahead, 2 s ago"
    assert "obstacle" not in one.check(0.35, 0.0, near, 66 * SECOND, LATENCY).limit
    turned = SE2(0.65, 0.0, math.pi / 2)
    assert "obstacle" not in one.check(0.2, 0.0, turned, 4 * SECOND, LATENCY).limit


def test_what_left_is_forgotten_when_the_ground_is_seen_free() -> None:
    one = monitor(CAMERA)
    one.process_obstacles(camera_scan(0.9), SE2(0.07, 0.0, 0.0))
    one.process_obstacles(camera_scan(at_s=2.0), SE2(0.07, 0.0, 0.0))
    assert len(one.points(SE2(0.6, 0.0, 0.0), 2 * SECOND, 1.0)) == 0
    two = seeing(LIDAR, (0.4, 0.0))
    two.process_scan(scan(LIDAR, [], 2.0), lidar_pose(LIDAR))
    assert two.check(0.35, 0.0, IDENTITY, 2 * SECOND, LATENCY).fraction == 1.0


def test_a_hole_is_remembered_up_to_its_far_side() -> None:
    """Round the end of its edge a robot that has driven past would fall in, where its camera sees nothing."""
    one, hole = monitor(CAMERA), camera_scan(0.75)
    one.process_obstacles(msgspec.structs.replace(hole, lower_to=np.full(160, 1.0, np.float32)), IDENTITY)
    seen = one.points(IDENTITY, SECOND, 2.0)
    for x in np.arange(0.75, 1.0, 0.02).tolist():
        assert np.hypot(seen[:, 0] - x, seen[:, 1]).min() < one.polygons.resolution, x
    assert seen[:, 0].min() > 0.74 and seen[:, 0].max() < 1.01
    one.process_obstacles(camera_scan(at_s=2.0), IDENTITY)
    assert not len(one.points(IDENTITY, 2 * SECOND, 2.0)), "the floor is seen free"


def test_unseen_ground_is_not_free_for_backing() -> None:
    one = monitor(CAMERA)
    for k in range(40):  # it drives forward by 0.4 m
        one.process_obstacles(camera_scan(at_s=0.1 * k), SE2(0.01 * k + 0.07, 0.0, 0.0))
        one.check(0.1, 0.0, SE2(0.01 * k, 0.0, 0.0), k * SECOND // 10, LATENCY)
    here = SE2(0.39, 0.0, 0.0)
    back = one.check(-0.14, 0.0, here, 4 * SECOND, LATENCY)
    assert back.fraction == pytest.approx(CREEP_SPEED / 0.14), "its own body was there a moment ago"
    begin = one.check(-0.14, 0.0, SE2(0.0, 0.0, 0.0), 4 * SECOND, LATENCY)
    assert begin.fraction == 0.0
    assert begin.limit == "no sensor has recently seen the ground behind the robot"
    later = one.check(-0.14, 0.0, here, 60 * SECOND, LATENCY)
    assert later.fraction == 0.0, "somebody may have come since"


@pytest.mark.parametrize("robot", [CAMERA, JACKAL], ids=lambda robot: robot.name)
def test_a_robot_does_not_creep_backwards_step_by_step(robot: Robot) -> None:
    one, x = monitor(robot), 0.0
    for k in range(100):
        fraction = one.check(-0.3, 0.0, SE2(x, 0.0, 0.0), SECOND + k * SECOND // 20, LATENCY).fraction
        x -= 0.3 * fraction / 20
    assert x == 0.0


def test_a_robot_that_sees_ahead_drives_slowly_on_unseen_ground() -> None:
    one = having_looked_around()
    assert one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction == 1.0
    later = one.check(0.35, 0.0, IDENTITY, 60 * SECOND, LATENCY)
    assert later.fraction == pytest.approx(0.5)
    assert later.limit == "no sensor has recently seen the ground ahead of the robot"
    assert monitor(LIDAR).check(-0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction == 1.0, (
        "its lidar covers the rear"
    )
    jackal = monitor(JACKAL)
    assert jackal.check(-1.0, 0.0, IDENTITY, SECOND, LATENCY).fraction == 0.0
    assert 0.0 < jackal.check(0.0, 2.0, IDENTITY, SECOND, LATENCY).fraction < 1.0


def test_over_ground_that_was_never_seen_a_robot_creeps() -> None:
    """What stands beside a robot that was just switched on is in nobody's view."""
    one = monitor(CAMERA)
    unconnected = one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY)
    assert unconnected.fraction == pytest.approx(0.5), "the camera has sent nothing: it cannot look first"
    one.process_obstacles(camera_scan(), SE2(3.0, 3.0, 0.0))
    assert one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction == pytest.approx(CREEP_SPEED / 0.35)
    one.process_obstacles(camera_scan(), SE2(0.07, 0.0, 0.0))
    assert one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction < 0.4, "the view is narrow near the body"
    assert one.check(0.0, 1.2, IDENTITY, SECOND, LATENCY).fraction == 1.0, "it can turn and look"
    assert one.check(0.35, 0.0, SE2(0.6, 0.0, 0.0), SECOND, LATENCY).fraction == 1.0, "the view has its width"


@pytest.mark.parametrize("distance", [0.1, 0.02, -math.inf, math.nan])
def test_the_ultrasonic_ranger_stops_the_drive_ahead(distance: float) -> None:
    one = having_looked_around()
    one.process_echo(Range(Header.of(SECOND, "ultrasonic_link"), 0, 0.5, 0.02, 4.0, distance))
    found = one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY)
    assert found.fraction < 0.5 and "ultrasonic ranger" in found.limit
    assert "ultrasonic" not in one.check(-0.35, 0.0, IDENTITY, SECOND, LATENCY).limit
    assert "ultrasonic" not in one.check(0.35, 0.0, IDENTITY, 2 * SECOND, LATENCY).limit, "the echo is old"


def test_stricter_parameters_apply_at_once() -> None:
    one = seeing(LIDAR, (0.5, 0.0))
    before = one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction
    one.configure(CollisionMonitorParams(margin=0.2), 0.04)
    assert one.check(0.35, 0.0, IDENTITY, SECOND, LATENCY).fraction < before


def test_safe_fraction_at_its_ends() -> None:
    assert safe_fraction(0.0, 0.1, 1.0) == 0.0 and safe_fraction(-1.0, 0.1, 1.0) == 0.0
    assert safe_fraction(math.inf, 0.1, 1.0) == 1.0 and safe_fraction(10.0, 0.1, 1.0) == 1.0
    assert safe_fraction(0.05, 0.1, 0.0) == 0.5 and safe_fraction(0.05, 0.0, 0.0) == 1.0


@pytest.mark.parametrize("damage", [-1e9, -math.inf, math.nan, 1e30, math.inf])
@pytest.mark.parametrize("field", ["ranges", "clear_from", "clear_to", "lower_to"])
def test_absurd_distances_of_a_scan_cost_no_time(field: str, damage: float) -> None:
    """A ray from -1e9 m on would be 2e10 cells long; only what is within reach of the memory counts."""
    fields = {"lower_to": np.full(160, 2.0, np.float32), field: np.full(160, damage, np.float32)}
    absurd = msgspec.structs.replace(camera_scan(at=1.0), **fields)
    checked = monitor(CAMERA)
    checked.process_obstacles(camera_scan(), IDENTITY)  # compiles
    began = time.process_time()
    checked.process_obstacles(absurd, IDENTITY)
    assert time.process_time() - began < 5.0, "it takes a tenth of a millisecond, or hours"
    assert np.isfinite(checked.points(IDENTITY, SECOND, 2.0)).all()
