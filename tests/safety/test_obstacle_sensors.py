"""The obstacle sensors of a robot file: which fault is named, and that a recovered sensor is trusted again."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.diagnostic_msgs import ERROR, OK
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.section import Mount
from chefbot.robot.spec import Robot
from chefbot.safety.known_obstacles import MarkedCells, RememberedPoints
from chefbot.safety.obstacle_sensors import (
    BLIND,
    BLIND_LIDAR,
    HIDDEN,
    OK_MESSAGE,
    SCATTERED,
    ObstacleSensors,
    camera_view,
    laser_view,
)

ROBOT = load_robot("chefbot_lidar")
STANDING = SE2(0.0, 0.0, 0.0)
COSTS = Costmap(np.zeros((20, 20), np.uint8), 0.05, -0.5, -0.5)
PERIOD_NS = 100_000_000
BINS, FIRST, STEP = 160, -0.5, 1.0 / 160
CELL = 0.025
"""Side of a cell of the memory, m."""
"""The directions of the camera's obstacle scans here, from right to left."""


def points(known: np.ndarray, resolution: float = CELL) -> RememberedPoints:
    return RememberedPoints(lambda: known, resolution)


NOTHING = points(np.zeros((0, 2)))


def scan(stamp_ns: int, distance: float = 3.0) -> LaserScan:
    ranges = np.full(360, distance, np.float32)
    header = Header.of(stamp_ns, "laser")
    return LaserScan(header, -np.pi, np.pi, np.pi / 180, 0.0, 0.1, 0.16, 8.0, ranges)


def obstacles(stamp_ns: int, distance: float = 2.0, floor: float = 1.9) -> ObstacleScan:
    """Return an obstacle scan with an obstacle at the same distance everywhere, and floor as far as `floor`."""
    ranges, begin, end = (np.full(BINS, value, np.float32) for value in (distance, 0.7, floor))
    return ObstacleScan(Header.of(stamp_ns, "camera_depth_frame"), FIRST, STEP, 8.0, ranges, begin, end)


def never() -> np.ndarray:
    raise AssertionError("the memory need not be searched")


def with_sensors(**sensors: object) -> Robot:
    return msgspec.structs.replace(ROBOT, sensors=msgspec.structs.replace(ROBOT.sensors, **sensors))


def looking(x: float, y: float, yaw: float) -> Robot:
    """Return a robot without a lidar whose camera is mounted there and looks there."""
    camera = ROBOT.sensors.depth_camera
    assert camera is not None
    mount = msgspec.structs.replace(camera.mount, x=x, y=y, yaw=yaw)
    assert isinstance(mount, Mount)
    return with_sensors(lidar=None, depth_camera=msgspec.structs.replace(camera, mount=mount))


def blind_camera(robot: Robot) -> ObstacleSensors:
    """Return sensors whose camera sees nothing at all."""
    sensors = ObstacleSensors(robot)
    sensors.process_obstacles(obstacles(PERIOD_NS, math.inf, 0.0), PERIOD_NS, STANDING)
    return sensors


def run(sensors: ObstacleSensors, count: int, begin_ns: int = 0) -> int:
    """Send good data of both sensors; the ranges change a little, as measured ones do. Return the last time."""
    now_ns = begin_ns
    for k in range(count):
        now_ns = begin_ns + (k + 1) * PERIOD_NS
        sensors.process_scan(scan(now_ns, 3.0 + 0.001 * k), now_ns, STANDING)
        sensors.note_scan_marked(now_ns)
        sensors.process_obstacles(obstacles(now_ns, 2.0 + 0.001 * k), now_ns, STANDING)
        sensors.note_obstacles_marked(now_ns)
    return now_ns


def test_invalid_ranges_have_no_data_and_infinite_ones_do() -> None:
    message = scan(7)
    message.ranges[:6] = (np.nan, 0.0, np.inf, -1.0, 8.0, 7.99)
    view = laser_view(message)
    assert view.mute[:6].tolist() == [True, True, False, True, False, False]
    assert view.met[:6].tolist() == view.measured[:6].tolist() == [False, False, False, False, False, True]
    assert view.stamp_ns == 7 and view.data.shape == (360, 1)


