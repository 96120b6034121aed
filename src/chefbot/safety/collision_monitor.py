"""The collision monitor: the largest fraction of a twist from which the robot stops before everything it knows of.

It follows the twist's own arc, whatever its source, over latency and braking distance (compare
nav2_collision_monitor's `approach`), with the newest points of each obstacle sensor and those that it remembers of a
moment ago. It has no clock, no node and no costmap.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.robot.scan_plane import plane_of, through_plane
from chefbot.robot.spec import Robot
from chefbot.safety import local_memory as memory
from chefbot.safety.contact_time import first_contact
from chefbot.safety.monitor_polygons import CREEP_SPEED, OUTLINE_INSET, MonitorPolygons, safe_fraction
from chefbot.safety.monitor_text import MIN_DRIVING_SPEED, SensedPoint, obstacle_text, unseen_text
from chefbot.safety.obstacle_sensors import NEAR_DEVIATIONS, max_blind_distance
from chefbot.safety.params import CollisionMonitorParams

ECHO_TIMEOUT_NS = 300_000_000
"""Maximum age of an echo of the ultrasonic ranger, ns."""
CONE_POINTS = 5
"""Points across the cone of the ultrasonic ranger: the direction of the surface is not measured."""
TOLERATED_GAP = 2
"""Neighbouring points of the body's outline, a cell apart each, that may be over unseen ground, as between two rays.
Ahead, over ground not seen recently, it is half the body's width: on an arc a camera does not look over the ground
before the inner side."""
ANY_TIME_NS = 0
"""The oldest time of which ground counts as seen at any time, ns."""
SEEN_FLOOR, BELOW_THE_VIEW = np.array([True, True]), np.array([False, True])
"""How rays show the ground, see `local_memory`."""
NO_LAYER = np.zeros(memory.LAYERS, np.bool_)
GROUND_MARGIN = 1.0 + OUTLINE_INSET
"""Cells before unseen ground at which the robot stops backing: the one it reaches into, and the outline's inset."""
SENSORS = ("lidar", "depth camera", "depth camera")
"""Names of the sensors of the memory's layers."""


class CheckedTwist(NamedTuple):
    """The fraction of a twist that is safe, 0 to 1, and what limits it if it is less than 1, else an empty string.

    point: the obstacle that limits it, None if there is none.
    """

    fraction: float
    limit: str = ""
    point: SensedPoint | None = None


FREE = CheckedTwist(1.0)


