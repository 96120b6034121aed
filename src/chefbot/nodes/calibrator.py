"""Drives the calibration pattern and records the measurements."""

from __future__ import annotations

from chefbot.calibration.calibrate import CalibrationDrive
from chefbot.calibration.choreography import NO_SCANS, SCAN_TIMEOUT, Choreography, raise_on_error
from chefbot.calibration.params import CalibratorParams
from chefbot.calibration.steps import CalibrationDriveError, Look, Notice, Straight, Turn
from chefbot.calibration.wiring import board_error, explain_board_message
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav2_msgs import DriveOnHeading, Spin
from chefbot.msgs.sensor_msgs import Imu, LaserScan
from chefbot.msgs.std_msgs import Bool, String
from chefbot.nodes.scans.deskewing import when_deskewed
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.scan.usable_range import usable_range
from chefbot.slam.scan_tracker import ScanTracker


class CalibratorNode(Node):
    """Drives the choreography of the calibration; `drive` is what was measured, `failure` why it ended early."""

    params: CalibratorParams
    scan: In[LaserScan]
    wheel_ticks: In[WheelTicks]
    imu: In[Imu] = topic("imu/data")
    cmd_vel_teleop: In[Twist]
    emergency_stop: In[Bool]
    diagnostics: In[DiagnosticArray]
    spin = action_client(Spin)
    drive_on_heading = action_client(DriveOnHeading)
    notice: Out[String] = topic("calibration/notice")

    def start(self) -> None:
        """Initialize the records and start the calibration drive."""
        import scipy.spatial  # noqa: F401 (the import takes half a second: now, not at the first station)

        self.failure: str | None = None
        self.finished = False
        reach = usable_range(self.robot, 0.05)
        self._tracker = ScanTracker(reach)
        self._choreography = Choreography(self.robot, self.params, reach)
        self._scans_complete: Future[None] = Future()
        self._scan_ns = self.now_ns
        self._moving = False
        self._task = self.spawn(self._run())

    @property
    def drive(self) -> CalibrationDrive:
        """The measurements so far: stations, legs and squares."""
        return self._choreography.drive

    @property
    def mount(self) -> SE2:
        """Pose of the scanning sensor in base_link, from the robot file."""
        frame = self.scan.last.header.frame_id if self.scan.last else "base_link"
        return self.tf.lookup("base_link", frame)

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """Record the tick counts of the leg."""
        self._choreography.motion.add_ticks(ticks.left, ticks.right)

    def on_imu(self, imu: Imu) -> None:
        """Integrate the gyro's yaw rate (rad/s) into the turn of the leg."""
        self._choreography.motion.add_rate(imu.angular_velocity.z, imu.header.stamp.ns)

    def on_scan(self, scan: LaserScan) -> None:
        """Process the scan once odometry at its time is available."""
        self._scan_ns = self.now_ns
        when_deskewed(self.tf, scan, scan.header.frame_id, self._process_scan)

    def _process_scan(self, scan: LaserScan, odom_pose: SE2) -> None:
        tracker_pose = self._tracker.add(scan.angles, scan.ranges, odom_pose, scan.range_max)
        if self._choreography.room.add(scan, tracker_pose):
            self._scans_complete.set_result(None)

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
        error = board_error(array)
        if error and self._moving:
            self._abort(explain_board_message(error, *self._choreography.motion.counted))

    @every(hz=2)
    def check_scans(self) -> None:
        """Abort the drive when no scans arrive."""
        if self.now_ns - self._scan_ns > SCAN_TIMEOUT * 1e9:
            self._abort(NO_SCANS)

    def _abort(self, reason: str) -> None:
        if not (self.finished or self.failure is not None):
            self.failure = reason
            self._task.cancel()

    async def _run(self) -> None:
        try:
            for step in self._choreography.steps():
                match step:
                    case Notice(sentence):
                        self.notice.publish(String(sentence))
                    case Straight(metres):
                        await self._straight(metres)
                    case Turn(angle):
                        await self._turn(angle)
                    case Look(ends_leg):
                        await self._look(ends_leg)
            self.finished = True
        except CalibrationDriveError as reason:
            self.failure = self.failure or str(reason)
        except Cancelled:
            self.failure = self.failure or "the drive was broken off"
            raise

    async def _straight(self, metres: float) -> None:
        self._moving = True
        result = await self.drive_on_heading.call(Straight(metres).goal(self.robot))
        raise_on_error(result.error_code, result.error_msg)

    async def _turn(self, angle: float) -> None:
        self._moving = True
        result = await self.spin.call(Turn(angle).goal(self.robot))
        raise_on_error(result.error_code, result.error_msg)

    async def _look(self, ends_leg: bool) -> None:
        """Record the scans of a station at standstill, and the leg from the previous station to it."""
        motion = None
        if ends_leg:
            await self.sleep(self.params.settle)
            motion = self._choreography.motion.motion
        await self.sleep(self.params.settle)
        self._choreography.room.begin()
        self._scans_complete = Future()
        await self._scans_complete
        self._choreography.finish_station(self.mount, motion)
