"""A base with ROS 2, such as a board with micro-ROS: twists to it, odometry and IMU from it."""

from __future__ import annotations

import msgspec

from chefbot.board.command_gate import NEVER_NS, CommandGate
from chefbot.board.drives.drive_link import MAX_UNATTENDED_SPEED
from chefbot.control.kinematics import twist_of
from chefbot.devices.board_node import MotorBoardNode
from chefbot.devices.odometry_ticks import OdometryTicks
from chefbot.msgs.chefbot_msgs import WheelSpeeds, WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import BatteryState, Imu
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.robot.drivetrain import ROS_BASE
from chefbot.robot.motion_limits import max_speed, max_turn
from chefbot.runtime.node import In, NoParams, Out, every, topic

COMMAND_HZ = 20
"""Rate at which twists are sent, zeros as well, Hz."""
SILENCE_NS = 500_000_000
"""Time without odometry after which the motion of the base is unknown, and it is stopped, ns."""
MAX_CLOCK_ERROR_NS = 500_000_000
"""Difference of a stamp from this computer's clock above which it is not believed, ns."""


class RosBaseDevice(MotorBoardNode):
    """Takes the place of the motor board for a robot whose drive has the protocol `ros2`; else it does nothing.

    The topics are those of a micro-ROS board of linorobot2 in the namespace `base`. A base that does not stop by
    itself (drive.command_timeout) is driven slowly, as it keeps moving if this computer fails.
    """

    params: NoParams
    base_odometry: In[Odometry] = topic("base/odom/unfiltered")
    base_imu: In[Imu] = topic("base/imu/data")
    base_battery: In[BatteryState] = topic("base/battery")
    base_command: Out[Twist] = topic("base/cmd_vel")
    notice: Out[String] = topic("board/notice")

    def start(self) -> None:
        """Wait for the odometry of the base."""
        robot = self.robot
        self._active = robot.drive.protocol == ROS_BASE
        if not self._active:
            for port in (*self.board_outputs, self.base_command, self.notice):
                port.unadvertise()
            return
        slow = robot.drive.command_timeout is None
        self._gate = CommandGate(
            MAX_UNATTENDED_SPEED / robot.wheel_radius if slow else robot.motor.no_load_speed
        )
        self._ticks = OdometryTicks(robot, max_speed(robot), max_turn(robot))
        self._odometry_ns, self._wrong_stamps, self._was_silent = NEVER_NS, 0, True
        self.announcement = "ROS 2 base: waiting for odometry on base/odom/unfiltered."
        if slow:
            self.announcement += (
                f" It is limited to {MAX_UNATTENDED_SPEED:g} m/s: drive.command_timeout is not given."
            )

    # -- to the base

    def on_wheel_speeds(self, command: WheelSpeeds) -> None:
        """Set the speeds that are sent next."""
        if self._active:
            self._gate.command(command.left, command.right, self.now_ns)

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Send zeros from now on, or accept commands again after a stop was commanded once."""
        if self._active and pressed.data:
            self._gate.stop()
            self._send()
        elif self._active and self._gate.stopped:
            self._gate.clear()

    @every(hz=COMMAND_HZ)
    def send_command(self) -> None:
        """Send the twist that is commanded, or a stop."""
        if self._active:
            self._note_silence()
            self._send()

    def _send(self) -> None:
        left, right = (0.0, 0.0) if self._is_silent else self._gate.speeds(self.now_ns)
        self.base_command.publish(Twist.of(*twist_of(left, right, self.robot)))

    # -- from the base

    def on_base_odometry(self, message: Odometry) -> None:
        """Publish the ticks that belong to the pose."""
        if not self._active:
            return
        stamp_ns = self._stamp(message.header)
        left, right = self._ticks.update(message.pose.pose.se2, stamp_ns)
        self._odometry_ns = self.now_ns
        self._note_silence()
        self.publish_sensor_message(WheelTicks(Header.of(stamp_ns, "base_link"), left, right))

    def on_base_imu(self, message: Imu) -> None:
        """Pass the IMU on, in the frame of the robot file, unless the robot has another one."""
        if self._active and not self.robot.sensors.imu.driver:
            header = Header.of(self._stamp(message.header), "imu_link")
            self.publish_sensor_message(msgspec.structs.replace(message, header=header))

    def on_base_battery(self, message: BatteryState) -> None:
        """Pass the battery's state on."""
        if self._active:
            self.publish_sensor_message(message)

    def _stamp(self, header: Header) -> int:
        """Return the time of a message; that of its arrival if the board's clock is not that of this computer."""
        error = abs(self.now_ns - header.stamp.ns)
        if error <= MAX_CLOCK_ERROR_NS:
            return header.stamp.ns
        self._wrong_stamps += 1
        return self.now_ns

    # -- health

    @property
    def _is_silent(self) -> bool:
        return self.now_ns - self._odometry_ns > SILENCE_NS

    def _note_silence(self) -> None:
        """Report a base that begins or ceases to send odometry; what was commanded before does not count after."""
        silent = self._is_silent
        if silent == self._was_silent:
            return
        self._was_silent = silent
        self._gate.reset()
        self.publish_connection(not silent)
        state = "sends no odometry; the robot stands" if silent else "sends odometry"
        self.notice.publish(String(f"ROS 2 base: it {state}."))

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish the diagnostics of the base."""
        if not self._active:
            return
        level, text = OK, "The ROS 2 base is OK."
        if self._is_silent:
            level = ERROR
            text = "No odometry on base/odom/unfiltered: look at the base, its micro-ROS agent and the bridge to DDS."
        elif self._wrong_stamps:
            level, text = (
                WARN,
                "The clock of the base is not that of this computer; its messages get the time of their arrival.",
            )
        counters = {"wrong stamps": self._wrong_stamps, "restarts": self._ticks.restarts}
        values = tuple(KeyValue(key, str(value)) for key, value in counters.items())
        status = DiagnosticStatus(level, "board", text, "base/odom/unfiltered", values)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))
