"""Drives the calibration pattern and records the measurements."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from chefbot.calibration.alignment import localize_station
from chefbot.calibration.drive import DriveSegment, Square, Station
from chefbot.calibration.surface import Surface
from chefbot.calibration.wiring import explain_board_message, wiring_fault
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, DiagnosticArray
from chefbot.msgs.geometry_msgs import Point, Twist
from chefbot.msgs.nav2_msgs import DriveOnHeading, DriveOnHeading_Goal, Spin, Spin_Goal
from chefbot.msgs.sensor_msgs import Imu, LaserScan
from chefbot.msgs.std_msgs import Bool, String
from chefbot.robot.motion_limits import max_speed, max_turn
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.scan.usable_range import usable_range
from chefbot.slam.scan_tracker import ScanTracker

SPEED_FRACTION = 0.8
"""Fraction of the maximum speed: wheels below their limit slip less."""
SCANS_PER_STATION = 10
"""Scans per station; their mean is matched."""
SETTLING_TIME = 0.6
"""Pause between the end of a motion and the first scan, s."""
SCAN_TIMEOUT = 5.0
"""Maximum time without a scan, or until the first one, s."""
SIDE_LENGTHS = (2.5, 2.0, 1.5, 1.0)
"""Side lengths of the squares, m; the first one with enough free space is used."""
MARGIN = 0.25
"""Minimum clearance between the robot's footprint on the square and obstacles, m."""
SELF_FILTER_MARGIN = 0.05
"""Margin around the footprint within which lidar returns are filtered as the robot's own tubes, m."""
MIN_VALID_FRACTION, MAX_RANGE_SPREAD = 0.7, 0.06
"""Minimum fraction of a station's scans with a valid range, per beam, and maximum deviation of these ranges
relative to their mean (at least 1 m): at edges some scans hit the foreground and some the background."""
MIN_WALL_FRACTION = 0.1
"""Minimum fraction of beams that must hit a wall."""
PROBE, PROBE_TURN = 0.15, 0.6
"""First careful motions, m and rad, which show whether wheels, encoders and gyro are wired correctly."""
HOME_DISTANCE, HOME_ANGLE = 0.03, math.radians(1.5)
"""Tolerances of the return to the start of a square, m and rad."""


class CalibratorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Number and size of the squares, and the settling time."""

    squares: Annotated[
        int, Meta(ge=1, le=20, description="squares each way to calibrate by, and as many to check it")
    ] = 4
    side: Annotated[
        float, Meta(ge=0, le=10, description="of the squares, m; 0: as large as there is room")
    ] = 0.0
    settle: Annotated[float, Meta(ge=0, le=5, description="pause before the first look of a stand, s")] = (
        SETTLING_TIME
    )


class CalibrationDriveError(Exception):
    """Raised when the drive ends early; the message is the reason."""


class CalibratorNode(Node):
    """Drives turns, then squares in both directions, twice: for the calibration and for its validation.

    At each station it scans the walls; legs between stations are in `legs` and `checks`. If the robot is stopped,
    driven by teleoperation, blocked or without scans, the drive ends and `failure` is the reason.
    """

    params: CalibratorParams
    scan: In[LaserScan]
    wheel_ticks: In[WheelTicks]
    imu: In[Imu] = topic("imu/data")
    cmd_vel_teleop: In[Twist]
    emergency_stop: In[Bool]
    diagnostics: In[DiagnosticArray]
    spin = action_client(Spin)
    drive_on_heading = action_client(DriveOnHeading)
    remark: Out[String] = topic("calibration/remark")

    def start(self) -> None:
        """Initialize the records and start the calibration drive."""
        import scipy.spatial  # noqa: F401 (the import takes half a second: now, not at the first station)

        self.legs: list[DriveSegment] = []
        self.squares: list[Square] = []
        self.checks: list[Square] = []
        self.failure: str | None = None
        self.finished = False
        self._reach = usable_range(self.robot, 0.05)
        self._tracker = ScanTracker(self._reach)
        self.stations: list[Station] = []
        self._surfaces: list[Surface] = []
        self._room_T_tracker = IDENTITY
        self._station_scans: list[tuple[SE2, LaserScan]] | None = None
        self._scans_complete: Future[None] = Future()
        self._sensor_pose = IDENTITY
        self._scan_ns = self.now_ns
        self._reset_leg()
        self._task = self.spawn(self._run())

    # -- measurements

    def _reset_leg(self) -> None:
        """Reset the tick and gyro measurements for a new leg."""
        self._ticks: list[tuple[int, int]] = self._ticks[-1:] if hasattr(self, "_ticks") else []
        self._gyro_angle = self._gyro_seconds = 0.0

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """Record the tick counts of the leg."""
        self._ticks.append((ticks.left, ticks.right))

    def on_imu(self, imu: Imu) -> None:
        """Integrate the gyro; a rate is the mean since the previous message."""
        stamp = imu.header.stamp.ns
        last_ns = getattr(self, "_imu_ns", None)
        self._imu_ns = stamp
        if last_ns is not None and 0 < stamp - last_ns < 1_000_000_000:
            self._gyro_angle += imu.angular_velocity.z * (stamp - last_ns) / 1e9
            self._gyro_seconds += (stamp - last_ns) / 1e9

    def on_scan(self, scan: LaserScan) -> None:
        """Process the scan once odometry at its time is available."""
        self._scan_ns = self.now_ns
        self.tf.on_available(
            "odom", scan.header.frame_id, scan.header.stamp.ns, lambda at: self._process_scan(scan, at)
        )

    def _process_scan(self, scan: LaserScan, odom_pose: SE2) -> None:
        tracker_pose = self._tracker.add(scan.angles, scan.ranges, odom_pose, scan.range_max)
        self._sensor_pose = self._room_T_tracker @ tracker_pose
        if self._station_scans is None or len(self._station_scans) >= SCANS_PER_STATION:
            return
        self._station_scans.append((self._sensor_pose, scan))
        if len(self._station_scans) == SCANS_PER_STATION:
            self._scans_complete.set_result(None)

    def _wall_points(self, scans: list[LaserScan]) -> NDArray[np.float64]:
        """Return the wall points (n, 2) in the sensor's frame, from beams with consistent ranges off the robot."""
        ranges = np.array([scan.ranges for scan in scans], np.float64)
        ranges[~((ranges > 0.0) & (ranges < min(self._reach, scans[0].range_max)))] = np.nan
        valid = np.isfinite(ranges).sum(axis=0) >= MIN_VALID_FRACTION * len(scans)
        mean, angles = np.nanmean(ranges[:, valid], axis=0), scans[0].angles[valid].astype(np.float64)
        steady = np.nanmax(np.abs(ranges[:, valid] - mean), axis=0) < MAX_RANGE_SPREAD * np.maximum(mean, 1.0)
        points = (mean * (np.cos(angles), np.sin(angles))).T[steady]
        outside = np.hypot(*self.mount.apply(points).T) > self.robot.footprint_radius + SELF_FILTER_MARGIN
        self._hit_ratio = float(valid.mean())
        return np.asarray(points[outside])

    # -- reasons to abort

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Abort the drive; it does not resume by itself."""
        if pressed.data:
            self._abort("the emergency stop was pressed")

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """Abort the drive when teleoperation commands a motion."""
        if twist.linear.x or twist.angular.z:
            self._abort("a person drives the robot")

    def on_diagnostics(self, array: DiagnosticArray) -> None:
        """Abort the drive when the board reports an error and has stopped its motors."""
        for status in array.status:
            if status.name == "board" and status.level == ERROR and self._moving:
                tick_ranges = np.ptp(np.array(self._ticks or [(0, 0)]), axis=0)
                self._abort(explain_board_message(status.message, int(tick_ranges[0]), int(tick_ranges[1])))

    @every(hz=2)
    def check_scans(self) -> None:
        """Abort the drive when no scans arrive."""
        if self.now_ns - self._scan_ns > SCAN_TIMEOUT * 1e9:
            self._abort(
                f"no scans for {SCAN_TIMEOUT:.0f} s; the launch needs the driver of a lidar or of a depth camera"
            )

    def _abort(self, reason: str) -> None:
        if not self._is_over:
            self.failure = reason
            self._task.cancel()

    @property
    def _is_over(self) -> bool:
        return self.finished or self.failure is not None

    # -- driving

    _moving = False

    async def _run(self) -> None:
        try:
            await self._drive()
            self.finished = True
        except CalibrationDriveError as reason:
            self.failure = self.failure or str(reason)
        except Cancelled:
            self.failure = self.failure or "the drive was broken off"
            raise

    async def _drive(self) -> None:
        self._publish_remark(
            "Stand clear. The robot turns on the spot, then drives squares; STOP or any key ends it."
        )
        await self._measure_station()
        await self._probe()
        await self._scan_around(1)
        side = self._largest_side()
        for turn in (-1.0, 1.0):
            await self._turn(turn * 2.0 * math.pi)
            await self._measure_leg()
        await self._scan_around(-1)
        home = self._sensor_pose
        for squares, purpose in ((self.squares, "to calibrate by"), (self.checks, "to check it")):
            for number in range(2 * self.params.squares):
                direction = "left" if number % 2 == 0 else "right"
                self._publish_remark(
                    f"Square {number + 1} of {2 * self.params.squares} {purpose}, {side} m, to the {direction}."
                )
                squares.append(await self._square(home, side, 1 if number % 2 == 0 else -1))

    async def _probe(self) -> None:
        """Move a little forward, back, left and right; raise an error if wheels, encoders or gyro are miswired."""
        if self._hit_ratio < MIN_WALL_FRACTION:
            raise CalibrationDriveError(
                f"the sensor sees walls with {100 * self._hit_ratio:.0f} % of its beams within {self._reach:.0f} m; "
                "calibrate in a room"
            )
        for metres, angle in ((PROBE, 0.0), (0.0, PROBE_TURN), (0.0, -PROBE_TURN), (-PROBE, 0.0)):
            await (self._straight(metres) if metres else self._turn(angle))
            leg = await self._measure_leg()
            sentence = wiring_fault(leg, metres, angle)
            if sentence:
                raise CalibrationDriveError(sentence)

    async def _scan_around(self, turn: int) -> None:
        """Turn once around in steps of half the field of view, so that consecutive scans overlap by half."""
        steps = math.ceil(2.0 * math.pi / (0.5 * min(self._field_of_view(), math.pi)))
        for _ in range(steps):
            await self._turn(turn * 2.0 * math.pi / steps)
            await self._measure_leg()

    def _field_of_view(self) -> float:
        """Return the field of view of the scanning sensor, rad."""
        scan = self.scan.last
        return 2.0 * math.pi if scan is None else scan.angle_max - scan.angle_min

    async def _square(self, home: SE2, side: float, turn: int) -> Square:
        """Drive one square; both directions cover the same ground.

        A square to the right starts along the last side of the one to the left.
        """
        await self._return_to(home if turn > 0 else home @ SE2(0.0, 0.0, math.pi / 2))
        legs = []
        for _ in range(4):
            await self._straight(side)
            legs.append(await self._measure_leg())
            await self._turn(turn * math.pi / 2)
            legs.append(await self._measure_leg())
        return Square(turn, side, tuple(legs))

    async def _return_to(self, target: SE2) -> None:
        """Return to a sensor pose by scan matching."""
        for _ in range(3):
            direction = self._robot_pose().between(self._robot_pose_of(target))
            distance = math.hypot(direction.x, direction.y)
            if distance > HOME_DISTANCE:
                bearing = math.atan2(direction.y, direction.x)
                backwards = abs(bearing) > math.pi / 2
                await self._turn(wrap(bearing + math.pi) if backwards else bearing)
                await self._straight(-distance if backwards else distance)
                await self._measure_leg()
            heading_error = wrap(target.yaw - self._sensor_pose.yaw)
            if abs(heading_error) > HOME_ANGLE:
                await self._turn(heading_error)
                await self._measure_leg()
            elif distance <= HOME_DISTANCE:
                return

    def _robot_pose(self) -> SE2:
        return self._robot_pose_of(self._sensor_pose)

    def _robot_pose_of(self, sensor: SE2) -> SE2:
        return sensor @ self.mount.inverse()

    @property
    def mount(self) -> SE2:
        """Pose of the scanning sensor in base_link, from the robot file."""
        frame = self.scan.last.header.frame_id if self.scan.last else "base_link"
        return self.tf.lookup("base_link", frame)

    async def _straight(self, metres: float) -> None:
        time_allowance = Duration.of(10.0 + 4.0 * abs(metres) / (SPEED_FRACTION * max_speed(self.robot)))
        self._moving = True
        speed = math.copysign(SPEED_FRACTION * max_speed(self.robot), metres)
        result = await self.drive_on_heading.call(DriveOnHeading_Goal(Point(metres), speed, time_allowance))
        self._raise_on_error(result.error_code, result.error_msg)

    async def _turn(self, angle: float) -> None:
        if abs(angle) < 0.03:
            return
        time_allowance = Duration.of(10.0 + 4.0 * abs(angle) / max_turn(self.robot))
        self._moving = True
        result = await self.spin.call(Spin_Goal(angle, time_allowance))
        self._raise_on_error(result.error_code, result.error_msg)

    @staticmethod
    def _raise_on_error(code: int, sentence: str) -> None:
        if code:
            raise CalibrationDriveError(
                f"the robot did not get on: {sentence[:1].lower()}{sentence[1:].rstrip('.')}"
            )

    async def _measure_station(self) -> SE2:
        """Record the scans of a station at standstill and return the sensor's pose."""
        await self.sleep(self.params.settle)
        self._station_scans, self._scans_complete = [], Future()
        await self._scans_complete
        scans, self._station_scans = self._station_scans, None
        # mean pose of the tracker over the scans
        mean = np.array([(p.x, p.y, math.cos(p.yaw), math.sin(p.yaw)) for p, _ in scans]).mean(axis=0)
        tracker_pose = SE2(float(mean[0]), float(mean[1]), math.atan2(mean[3], mean[2]))
        self._add_station(tracker_pose, self._wall_points([scan for _, scan in scans]))
        self._reset_leg()
        return self._sensor_pose

    def _add_station(self, tracker_pose: SE2, walls: NDArray[np.float64]) -> None:
        """Add a station, placed by matching it with all previous stations.

        The tracker's drift, with odometry not calibrated yet, reaches 11 degrees and 0.3 m in ten minutes.
        """
        surface = Surface(walls)
        self._sensor_pose = localize_station(
            surface, tracker_pose, [station.pose for station in self.stations], self._surfaces
        )
        self._room_T_tracker = self._sensor_pose @ tracker_pose.inverse() @ self._room_T_tracker
        self.stations.append(Station(self._sensor_pose, walls))
        self._surfaces.append(surface)

    async def _measure_leg(self) -> DriveSegment:
        """Measure a station and record the leg from the previous station to it."""
        start = self.stations[-1].pose
        await self.sleep(self.params.settle)
        ticks, angle, seconds = np.array(self._ticks, np.float64), self._gyro_angle, self._gyro_seconds
        end = await self._measure_station()
        leg = DriveSegment(
            ticks, angle, seconds, start, end, (len(self.stations) - 2, len(self.stations) - 1)
        )
        self.legs.append(leg)
        return leg

    def _largest_side(self) -> float:
        """Return the largest side length with enough free space ahead and to the left; raise an error if none."""
        points = self._sensor_pose.inverse().apply(
            np.concatenate([station.pose.apply(station.walls) for station in self.stations])
        )
        points = self.mount.apply(points)
        gap = self.robot.footprint_radius + MARGIN
        sides = (self.params.side,) if self.params.side else SIDE_LENGTHS
        for side in sides:
            distance = np.hypot(*(np.maximum(np.abs(points - side / 2) - side / 2, 0.0)).T)
            if not (distance < gap).any():
                return side
        raise CalibrationDriveError(
            f"there is no room for a square of {sides[-1]:.1f} m; put the robot in a corner of a free square of "
            f"{sides[-1] + 2 * gap:.1f} m, {gap:.1f} m from its edges, looking along one with the room to its left"
        )

    def _publish_remark(self, sentence: str) -> None:
        self.remark.publish(String(sentence))