def test_near_is_nearer_than_half_of_the_range() -> None:
    assert laser_view(scan(0, 3.99)).near and not laser_view(scan(0, 4.0)).near
    assert not laser_view(scan(0, math.inf)).near


def test_a_short_lidar_measures_near_things() -> None:
    short = msgspec.structs.replace(scan(0, 0.5), range_max=0.8)
    assert not laser_view(short).mute.any() and laser_view(short).met.all()


def test_a_scan_whose_maximum_range_is_zero_has_no_data() -> None:
    """Else all its ranges would be beyond it, and the robot would drive as in an empty hall."""
    empty = msgspec.structs.replace(scan(0), range_min=0.0, range_max=0.0)
    assert laser_view(empty).mute.all() and not laser_view(empty).met.any()


def test_camera_directions_without_obstacle_or_floor_lack_data() -> None:
    message = obstacles(9)
    message.ranges[:2], message.clear_to[1:3] = np.inf, 0.0
    view = camera_view(message)
    assert view.met[:4].tolist() == [False, False, True, True]
    assert view.measured[:4].tolist() == [True, False, True, True]
    assert view.mute[:4].tolist() == [False, True, False, False]
    assert camera_view(obstacles(9, math.inf, 0.8)).measured.all(), "floor at the robot's feet"
    assert view.stamp_ns == 9 and view.data.shape == (BINS, 3) and view.near is False


def test_measurable_directions_are_those_of_the_camera() -> None:
    sensors = ObstacleSensors(ROBOT)
    assert sensors.measurable == slice(0, 0), "nothing was sent"
    message = obstacles(PERIOD_NS)
    message.ranges[:10], message.clear_to[:10] = np.inf, 0.0
    sensors.process_obstacles(message, PERIOD_NS, STANDING)
    assert sensors.measurable == slice(10, BINS)
    lidar_alone = ObstacleSensors(with_sensors(depth_camera=None))
    run(lidar_alone, 2)
    assert lidar_alone.measurable == slice(0, 0)


def test_a_silent_lidar_is_a_fault_until_it_has_sent_some_scans() -> None:
    sensors, now_ns = ObstacleSensors(ROBOT), 0
    assert "lidar" in sensors.fault(now_ns, STANDING, NOTHING)
    faults = []
    for _ in range(8):
        now_ns += PERIOD_NS
        sensors.process_scan(scan(now_ns), now_ns, STANDING)
        sensors.note_scan_marked(now_ns)
        faults.append(sensors.fault(now_ns, STANDING, NOTHING))
    assert faults[0] and "lidar" not in faults[-1]
    assert "lidar" in sensors.fault(now_ns + 3_000_000_000, STANDING, NOTHING)


@pytest.mark.parametrize("sensor", ["lidar", "depth_camera"])
def test_each_sensor_has_the_rate_of_the_robot_file(sensor: str) -> None:
    """At 2 Hz three periods are a second and a half; then the sensor is silent."""
    slow = with_sensors(**{sensor: msgspec.structs.replace(getattr(ROBOT.sensors, sensor), rate=2.0)})
    sensors = ObstacleSensors(slow)
    now_ns = run(sensors, 8)
    other = "depth camera" if sensor == "lidar" else "lidar"
    for late_ns, named in ((PERIOD_NS, ""), (4 * PERIOD_NS, f"The {other} has sent nothing")):
        assert sensors.fault(now_ns + late_ns, STANDING, NOTHING).startswith(named)
        assert bool(sensors.fault(now_ns + late_ns, STANDING, NOTHING)) == bool(named)
    alone = ObstacleSensors(msgspec.structs.replace(slow, sensors=msgspec.structs.replace(
        slow.sensors, **{("depth_camera" if sensor == "lidar" else "lidar"): None}
    )))  # fmt: skip
    now_ns = run(alone, 8)
    assert alone.fault(now_ns + 15 * PERIOD_NS, STANDING, NOTHING) == ""
    assert "for more than 1.5 s" in alone.fault(now_ns + 15 * PERIOD_NS + 1, STANDING, NOTHING)


def test_a_sensor_that_is_not_mounted_is_ignored() -> None:
    """The scan made of a camera's picture is not a lidar's, and a sensor that is not mounted marks nothing."""
    bare = ObstacleSensors(with_sensors(lidar=None, depth_camera=None))
    now_ns = run(bare, 3)
    assert not bare.any_counted and bare.fault(now_ns, STANDING, NOTHING) == ""
    assert bare.blind_ahead(NOTHING) == "" == bare.blind_ahead(MarkedCells(COSTS, STANDING))
    assert ObstacleSensors(ROBOT).any_counted


