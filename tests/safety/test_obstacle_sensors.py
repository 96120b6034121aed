"""The obstacle sensors of a robot file: which fault is named, and that a recovered sensor is trusted again."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from tests.support.obstacle_sensors import (
    BINS,
    COSTS,
    NOTHING,
    PERIOD_NS,
    ROBOT,
    STANDING,
    obstacles,
    run,
    scan,
    with_sensors,
)

from chefbot.msgs.diagnostic_msgs import ERROR, OK
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.safety.known_obstacles import MarkedCells
from chefbot.safety.obstacle_sensors import (
    BLIND,
    OK_MESSAGE,
    SCATTERED,
    ObstacleSensors,
    camera_view,
    laser_view,
)


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
