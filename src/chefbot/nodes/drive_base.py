"""The drive base: command multiplexer, emergency stop, velocity limits and collision monitor in front of the
wheels."""

from __future__ import annotations

from chefbot.control.kinematics import wheel_speeds
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.msgs.sensor_msgs import Imu, Range
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.collision_monitor import COMMAND_PERIOD, COMMAND_RATE
from chefbot.nodes.emergency_stop import EmergencyStopNode
from chefbot.odometry.messages import ImuConverter
from chefbot.odometry.tilt_detector import TiltDetector
from chefbot.robot.motion_limits import Limits, one_plane_warning
from chefbot.runtime.node import In, Out, every, topic
from chefbot.safety.cliff_stop import CliffStop
from chefbot.safety.collision_monitor import CheckedTwist
from chefbot.safety.command_multiplexer import CommandMultiplexer, CommandSource, StampedCommand
from chefbot.safety.monitor_text import limited_text
from chefbot.safety.params import DriveBaseParams
from chefbot.safety.speed_limit import fraction_within
from chefbot.safety.stop_latch import TIPPED_OVER
from chefbot.safety.velocity_limiter import VelocityLimiter

HELD = "Let go of the controls to drive again: they were held while a sensor failed or the emergency stop was active."


class DriveBaseNode(EmergencyStopNode):
    """Converts twists to wheel speeds: teleop overrides navigation, the emergency stop overrides both.

    Velocity limits, slow zones, ramps and the collision monitor apply to all. `cmd_vel` is the twist actually
    commanded. A command that is not repeated is a stop.
    """

    live_params = (
        "limiter.*",
        "teleop_hold",
        "*margin",
        "monitor.slowdown_ratio",
        "monitor.obstacle_memory_time",
        "monitor.ground_memory_time",
    )
    params: DriveBaseParams
    cmd_vel_teleop: In[Twist]
    cmd_vel_nav: In[Twist]
    process_lost: In[String]
    process_back: In[String]
    cliff: In[Range]
    imu: In[Imu] = topic("imu/data")
    speed_limit: In[SpeedLimit]
    cmd_vel: Out[Twist]
    wheel_speeds: Out[WheelSpeeds]

    def start(self) -> None:
        """Start at standstill and publish the state of the emergency stop."""
        super().start()
        self._limiter = VelocityLimiter(Limits.of(self.robot), self.params.limiter)
        self._commands = CommandMultiplexer(self.params.teleop_hold)
        self._cliffs = CliffStop(self.robot)
        self._imu, self._tilt = ImuConverter(self.robot), TiltDetector()
        self.announcement = one_plane_warning(self.robot)

    def reconfigure(self, params: DriveBaseParams) -> None:
        """Apply new parameters from the next command on."""
        self.params = params
        self._monitor.configure(params.monitor, params.ultrasonic_margin)
        self._limiter.params, self._commands.teleop_hold = params.limiter, params.teleop_hold

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """Accept a twist from teleoperation."""
        self._accept(CommandSource.TELEOP, twist)

    def on_cmd_vel_nav(self, twist: Twist) -> None:
        """Accept a twist from navigation."""
        self._accept(CommandSource.NAVIGATION, twist)

    def _accept(self, source: CommandSource, twist: Twist) -> None:
        self._commands.accept(source, twist.linear.x, twist.angular.z, self.now_ns, stopped=self._stop.active)

    def on_process_lost(self, process: String) -> None:
        """Stop at once, without a ramp; navigation counts again when the process is back, teleoperation before."""
        self._commands.lose_process(process.data)
        self._halt()
        self.publish_notice(f"{process.data} does not respond; the robot stops until it responds again.")

    def on_process_back(self, process: String) -> None:
        """Accept navigation again once no process is missing."""
        self._commands.restore_process(process.data)

    def on_cliff(self, reading: Range) -> None:
        """Stop at once, without a ramp, if the present motion leads over a cliff."""
        self._cliffs.process(reading)
        if self._limiter.v and self._cliffs.reason(self._limiter.v, self.now_ns):
            self._halt()

    def on_imu(self, imu: Imu) -> None:
        """Activate the emergency stop if the robot tips over."""
        if self._tilt.process(self._imu.reading(imu)):
            self._apply(self._stop.tip_over(self.now_ns))
        elif not self._tilt.tilted:
            self._stop.get_upright()

    @every(hz=COMMAND_RATE)
    def command(self) -> None:
        """Publish the next step of the velocity ramp, as far as it is safe."""
        now_ns, stopped = self.now_ns, self._verdict.requires_stop
        self.forget_own_stops()
        if self._judge_sensors().requires_stop and not stopped:
            self._commands.interrupt(CommandSource.TELEOP, now_ns)
            self._limiter.reset()  # at once, without a ramp
        command = StampedCommand(0.0, 0.0, now_ns) if self._stop.active else self._commands.select(now_ns)
        self.publish_notice(self._cliffs.new_notice(command.v, now_ns))
        allowed = self._allowed_fraction(command)
        allowed *= fraction_within(self.speed_limit.last, allowed * command.v, self._limiter.limits.speed)
        target = self._cliffs.limit(allowed * command.v, now_ns), allowed * command.w
        v, w = self._limiter.step(*target, command.age(now_ns), COMMAND_PERIOD)
        checked = self._checked(v, w)
        v, w = checked.fraction * v, checked.fraction * w
        self._limiter.reset(v, w)
        self._publish_reason(command, (v, w), checked)
        self._publish_command(v, w)

    def _publish_reason(
        self, command: StampedCommand, left: tuple[float, float], checked: CheckedTwist
    ) -> None:
        """Publish why the wheels get the twist `left` (m/s, rad/s), if that is less than the command."""
        now_ns, commanded = self.now_ns, (command.v, command.w)
        refuses = self._commands.refuses(CommandSource.TELEOP, now_ns) and not self._stop.active
        cliff = self._cliffs.reason(command.v, now_ns) if command.v else ""
        fault = TIPPED_OVER if self._tilt.tilted else self._verdict.fault
        limited = limited_text(checked.limit, commanded, left)
        held = HELD if refuses else ""
        self.explain(fault or limited or cliff or held)
        self.report_limit(commanded, left, checked, fault or cliff, self._pose()[0], held)

    def discard_commands(self) -> None:
        """Discard all commands and stop, at once."""
        self._commands.discard()
        self._halt()

    def _halt(self) -> None:
        self._limiter.reset()
        self._publish_command(0.0, 0.0)

    def _publish_command(self, v: float, w: float) -> None:
        self.cmd_vel.publish(Twist.of(v, w))
        left, right = wheel_speeds(v, w, self.robot)
        self.wheel_speeds.publish(WheelSpeeds(Header.of(self.now_ns, "base_link"), left, right))