def test_data_that_cannot_be_placed_stop_the_robot() -> None:
    for note in ("note_scan_marked", "note_obstacles_marked"):
        sensors = ObstacleSensors(ROBOT)
        setattr(sensors, note, lambda _: None)
        assert "There is no transform from" in sensors.fault(run(sensors, 12), STANDING, NOTHING)


@pytest.mark.parametrize("sensor", ["lidar", "depth camera"])
def test_an_optional_sensor_counts_once_it_has_sent(sensor: str) -> None:
    sensors = ObstacleSensors(ROBOT, ("lidar", "depth camera"))
    assert not sensors.any_counted and sensors.fault(10**12, STANDING, NOTHING) == ""
    if sensor == "lidar":
        sensors.process_scan(scan(0), 0, STANDING)
    else:
        sensors.process_obstacles(obstacles(0), 0, STANDING)
    assert sensors.any_counted
    assert sensors.fault(10**12, STANDING, NOTHING) == f"The {sensor} has sent nothing for more than 0.3 s."


def test_a_camera_with_a_driver_has_to_be_connected() -> None:
    camera = ROBOT.sensors.depth_camera
    assert camera is not None
    driven = msgspec.structs.replace(camera, driver="replay")
    assert ObstacleSensors(with_sensors(lidar=None, depth_camera=driven), ("depth camera",)).any_counted


def test_a_blind_lidar_stops_the_robot() -> None:
    sensors = ObstacleSensors(ROBOT)
    now_ns = run(sensors, 8)
    covered = scan(now_ns + 1, 3.1)
    covered.ranges[90:180] = np.nan
    sensors.process_scan(covered, now_ns + 1, STANDING)
    assert sensors.fault(now_ns + 1, STANDING, NOTHING).startswith("The lidar is blind")


@pytest.mark.parametrize("count", [0, 3])
def test_a_lidar_that_sends_no_ranges_is_blind(count: int) -> None:
    """A scan without ranges is a legal message; a robot that trusts it drives blind."""
    sensors = ObstacleSensors(ROBOT)
    now_ns = run(sensors, count)
    for k in range(8):
        now_ns += PERIOD_NS
        empty = LaserScan(
            Header.of(now_ns, "laser"), 0.0, 0.0, 0.01 * k, 0.0, 0.1, 0.16, 8.0, np.empty(0, np.float32)
        )
        sensors.process_scan(empty, now_ns, STANDING)
        sensors.note_scan_marked(now_ns)
        sensors.process_obstacles(obstacles(now_ns), now_ns, STANDING)
        sensors.note_obstacles_marked(now_ns)
    assert sensors.fault(now_ns, STANDING, NOTHING).startswith("The lidar is blind")


def test_three_scattered_scans_in_a_row_are_a_damaged_lidar() -> None:
    sensors, rng = ObstacleSensors(ROBOT), np.random.default_rng(3)
    now_ns = run(sensors, 8)
    for good_after in (2, 2, 3):
        for _ in range(good_after):
            now_ns += PERIOD_NS
            wild = scan(now_ns)
            wild.ranges[:] = rng.uniform(1.0, 5.0, 360)
            sensors.process_scan(wild, now_ns, STANDING)
            sensors.note_scan_marked(now_ns)
            sensors.process_obstacles(obstacles(now_ns, rng.uniform(1.0, 2.0)), now_ns, STANDING)
            sensors.note_obstacles_marked(now_ns)
        assert sensors.fault(now_ns, STANDING, NOTHING) == (SCATTERED if good_after == 3 else "")
        if good_after == 2:
            now_ns = run(sensors, 1, now_ns)


# -- a blind lidar


def costs_of(lethal: np.ndarray) -> Costmap:
    """Return a costmap of 4 m with lethal cells at points (n, 2)."""
    cells = np.zeros((80, 80), np.uint8)
    for x, y in lethal.tolist():
        cells[int((y + 2.0) / 0.05), int((x + 2.0) / 0.05)] = LETHAL
    return Costmap(cells, 0.05, -2.0, -2.0)


