"""The robot's obstacle sensors under watch: which one is at fault, and what may still be driven then."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticStatus
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.robot.spec import Robot
from chefbot.safety.sensor_freshness import SensorWatch, View

WELL = "The obstacle sensors send good data."
BLIND = "The depth camera is blind: a quarter of its picture or more shows nothing; I do not drive forward."
NEAR = 0.5
"""Share of the range within which surfaces do not vanish from one message to the next."""
BEYOND = 0.1
"""Metres beyond the camera's least range within which a marked obstacle may be what it no longer sees."""


def laser_view(scan: LaserScan) -> View:
    """NaN, 0, negative and -inf say nothing; +inf says that nothing is in reach (REP-117)."""
    ranges = scan.ranges
    met = (ranges > 0.0) & (ranges < scan.range_max)
    near = bool((ranges[met] < NEAR * scan.range_max).any())
    return View(scan.header.stamp.ns, ranges[:, None], met, met, ~(ranges > 0.0), near)


def camera_view(seen: ObstacleScan) -> View:
    """A direction in which neither an obstacle nor the floor was seen says nothing."""
    met = np.isfinite(seen.ranges)
    measured = met | (seen.clear_to > 0.0)
    data = np.column_stack([seen.ranges, seen.clear_from, seen.clear_to])
    return View(seen.header.stamp.ns, data, met, measured, ~measured, False)


class ObstacleSensors:
    """One watch for the lidar and one for the depth camera, as far as the robot file names them."""

    def __init__(self, robot: Robot) -> None:
        self._robot_name = robot.name
        lidar, camera = robot.sensors.lidar, robot.sensors.depth_camera
        self._lidar = SensorWatch("lidar", 1.0 / lidar.rate) if lidar is not None else None
        self._camera = SensorWatch("depth camera", 1.0 / camera.rate) if camera is not None else None
        self._mounted = camera
        self._seen: ObstacleScan | None = None

    def see_scan(self, scan: LaserScan, now_ns: int, pose: SE2 | None) -> None:
        """A laser scan; of a robot without a lidar it is the depth camera's, which is watched by its obstacles."""
        if self._lidar is not None:
            self._lidar.see(laser_view(scan), now_ns, pose)

    def place_scan(self, stamp_ns: int) -> None:
        """The costmap has it."""
        if self._lidar is not None:
            self._lidar.place(stamp_ns)

    def see_obstacles(self, seen: ObstacleScan, now_ns: int, pose: SE2 | None) -> None:
        """What the depth camera sees."""
        self._seen = seen
        if self._camera is not None:
            self._camera.see(camera_view(seen), now_ns, pose)

    def place_obstacles(self, stamp_ns: int) -> None:
        """The costmap has it."""
        if self._camera is not None:
            self._camera.place(stamp_ns)

    def fault(self, now_ns: int, pose: SE2 | None) -> str:
        """Why the robot must stand, a sentence that names the sensor; empty while all data are good."""
        watches = (watch for watch in (self._lidar, self._camera) if watch is not None)
        faults = [watch.fault(now_ns, pose) for watch in watches]
        if self._lidar is not None and self._lidar.blind():
            faults.append("The lidar is blind: a quarter of its view or more shows nothing.")
        return next((fault for fault in faults if fault), "")

    def blind_ahead(self, pose: SE2 | None, costs: Costmap) -> str:
        """Why the robot must not drive forward, a sentence; it may turn to where it sees.

        A depth camera shows nothing of what is nearer than its least range, as before a wall; where the costmap
        (in odom, as the pose) has that wall marked, it is known.
        """
        camera = self._camera
        if camera is None or not camera.blind():
            return ""
        return BLIND if camera.blind(self._marked(pose, costs)) else ""

    def _marked(self, pose: SE2 | None, costs: Costmap) -> NDArray[np.bool_] | None:
        """Directions of the camera in which an obstacle is marked that may be too near to be seen."""
        camera, seen = self._mounted, self._seen
        if pose is None or camera is None or seen is None:
            return None
        at = pose @ camera.mount.planar
        yaws = at.yaw + seen.angle_min + seen.angle_increment * np.arange(len(seen.ranges))
        # its ranges count along its axis
        reach = (camera.range_min + BEYOND) / math.cos(camera.field_of_view / 2)
        away = np.arange(0.0, reach, costs.resolution / 2)
        x = at.x + np.cos(yaws)[:, None] * away
        y = at.y + np.sin(yaws)[:, None] * away
        return np.asarray((costs.values(x, y, outside=0) == LETHAL).any(axis=1))

    def health(self, now_ns: int, pose: SE2 | None, costs: Costmap) -> DiagnosticStatus:
        """For /diagnostics, whether or not the robot has anything to do."""
        fault = self.fault(now_ns, pose) or self.blind_ahead(pose, costs)
        return DiagnosticStatus(ERROR if fault else OK, "obstacle sensors", fault or WELL, self._robot_name)
