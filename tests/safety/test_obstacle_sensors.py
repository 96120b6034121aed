"""The obstacle sensors of a robot file: which fault is named, and that a recovered sensor is trusted again."""

from __future__ import annotations

import numpy as np

from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.diagnostic_msgs import ERROR, OK
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.safety.obstacle_sensors import ObstacleSensors, laser_view

ROBOT = load_robot("chefbot_lidar")
STANDING = SE2(0.0, 0.0, 0.0)
COSTS = Costmap(np.zeros((20, 20), np.uint8), 0.05, -0.5, -0.5)
PERIOD_NS = 100_000_000


def scan(stamp_ns: int, distance: float = 3.0) -> LaserScan:
    ranges = np.full(360, distance, np.float32)
    header = Header.of(stamp_ns, "laser")
    return LaserScan(header, -np.pi, np.pi, np.pi / 180, 0.0, 0.1, 0.16, 8.0, ranges)


def test_invalid_ranges_have_no_data_and_infinite_ones_do() -> None:
    message = scan(0)
    message.ranges[:3] = (np.nan, 0.0, np.inf)
    view = laser_view(message)
    assert view.mute[:3].tolist() == [True, True, False] and view.met[:4].tolist() == [
        False,
        False,
        False,
        True,
    ]


def test_a_silent_lidar_is_a_fault_until_it_has_sent_some_scans() -> None:
    sensors, now_ns = ObstacleSensors(ROBOT), 0
    assert "lidar" in sensors.fault(now_ns, STANDING)
    faults = []
    for _ in range(8):
        now_ns += PERIOD_NS
        sensors.process_scan(scan(now_ns), now_ns, STANDING)
        sensors.note_scan_marked(now_ns)
        faults.append(sensors.fault(now_ns, STANDING))
    assert faults[0] and "lidar" not in faults[-1]
    assert "lidar" in sensors.fault(now_ns + 3_000_000_000, STANDING)


def test_the_health_agrees_with_the_fault() -> None:
    sensors = ObstacleSensors(ROBOT)
    fault = sensors.fault(0, STANDING)
    health = sensors.health(0, STANDING, COSTS)
    assert (health.level == ERROR) == bool(fault) and health.level in (OK, ERROR)
    assert health.message == fault and health.hardware_id == ROBOT.name