def half_covered(stamp_ns: int) -> LaserScan:
    """Return a scan of a full turn that has no data on the left, from 0 to a quarter of a turn."""
    covered = scan(stamp_ns, 3.1)
    covered.ranges[(covered.angles > 0.0) & (covered.angles < np.pi / 2)] = -np.inf
    return covered


def lidar_at(x: float, y: float, yaw: float) -> Robot:
    lidar = ROBOT.sensors.lidar
    assert lidar is not None
    mount = msgspec.structs.replace(lidar.mount, x=x, y=y, yaw=yaw)
    return with_sensors(depth_camera=None, lidar=msgspec.structs.replace(lidar, mount=mount))


def arc(sensor: SE2, distance: float, first: float = 0.0, last: float = math.pi / 2) -> np.ndarray:
    """Return points around a sensor at a pose in base_link."""
    bearings = sensor.yaw + np.linspace(first, last, 400)
    return np.column_stack([sensor.x + distance * np.cos(bearings), sensor.y + distance * np.sin(bearings)])


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.0, 0.0, 0.0), (0.1, -0.05, 2.0), (-0.1, 0.08, -3.0)])
def test_a_wall_nearer_than_the_lidar_measures_is_no_fault(x: float, y: float, yaw: float) -> None:
    """As long as it is known, be it as remembered points or as marked cells, where the lidar has no data."""
    sensors, sensor = ObstacleSensors(lidar_at(x, y, yaw)), SE2(x, y, yaw)
    now_ns = run(sensors, 8) + 1
    sensors.process_scan(half_covered(now_ns), now_ns, STANDING)
    assert sensors.fault(now_ns, STANDING, NOTHING) == BLIND_LIDAR
    assert sensors.fault(now_ns, STANDING, points(arc(sensor, 0.15))) == ""
    assert sensors.fault(now_ns, STANDING, points(arc(sensor, 0.15, -math.pi / 2, 0.0))) == BLIND_LIDAR
    assert sensors.fault(now_ns, STANDING, points(arc(sensor, 0.15, 0.0, 0.6))) == BLIND_LIDAR, "most is not"
    pose = SE2(0.4, -0.3, 2.0)
    wall = np.vstack([arc(pose @ sensor, distance) for distance in (0.1, 0.125, 0.15)])
    assert sensors.fault(now_ns, STANDING, MarkedCells(costs_of(wall), pose)) == ""
    assert sensors.fault(now_ns, STANDING, MarkedCells(costs_of(wall), STANDING)) == BLIND_LIDAR
    unplaced = MarkedCells(costs_of(wall), None)
    assert sensors.fault(now_ns, None, unplaced) == BLIND_LIDAR
    assert unplaced.explain(np.zeros(3), sensor, 1.0).tolist() == [False] * 3
    assert sensors.health(now_ns, STANDING, NOTHING).message == BLIND_LIDAR


@pytest.mark.parametrize(("gap", "explained"), [(-0.002, True), (0.002, False)])
def test_a_wall_that_the_lidar_would_measure_explains_nothing(gap: float, explained: bool) -> None:
    """Beyond its minimum range, four deviations of its noise and a margin of 5 cm."""
    robot = lidar_at(0.0, 0.0, 0.0)
    lidar = robot.sensors.lidar
    assert lidar is not None
    wall = arc(STANDING, lidar.range_min + 4.0 * lidar.noise + 0.05 + gap)
    sensors = ObstacleSensors(robot)
    now_ns = run(sensors, 8) + 1
    sensors.process_scan(half_covered(now_ns), now_ns, STANDING)
    assert (sensors.fault(now_ns, STANDING, points(wall)) == "") == explained


def test_a_lidar_that_sees_nothing_at_all_is_blind_beside_a_wall() -> None:
    """As a cover over all of it, or one of which all returns vanish at once."""
    sensors = ObstacleSensors(lidar_at(0.0, 0.0, 0.0))
    now_ns = run(sensors, 8) + 1
    for ranges in (-np.inf, np.inf):
        sensors.process_scan(scan(now_ns, ranges), now_ns, STANDING)
        assert sensors.fault(now_ns, STANDING, points(arc(STANDING, 0.15))) == BLIND_LIDAR


