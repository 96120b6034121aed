"""Monitoring of the obstacle sensors: which one has a fault, and which motions are still allowed."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticStatus
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.robot.sensors import DepthCamera
from chefbot.robot.spec import Robot
from chefbot.safety.sensor_freshness import ObstacleSensorMonitor, SensorView

OK_MESSAGE = "The obstacle sensors send good data."
BLIND = "The depth camera is blind: a quarter of its picture or more shows nothing; the robot does not drive forward."
HIDDEN = (
    "Something beside the robot is too near for the depth camera to see; the robot does not drive forward."
)
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


def camera_directions(scan: ObstacleScan, sensor: SE2) -> NDArray[np.float64]:
    """Return the directions (n,) of an obstacle scan in the frame of the sensor's pose, rad."""
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges), dtype=np.float64)
    return np.asarray(sensor.yaw + angles)


def marked_directions(
    directions: NDArray[np.float64], sensor: SE2, camera: DepthCamera, costs: Costmap
) -> NDArray[np.bool_]:
    """Return in which directions (n,) an obstacle is marked that may be too near for the camera to be seen.

    sensor: pose of the camera. It and the directions are in the frame of the costmap.
    """
    distances = np.arange(0.0, max_blind_distance(camera), costs.resolution / 2)
    x = sensor.x + np.cos(directions)[:, None] * distances
    y = sensor.y + np.sin(directions)[:, None] * distances
    return np.asarray((costs.values(x, y, outside=0) == LETHAL).any(axis=1))


def explained(
    directions: NDArray[np.float64], points: NDArray[np.float64], reach: float, resolution: float
) -> NDArray[np.bool_]:
    """Return in which directions (n,) points (m, 2), seen from the camera, explain that it is too near to see.

    A point stands for a surface up to a cell to each side: the points of neighbouring cells lie up to two apart.
    """
    distances = np.hypot(points[:, 0], points[:, 1])
    near = distances <= reach
    width = np.arctan2(resolution, distances[near])
    apart = directions[:, None] - np.arctan2(points[near, 1], points[near, 0])
    apart = np.abs(np.remainder(apart + math.pi, 2.0 * math.pi) - math.pi)
    return np.asarray((apart <= width).any(axis=1))


def max_blind_distance(camera: DepthCamera) -> float:
    """Return the distance within which a known obstacle may be too near to be seen, m.

    Ranges are measured along the optical axis, so the minimum range is longest at the edge of the view.
    """
    return (camera.range_min + BLIND_RANGE_MARGIN) / math.cos(camera.field_of_view / 2)


def _unseen(camera: ObstacleSensorMonitor, known: NDArray[np.bool_] | None) -> str:
    """Return why the robot must not drive forward if these directions are explained by known obstacles."""
    if camera.blind(known):
        return BLIND
    return HIDDEN if camera.hidden_at_edge(known) else ""


class ObstacleSensors:
    """Monitors the lidar and the depth camera, as far as the robot file has them.

    optional: names of sensors that need not be connected; they count from their first message on. A depth camera with
    a driver of its own must be connected.
    """

    def __init__(self, robot: Robot, optional: Collection[str] = ()) -> None:
        self._robot_name = robot.name
        lidar, camera = robot.sensors.lidar, robot.sensors.depth_camera
        self._lidar = ObstacleSensorMonitor("lidar", 1.0 / lidar.rate) if lidar is not None else None
        self._camera = (
            ObstacleSensorMonitor("depth camera", 1.0 / camera.rate) if camera is not None else None
        )
        self._lidar_noise = lidar.noise if lidar is not None else math.inf
        self._scattered = 0
        driven = {"depth camera"} if camera is not None and camera.driver else set()
        self._optional = frozenset(optional) - driven
        self._camera_spec = camera
        self._last_obstacles: ObstacleScan | None = None

    def process_scan(self, scan: LaserScan, now_ns: int, pose: SE2 | None) -> None:
        """Process a laser scan; ignored without a lidar, as the depth camera is monitored by its obstacle scans."""
        if self._lidar is not None:
            self._lidar.process_view(laser_view(scan), now_ns, pose)
            self._scattered = self._scattered + 1 if scatters(scan.ranges, self._lidar_noise) else 0

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

    def fault(self, now_ns: int, pose: SE2 | None) -> str:
        """Return why the robot must stand still, a sentence that names the sensor, or an empty string."""
        faults = [monitor.fault(now_ns, pose) for monitor in self._counted()]
        if self._lidar is not None and self._lidar.blind():
            faults.append("The lidar is blind: a quarter of its view or more shows nothing.")
        faults.append(SCATTERED if self._scattered >= SCATTERED_SCANS else "")
        return next((fault for fault in faults if fault), "")

    @property
    def any_counted(self) -> bool:
        """Whether any sensor is connected, or has to be."""
        return bool(self._counted())

    def _counted(self) -> list[ObstacleSensorMonitor]:
        monitors = [monitor for monitor in (self._lidar, self._camera) if monitor is not None]
        return [one for one in monitors if one.has_sent or one.title not in self._optional]

    def blind_beyond(self, known_points: Callable[[], NDArray[np.float64]], resolution: float) -> str:
        """Return why the robot must not drive forward, as `blind_ahead`.

        known_points: returns known obstacles (n, 2) in base_link, one in each cell of `resolution`, m.
        """
        camera, scan, spec = self._camera, self._last_obstacles, self._camera_spec
        if camera is None or not (camera.blind() or camera.hidden_at_edge()):
            return ""
        assert scan is not None and spec is not None
        points = known_points() - (spec.mount.x, spec.mount.y)
        directions = camera_directions(scan, spec.mount.planar)
        return _unseen(camera, explained(directions, points, max_blind_distance(spec), resolution))

    def blind_ahead(self, pose: SE2 | None, costs: Costmap) -> str:
        """Return why the robot must not drive forward, or an empty string; it may still rotate.

        A depth camera has no data nearer than its minimum range, as in front of a wall; directions in which the
        costmap (in odom, as the pose) has that wall marked do not count as blind.
        """
        camera = self._camera
        if camera is None or not (camera.blind() or camera.hidden_at_edge()):
            return ""
        if pose is None:
            return _unseen(camera, None)
        spec, scan = self._camera_spec, self._last_obstacles
        assert spec is not None and scan is not None
        directions = camera_directions(scan, pose @ spec.mount.planar)
        return _unseen(camera, marked_directions(directions, pose @ spec.mount.planar, spec, costs))

    @property
    def measurable(self) -> slice:
        """The directions of the newest obstacle scan that the camera measures at all."""
        return slice(0, 0) if self._camera is None else self._camera.measurable

    def health(self, now_ns: int, pose: SE2 | None, costs: Costmap) -> DiagnosticStatus:
        """Return the health for /diagnostics, also while the robot is idle."""
        fault = self.fault(now_ns, pose) or self.blind_ahead(pose, costs)
        return DiagnosticStatus(
            ERROR if fault else OK, "obstacle sensors", fault or OK_MESSAGE, self._robot_name
        )
