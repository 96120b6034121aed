"""Monitoring of the obstacle sensors: which one has a fault, and which motions are still allowed."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticStatus
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.robot.sensors import DepthCamera
from chefbot.robot.spec import Robot
from chefbot.safety.known_obstacles import KnownObstacles
from chefbot.safety.sensor_freshness import ObstacleSensorMonitor, SensorView

OK_MESSAGE = "The obstacle sensors send good data."
BLIND = "The depth camera is blind: a quarter of its picture or more shows nothing; the robot does not drive forward."
HIDDEN = (
    "Something beside the robot is too near for the depth camera to see; the robot does not drive forward."
)
BLIND_LIDAR = "The lidar is blind: a quarter of its view or more shows nothing."
NEAR_DEVIATIONS = 4.0
"""Standard deviations of a lidar's noise above its minimum range within which its returns may all be too long."""
NEAR_MARGIN = 0.05
"""Margin beyond the lidar's minimum range, of the odometry since the obstacle was measured and of a cell, m."""
NEAR_FRACTION = 0.5
"""Fraction of the range within which surfaces do not vanish from one message to the next."""
BLIND_RANGE_MARGIN = 0.1
"""Margin beyond the camera's minimum range in which a marked obstacle may be too near to be seen, m."""

SCATTERED = "The lidar's ranges scatter far more than its noise: it is damaged, or something covers it."
SCATTER_FACTOR, SCATTER_SHARE = 5.0, 0.02
"""Factor on the robot file's noise, and share of the range, beyond which neighbouring ranges scatter too much."""
QUARTILE_RATIO = 0.472
"""Lower quartile of the absolute value of a normal variable by its median, 0.319 / 0.674."""
SCATTERED_SCANS, MIN_SCATTER_BEAMS = 3, 30
"""Scans in a row that scatter before the lidar counts as damaged, and the ranges that a scan needs for that."""


def laser_view(scan: LaserScan) -> SensorView:
    """Convert a laser scan: NaN, zero and negative ranges are invalid, +inf means no return (REP-117).

    A scan whose maximum range is zero has no valid ranges.
    """
    ranges = scan.ranges
    valid = (ranges > 0.0) & (scan.range_max > 0.0)
    hits = valid & (ranges < scan.range_max)
    near = bool((ranges[hits] < NEAR_FRACTION * scan.range_max).any())
    return SensorView(scan.header.stamp.ns, ranges[:, None], hits, hits, ~valid, near, scan.header.frame_id)