class CollisionMonitor:
    """Checks twists of one robot. All poses are in odom, all times in ns of the loop's clock."""

    def __init__(self, robot: Robot, params: CollisionMonitorParams, ultrasonic_margin: float) -> None:
        self._robot, self._sensors, self._plane = robot, robot.sensors, plane_of(robot)
        self.configure(params, ultrasonic_margin)
        camera, polygons = robot.sensors.depth_camera, self.polygons
        blind = 0.0
        if camera is not None:
            steepest = camera.mount.pitch + math.atan(camera.half_height)
            floor = camera.mount.z / math.tan(max(steepest, 0.1))
            blind = camera.mount.x + max(floor, max_blind_distance(camera))
        lidar = robot.sensors.lidar
        self._near_noise = NEAR_DEVIATIONS * lidar.noise if lidar is not None else 0.0
        self.reach = max(polygons.reach, blind) + 2.0 * polygons.circumscribed
        """Distance up to which obstacles are remembered, m."""
        self._memory = memory.new_memory(self.reach, polygons.resolution)
        self._points = np.empty((memory.MAX_POINTS, 2))
        self._layers = np.empty(memory.MAX_POINTS, np.int64)
        self._stamps = np.empty(memory.MAX_POINTS, np.int64)
        self._echo: Range | None = None
        self._has_looked = False
        """Whether a sensor that shows ground has sent anything."""

    def configure(self, params: CollisionMonitorParams, ultrasonic_margin: float) -> None:
        """Use other parameters from the next twist on."""
        self.params, self._ultrasonic_margin = params, ultrasonic_margin
        self.polygons = MonitorPolygons.of(
            self._robot, params.side_margin, max(params.side_margin, params.slow_margin)
        )

    # -- sensors

    def process_scan(self, scan: LaserScan, sensor: SE2) -> None:
        """Process a planar scan from `sensor`; a depth camera's shows what stands behind the nearest obstacle.

        The camera's obstacle scan has the nearest one in each direction only. A lidar's scan shows the ground, too.
        """
        ranges = scan.ranges.astype(np.float64)
        angles, stamp_ns = scan.angles.astype(np.float64), scan.header.stamp.ns
        ranges[ranges >= scan.range_max] = np.inf
        invalid = ~(ranges > 0.0)
        is_lidar = self._sensors.lidar is not None
        self._has_looked |= is_lidar
        starts = np.zeros(len(ranges)) if is_lidar else np.full(len(ranges), float(scan.range_min))
        # a ray without a return shows what is free as far as the sensor measures, and no farther; of a surface at the
        # minimum range only the returns that are too long remain, so they do not clear nearer points
        clears_none = invalid | (ranges < scan.range_min + self._near_noise)
        ends = np.where(clears_none, -np.inf, np.minimum(ranges, scan.range_max) - self.polygons.resolution)
        clears = np.array([is_lidar, False, True])
        thin = slice(None, None, self._thinning(float(scan.angle_increment)))
        rays = [np.ascontiguousarray(values[thin]) for values in (angles, starts, ends)]
        memory.clear_rays(self._memory, sensor.array(), *rays, stamp_ns, clears, SEEN_FLOOR & is_lidar)
        marked = np.where(invalid, np.inf, ranges)
        layer = memory.LIDAR if is_lidar else memory.UPRIGHT
        memory.mark_points(self._memory, sensor.array(), angles, marked, stamp_ns, layer)

    def _thinning(self, increment: float) -> int:
        """Return of how many neighbouring rays one passes through each cell within reach."""
        spacing = abs(increment) * self.reach
        return max(1, int(self.polygons.resolution / spacing)) if spacing > 0.0 else 1

    def process_obstacles(self, scan: ObstacleScan, sensor: SE2) -> None:
        """Process an obstacle scan of the depth camera, seen from the point on the floor below it."""
        self._has_looked = True
        ranges, at, stamp_ns = scan.ranges.astype(np.float64), sensor.array(), scan.header.stamp.ns
        angles = scan.angles
        starts = scan.clear_from.astype(np.float64)
        ends = np.where(scan.clear_to > 0.0, scan.clear_to, -np.inf).astype(np.float64)
        clears = np.array([False, True, True])
        memory.clear_rays(self._memory, at, angles, starts, ends, stamp_ns, clears, SEEN_FLOOR)
        # nearer than the floor in the picture, and before an obstacle, there is nothing as high as the view
        views = np.maximum(ends, np.where(np.isfinite(ranges), ranges, -np.inf))
        memory.clear_rays(
            self._memory, at, angles, np.zeros(len(ranges)), views, stamp_ns, NO_LAYER, BELOW_THE_VIEW
        )
        upright = through_plane(scan.bottom, scan.top, ranges, self._plane)
        for layer, chosen in ((memory.CAMERA, ~upright), (memory.UPRIGHT, upright)):
            memory.mark_points(self._memory, at, angles, np.where(chosen, ranges, np.inf), stamp_ns, layer)
        self._process_lower_ground(scan, ranges, at)

    def _process_lower_ground(
        self, scan: ObstacleScan, ranges: NDArray[np.float64], at: NDArray[np.float64]
    ) -> None:
        """Mark the ground behind the edges of drop-offs, which the robot may reach round the end of an edge."""
        lower, spacing = scan.lower_ground(self.reach), self.polygons.resolution
        depth = np.where(ranges >= 0.0, lower - ranges, 0.0)
        for behind in np.arange(spacing, depth.max(initial=0.0), spacing).tolist():
            beyond = np.where(behind < depth, ranges + behind, np.inf)
            memory.mark_points(self._memory, at, scan.angles, beyond, scan.header.stamp.ns, memory.CAMERA)

    def process_echo(self, echo: Range) -> None:
        """Process a range of the ultrasonic ranger; it counts until the next one, and is not remembered."""
        self._echo = echo

    # -- twists

    def check(self, v: float, w: float, pose: SE2, now_ns: int, latency: float) -> CheckedTwist:
        """Return which fraction of the twist (m/s, rad/s) is safe from `pose`; latency: until braking begins, s."""
        polygons = self.polygons
        memory.cover_body(self._memory, pose.array(), polygons.circumscribed, polygons.corners, now_ns)
        if polygons.body_speed(v, w) == 0.0:
            return FREE
        checks = [self._check_points(v, w, pose, now_ns, latency), self._check_echo(v, w, now_ns, latency)]
        if not self._sensors.covers_rear and (self._sensors.lidar or self._sensors.depth_camera):
            checks.append(self._check_ground(v, w, pose, now_ns, latency))
        return min(checks, key=lambda check: check.fraction)

    def points(self, pose: SE2, now_ns: int, reach: float) -> NDArray[np.float64]:
        """Return the remembered points (n, 2) not farther than `reach` (m) from `pose`, in base_link."""
        oldest_ns = now_ns - round(self.params.obstacle_memory_time * 1e9)
        arrays = self._points, self._layers, self._stamps
        count = memory.points_around(self._memory, pose.array(), reach, oldest_ns, *arrays)
        return self._points[:count]

    def _check_points(self, v: float, w: float, pose: SE2, now_ns: int, latency: float) -> CheckedTwist:
        polygons = self.polygons
        points = self.points(pose, now_ns, polygons.reach_of(v, w, latency))
        if not len(points):
            return FREE
        slow_time, slow = first_contact(
            points, v, w, polygons.slow_radius, polygons.slow_corners, polygons.inscribed
        )
        if slow < 0:
            return FREE
        stop_time, stop = first_contact(
            points, v, w, polygons.stop_radius, polygons.stop_corners, polygons.inscribed
        )
        fraction, index = self._fraction(v, w, stop_time, self.params.margin, latency), stop
        careful = self._fraction(v, w, slow_time, self.params.margin, latency)
        if careful < fraction:
            # near obstacles beside the path only the slow speed is left
            fraction, index = max(careful, min(fraction, self._slow_fraction(v, w))), slow
        if fraction >= 1.0:
            return FREE
        x, y = points[index].tolist()
        age = (now_ns - int(self._stamps[index])) / 1e9
        seen = SensedPoint(SENSORS[int(self._layers[index])], x, y, age)
        return CheckedTwist(fraction, obstacle_text(seen, polygons), seen)

    def _check_echo(self, v: float, w: float, now_ns: int, latency: float) -> CheckedTwist:
        """Check the surface that the ultrasonic ranger measures, anywhere in its cone."""
        ranger, echo, polygons = self._sensors.ultrasonic, self._echo, self.polygons
        if ranger is None or echo is None or now_ns - echo.header.stamp.ns > ECHO_TIMEOUT_NS:
            return FREE
        distance = max(0.0, echo.range)  # -inf: nearer than the minimum range (REP-117); 0 also for NaN
        if math.isinf(distance):
            return FREE
        half = ranger.field_of_view / 2.0
        angles = ranger.mount.yaw + np.linspace(-half, half, CONE_POINTS)
        # in rows, as the remembered points are: the kernel is compiled once
        points = np.column_stack(
            [ranger.mount.x + distance * np.cos(angles), ranger.mount.y + distance * np.sin(angles)]
        )
        time, index = first_contact(points, v, w, polygons.stop_radius, polygons.stop_corners, 0.0)
        fraction = self._fraction(v, w, time, self._ultrasonic_margin, latency)
        if fraction < 1.0:
            x, y = points[index].tolist()
            seen = SensedPoint("ultrasonic ranger", x, y, (now_ns - echo.header.stamp.ns) / 1e9)
            return CheckedTwist(fraction, obstacle_text(seen, polygons), seen)
        return FREE

    def _check_ground(self, v: float, w: float, pose: SE2, now_ns: int, latency: float) -> CheckedTwist:
        """Check that the ground was seen recently: else the robot does not back up, and otherwise moves slowly.

        Ahead it is enough that a sensor looks over it, as a camera does not see the floor near the body. Where none
        ever has, as beside a robot that was just switched on, it creeps.

        Where it backs up over ground that it saw, or covered, a moment ago, somebody may have come since: it creeps.
        """
        polygons = self.polygons
        if not len(polygons.corners) and abs(v) < MIN_DRIVING_SPEED:
            return FREE  # a disc covers the same ground while it rotates
        oldest_ns = now_ns - round(self.params.ground_memory_time * 1e9)
        creep = CREEP_SPEED / polygons.body_speed(v, w)
        if v < -MIN_DRIVING_SPEED:
            margin = GROUND_MARGIN * polygons.resolution
            seen = self._ground_fraction(v, w, pose, latency, oldest_ns, memory.GROUND, TOLERATED_GAP, margin)
            fraction = min(seen, creep)
        else:
            # without sensors nobody can look first, as on a robot whose camera is not connected
            ever = math.inf
            if self._has_looked:
                ever = self._ground_fraction(v, w, pose, latency, ANY_TIME_NS, memory.VIEW, TOLERATED_GAP)
            half_width = round(polygons.inscribed / polygons.resolution)
            seen = self._ground_fraction(v, w, pose, latency, oldest_ns, memory.VIEW, half_width)
            fraction = min(max(ever, creep), max(seen, self._slow_fraction(v, w)))
        return FREE if fraction >= 1.0 else CheckedTwist(fraction, unseen_text(v))

    def _ground_fraction(
        self,
        v: float,
        w: float,
        pose: SE2,
        latency: float,
        oldest_ns: int,
        kind: int,
        tolerated: int,
        margin: float = 0.0,
    ) -> float:
        """Return the fraction of a twist that stops `margin` metres before ground not seen since `oldest_ns`.

        kind, tolerated: see `local_memory.time_on_seen_ground`.
        """
        beyond = margin / self.polygons.body_speed(v, w)
        beyond = min(beyond, math.tau / abs(w)) if w else beyond  # after a full turn nothing is new
        duration = latency + self.polygons.braking_time(v, w) + beyond
        free_time = memory.time_on_seen_ground(
            self._memory, pose.array(), v, w, self.polygons.outline, duration, oldest_ns, tolerated, kind
        )
        return self._fraction(v, w, free_time, margin, latency)

    def _fraction(self, v: float, w: float, time: float, margin: float, latency: float) -> float:
        polygons = self.polygons
        free = time - margin / polygons.body_speed(v, w)
        return safe_fraction(free, latency, polygons.braking_time(v, w))

    def _slow_fraction(self, v: float, w: float) -> float:
        """Return the fraction, or the multiple, of the twist at which the body has the slow speed."""
        return self.params.slowdown_ratio * self.polygons.limits.speed / self.polygons.body_speed(v, w)