def test_a_lidar_that_sees_needs_no_known_obstacles() -> None:
    sensors = ObstacleSensors(lidar_at(0.0, 0.0, 0.0))
    assert sensors.fault(0, STANDING, RememberedPoints(never, CELL)) != ""
    assert sensors.fault(run(sensors, 8), STANDING, RememberedPoints(never, CELL)) == ""


# -- a blind camera


@pytest.mark.parametrize(
    ("x", "y", "yaw"), [(0.1, 0.0, 0.0), (-0.1, 0.0, math.pi), (0.0, 0.1, 2.0), (0.05, -0.1, -3.0)]
)
def test_a_known_wall_explains_a_blind_camera_wherever_it_looks(x: float, y: float, yaw: float) -> None:
    """A wall nearer than the camera measures, known from the memory; elsewhere it explains nothing."""
    sensors = blind_camera(looking(x, y, yaw))
    bearings = yaw + FIRST + STEP * np.arange(BINS)
    wall = np.column_stack([x + 0.5 * np.cos(bearings), y + 0.5 * np.sin(bearings)])
    assert sensors.blind_ahead(NOTHING) == BLIND
    assert sensors.blind_ahead(points(wall)) == ""
    assert sensors.blind_ahead(points(np.array([[2.0 * x, 2.0 * y]]) - wall)) == BLIND, (
        "the wall is behind it"
    )
    far = np.array([x, y]) + 2.0 * (wall - np.array([x, y]))
    assert sensors.blind_ahead(points(far)) == BLIND, "at a metre the camera would measure it"
    assert sensors.blind_ahead(points(wall[: BINS // 4])) == BLIND, "of one quarter only"


@pytest.mark.parametrize("distance", [0.25, 0.4, 0.55])
def test_a_point_in_each_cell_explains_a_wall(distance: float) -> None:
    """Wherever in its cell the point is; a point in every fourth cell leaves half of the wall unexplained."""
    sensors, rng = blind_camera(looking(0.0, 0.0, 0.0)), np.random.default_rng(3)
    cells = np.arange(-0.4, 0.4, CELL)
    for _ in range(20):
        wall = np.column_stack([np.full(len(cells), distance), cells + rng.uniform(0.0, CELL, len(cells))])
        assert sensors.blind_ahead(points(wall)) == ""
    assert sensors.blind_ahead(points(wall[::4])) == BLIND


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("count", "at", "explained"), [
    (4, 0.0, True), (4, 3.0, True), (4, -0.4, True),
    (5, 0.0, False), (5, 0.4, False), (5, 0.6, True), (7, 6.0, False),
])  # fmt: skip
def test_a_few_directions_are_explained_each(sign: float, count: int, at: float, explained: bool) -> None:
    """By one point in the direction `at`, counted from the first one, of a scan in either sense."""
    first, step = sign * 3.0, sign * 0.1  # it looks backwards, across the bearing where angles jump
    silent = np.full(count, np.inf, np.float32)
    sensors = ObstacleSensors(looking(0.0, 0.0, 0.0))
    sensors.process_obstacles(
        ObstacleScan(Header.of(0, "camera"), first, step, 8.0, silent, silent, np.zeros(count, np.float32)),
        0,
        STANDING,
    )
    bearing = first + at * step
    point = 0.4 * np.array([[math.cos(bearing), math.sin(bearing)]])
    assert (sensors.blind_ahead(points(point, 0.4 * math.tan(0.35))) == "") == explained


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_person_who_comes_in_from_the_side_stops_the_robot(sign: float) -> None:
    """Nearer than the camera measures, in a tenth of its view; a wall that is known there explains it."""
    sensors = ObstacleSensors(looking(0.0, 0.0, 0.0))
    for k, hidden in enumerate((0, 16)):
        seen = obstacles((k + 1) * PERIOD_NS)
        at = slice(0, hidden) if sign < 0.0 else slice(BINS - hidden, BINS)
        seen.ranges[at], seen.clear_to[at] = np.inf, 0.0
        sensors.process_obstacles(seen, (k + 1) * PERIOD_NS, STANDING)
    assert sensors.blind_ahead(NOTHING) == HIDDEN == sensors.blind_ahead(MarkedCells(COSTS, STANDING))
    bearings = sign * (FIRST + STEP * np.arange(16))
    wall = 0.4 * np.column_stack([np.cos(bearings), -np.sin(bearings)])
    assert sensors.blind_ahead(points(wall)) == ""
    assert sensors.blind_ahead(points(wall * (1.0, -1.0))) == HIDDEN, "it is on the other side"


@pytest.mark.parametrize(("gap", "explained"), [(-0.005, True), (0.005, False)])
def test_nearer_than_the_camera_measures_at_the_edge_of_its_view(gap: float, explained: bool) -> None:
    """A tenth of a metre beyond its minimum range along the optical axis, at half of the field of view."""
    camera = ROBOT.sensors.depth_camera
    assert camera is not None
    limit = (camera.range_min + 0.1) / math.cos(camera.field_of_view / 2)
    bearings = FIRST + STEP * np.arange(BINS)
    wall = (limit + gap) * np.column_stack([np.cos(bearings), np.sin(bearings)])
    assert (blind_camera(looking(0.0, 0.0, 0.0)).blind_ahead(points(wall)) == "") == explained


def test_a_camera_that_sees_needs_no_other_sensor() -> None:
    sensors = ObstacleSensors(ROBOT)
    assert sensors.blind_ahead(NOTHING) == "" == sensors.blind_ahead(MarkedCells(COSTS, None))
    run(sensors, 1)
    assert (
        sensors.blind_ahead(RememberedPoints(never, CELL))
        == ""
        == sensors.blind_ahead(MarkedCells(COSTS, None))
    )


@pytest.mark.parametrize("count", [0, 1])
def test_an_obstacle_scan_of_nothing_is_blind(count: int) -> None:
    """Without directions, or with a single one, as a broken driver may send them."""
    sensors, array = ObstacleSensors(looking(0.0, 0.0, 0.0)), np.full(count, np.inf, np.float32)
    none = ObstacleScan(Header.of(0, "camera"), 0.0, 0.0, 8.0, array, array, np.zeros(count, np.float32))
    sensors.process_obstacles(none, 0, STANDING)
    assert sensors.blind_ahead(points(np.array([[0.3, 0.0]]))) == (BLIND if count == 0 else "")
    assert sensors.blind_ahead(points(np.array([[0.3, 3.0], [-0.3, 0.0]]))) == BLIND
    assert sensors.blind_ahead(NOTHING) == BLIND


def room(robot_x: float, robot_y: float, yaw: float, distance: float) -> Costmap:
    """Return a costmap of 4 m in which an arc around a pose, half a radian to each side, is lethal."""
    return costs_of(arc(SE2(robot_x, robot_y, yaw), distance, -0.6, 0.6))


def test_a_marked_wall_explains_a_blind_camera() -> None:
    """The costmap is in odom: the wall has to be where the camera looks from where the robot is."""
    pose = SE2(0.4, -0.3, 2.0)
    for camera_yaw in (0.0, math.pi):
        sensors = blind_camera(looking(0.1, 0.0, camera_yaw))
        eye = pose @ SE2(0.1, 0.0, camera_yaw)
        for near in (0.4, 0.425, 0.45, 0.475):
            assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, near), pose)) == "", (
                "a cell thick"
            )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, 1.2), pose)) == BLIND, (
            "it would be measured"
        )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw + math.pi, 0.4), pose)) == BLIND, (
            "it is behind"
        )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, 0.4), None)) == BLIND, (
            "nobody knows where it is"
        )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, 0.4), SE2(0.0, 1.0, 0.0))) == BLIND


def test_the_health_agrees_with_the_fault() -> None:
    sensors = ObstacleSensors(ROBOT)
    silent = sensors.health(0, STANDING, NOTHING)
    assert silent.level == ERROR and silent.message == sensors.fault(0, STANDING, NOTHING) != ""
    now_ns = run(sensors, 8)
    healthy = sensors.health(now_ns, STANDING, NOTHING)
    assert (healthy.level, healthy.name, healthy.message) == (OK, "obstacle sensors", OK_MESSAGE)
    assert healthy.hardware_id == ROBOT.name
    sensors.process_obstacles(obstacles(now_ns + 1, math.inf, 0.0), now_ns + 1, STANDING)
    blind = sensors.health(now_ns + 1, STANDING, NOTHING)
    assert (blind.level, blind.message) == (ERROR, BLIND)