def scatters(ranges: NDArray[np.float32], noise: float) -> bool:
    """Return whether neighbouring ranges (n,) differ far more than by surfaces and the noise (standard deviation, m).

    Along a smooth surface the second difference of ranges is that of the noise, with the deviation sqrt(6) times as
    large. Between the legs of chairs and people most differences are edges, so the lower quartile counts, which
    is QUARTILE_RATIO of the median for normal noise.
    """
    measured = np.where(ranges > 0.0, ranges, np.nan)
    with np.errstate(invalid="ignore", over="ignore"):
        differences = np.abs(measured[:-2] - 2.0 * measured[1:-1] + measured[2:])
    valid = np.isfinite(differences)
    found = np.sort(differences[valid])  # np.quantile and np.median take ten times as long
    if len(found) < MIN_SCATTER_BEAMS:
        return False
    middle = float(np.sort(measured[1:-1][valid])[len(found) // 2])
    limit = SCATTER_FACTOR * math.sqrt(6.0) * noise + SCATTER_SHARE * middle
    return float(found[(len(found) - 1) // 4]) > QUARTILE_RATIO * limit


def camera_view(scan: ObstacleScan) -> SensorView:
    """Convert an obstacle scan: a direction with neither an obstacle nor floor has no data."""
    hits = np.isfinite(scan.ranges)
    measured = hits | (scan.clear_to > 0.0)
    data = np.column_stack([scan.ranges, scan.clear_from, scan.clear_to])
    return SensorView(scan.header.stamp.ns, data, hits, measured, ~measured, False, scan.header.frame_id)


def max_blind_distance(camera: DepthCamera) -> float:
    """Return the distance within which a known obstacle may be too near to be seen, m.

    Ranges are measured along the optical axis, so the minimum range is longest at the edge of the view.
    """
    return (camera.range_min + BLIND_RANGE_MARGIN) / math.cos(camera.field_of_view / 2)


class ObstacleSensors:
    """Monitors the lidar and the depth camera, as far as the robot file has them.

    optional: names of sensors that need not be connected; they count from their first message on. A depth camera with
    a driver of its own must be connected.
    """

    def __init__(self, robot: Robot, optional: Collection[str] = ()) -> None:
        self._robot = robot
        lidar, camera = robot.sensors.lidar, robot.sensors.depth_camera
        self._lidar = ObstacleSensorMonitor("lidar", 1.0 / lidar.rate) if lidar is not None else None
        self._camera = (
            ObstacleSensorMonitor("depth camera", 1.0 / camera.rate) if camera is not None else None
        )
        self._scattered = 0
        driven = {"depth camera"} if camera is not None and camera.driver else set()
        self._optional = frozenset(optional) - driven
        self._last_scan: LaserScan | None = None
        self._last_obstacles: ObstacleScan | None = None

    def process_scan(self, scan: LaserScan, now_ns: int, pose: SE2 | None) -> None:
        """Process a laser scan; ignored without a lidar, as the depth camera is monitored by its obstacle scans."""
        lidar = self._robot.sensors.lidar
        if self._lidar is not None and lidar is not None:
            self._last_scan = scan
            self._lidar.process_view(laser_view(scan), now_ns, pose)
            self._scattered = self._scattered + 1 if scatters(scan.ranges, lidar.noise) else 0

    def note_scan_marked(self, stamp_ns: int) -> None:
        """Note that the scan of this time was marked in the costmap."""
        if self._lidar is not None:
            self._lidar.note_marked(stamp_ns)

    def process_obstacles(self, scan: ObstacleScan, now_ns: int, pose: SE2 | None) -> None:
        """Process an obstacle scan of the depth camera."""
        if self._camera is not None:
            self._last_obstacles = scan
            self._camera.process_view(camera_view(scan), now_ns, pose)

    def note_obstacles_marked(self, stamp_ns: int) -> None:
        """Note that the obstacle scan of this time was marked in the costmap."""
        if self._camera is not None:
            self._camera.note_marked(stamp_ns)

    def fault(self, now_ns: int, pose: SE2 | None, known: KnownObstacles) -> str:
        """Return why the robot must stand still, a sentence that names the sensor, or an empty string."""
        faults = [monitor.fault(now_ns, pose) for monitor in self._counted()]
        faults.append(BLIND_LIDAR if self._lidar_is_blind(known) else "")
        faults.append(SCATTERED if self._scattered >= SCATTERED_SCANS else "")
        return next((fault for fault in faults if fault), "")

    def _lidar_is_blind(self, known: KnownObstacles) -> bool:
        """Return whether the lidar lacks data that no known obstacle explains, as a wall beside the body does."""
        lidar, scan, spec = self._lidar, self._last_scan, self._robot.sensors.lidar
        if lidar is None or scan is None or not lidar.blind():
            return False
        assert spec is not None
        reach = spec.range_min + NEAR_DEVIATIONS * spec.noise + NEAR_MARGIN
        return lidar.blind(known.explain(scan.angles.astype(np.float64), spec.mount.planar, reach))

    @property
    def any_counted(self) -> bool:
        """Whether any sensor is connected, or has to be."""
        return bool(self._counted())

    def _counted(self) -> list[ObstacleSensorMonitor]:
        monitors = [monitor for monitor in (self._lidar, self._camera) if monitor is not None]
        return [one for one in monitors if one.has_sent or one.title not in self._optional]

    def blind_ahead(self, known: KnownObstacles) -> str:
        """Return why the robot must not drive forward, or an empty string; it may still rotate.

        A depth camera has no data nearer than its minimum range, as in front of a wall; directions in which that wall
        is known do not count as blind.
        """
        camera, scan, spec = self._camera, self._last_obstacles, self._robot.sensors.depth_camera
        if camera is None or not (camera.blind() or camera.hidden_at_edge()):
            return ""
        assert scan is not None and spec is not None
        explained = known.explain(scan.angles, spec.mount.planar, max_blind_distance(spec))
        if camera.blind(explained):
            return BLIND
        return HIDDEN if camera.hidden_at_edge(explained) else ""

    @property
    def measurable(self) -> slice:
        """The directions of the newest obstacle scan that the camera measures at all."""
        return slice(0, 0) if self._camera is None else self._camera.measurable

    def health(self, now_ns: int, pose: SE2 | None, known: KnownObstacles) -> DiagnosticStatus:
        """Return the health for /diagnostics, also while the robot is idle."""
        fault = self.fault(now_ns, pose, known) or self.blind_ahead(known)
        return DiagnosticStatus(
            ERROR if fault else OK, "obstacle sensors", fault or OK_MESSAGE, self._robot.name
        )
