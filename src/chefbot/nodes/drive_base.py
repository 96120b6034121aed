"""The drive base: command multiplexer, emergency stop, velocity limits and collision monitor in front of the
wheels."""

from __future__ import annotations

from chefbot.control.kinematics import wheel_speeds
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, WheelSpeeds
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.sensor_msgs import Range
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.nodes.collision_monitor import COMMAND_PERIOD, COMMAND_RATE, CollisionMonitorNode
from chefbot.robot.motion_limits import Limits, one_plane_warning
from chefbot.runtime.node import RESTARTED, In, Out, every, restored, topic
from chefbot.safety.cliff_stop import CliffStop
from chefbot.safety.command_multiplexer import CommandMultiplexer, CommandSource, StampedCommand
from chefbot.safety.motion_policy import Restriction
from chefbot.safety.params import DriveBaseParams
from chefbot.safety.stop_latch import StopDecision, StopLatch
from chefbot.safety.velocity_limiter import VelocityLimiter


class DriveBaseNode(CollisionMonitorNode):
    """Converts twists to wheel speeds: teleop overrides navigation, the emergency stop overrides both.

    Velocity limits, ramps and the collision monitor apply to all. `cmd_vel` is the twist commanded. A command not
    repeated is a stop.

    This node alone owns the state of the emergency stop: others request a change on `stop_request`, and the node
    publishes the state on `emergency_stop` and the reason on `stop_status`, both transient local. A stop published
    on `emergency_stop` by another node counts; a release published there does not.
    """

    live_params = ("limiter.*", "teleop_hold", "*margin", "monitor.slow", "monitor.memory", "monitor.seen")
    params: DriveBaseParams
    cmd_vel_teleop: In[Twist]
    cmd_vel_nav: In[Twist]
    stop_request: In[Bool]
    external_stop: In[Bool] = topic("emergency_stop")
    board_connected: In[Bool]
    restored_status: In[EmergencyStopStatus] = restored("stop_status")
    restarted: In[Empty] = restored(RESTARTED)
    process_lost: In[String]
    process_back: In[String]
    cliff: In[Range]
    cmd_vel: Out[Twist]
    wheel_speeds: Out[WheelSpeeds]
    emergency_stop: Out[Bool] = topic(latched=True)
    stop_status: Out[EmergencyStopStatus] = topic(latched=True)
    remark: Out[String] = topic("base/remark")

    def start(self) -> None:
        """Start at standstill and publish the state of the emergency stop."""
        super().start()
        self._limiter = VelocityLimiter(Limits.of(self.robot), self.params.limiter)
        self._commands = CommandMultiplexer(self.params.teleop_hold)
        self._stop = StopLatch()
        self._cliffs, self._v = CliffStop(self.robot), 0.0
        self._own_stops: list[bool] = []
        """Messages on `emergency_stop` of this node that it has not received yet."""
        self._stop_published, self.announcement = False, one_plane_warning(self.robot)
        self.spawn(self._publish_initial_stop())

    async def _publish_initial_stop(self) -> None:
        await self.sleep(0.0)  # a state restored after a restart is published first, instead of this one
        if not self._stop_published:
            self._publish_stop(self._stop.status)

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

    def on_restored_status(self, status: EmergencyStopStatus) -> None:
        """Restore an active emergency stop after a restart."""
        self._apply(self._stop.restore(status, self.now_ns))

    def on_restarted(self, _: Empty) -> None:
        """Activate the emergency stop after a restart if its state could not be restored."""
        if self.restored_status.last is None:
            self._apply(self._stop.restore_unknown(self.now_ns))

    def on_stop_request(self, request: Bool) -> None:
        """Press or release the emergency stop on request; repeated requests have no effect."""
        self._apply(self._stop.request(request.data, self.now_ns))

    def on_external_stop(self, pressed: Bool) -> None:
        """Process `emergency_stop`: this node's own message, which changes nothing, or that of another publisher."""
        if pressed.data in self._own_stops:
            self._own_stops.remove(pressed.data)
        else:
            self._apply(self._stop.confirm(pressed.data, self.now_ns))

    def on_board_connected(self, connected: Bool) -> None:
        """Hold the robot while the motor board is lost; afterwards it drives on a new command."""
        change = self._stop.regain_board if connected.data else self._stop.lose_board
        self._apply(change(self.now_ns))

    def _apply(self, decision: StopDecision | None) -> None:
        """Publish a decision of the latch; earlier commands are discarded and do not resume after the release."""
        if decision is None:
            return
        if decision.halt:
            self._commands.discard()
            self._halt()
        self._publish_stop(decision.status)
        self._publish_remark(decision.remark)

    def _publish_remark(self, remark: str) -> None:
        if remark:
            self.remark.publish(String(remark))

    def _publish_stop(self, status: EmergencyStopStatus) -> None:
        self._stop_published = True
        self.stop_status.publish(status)
        self._own_stops.append(status.active)
        self.emergency_stop.publish(Bool(status.active))

    def on_process_lost(self, process: String) -> None:
        """Stop at once, without a ramp; navigation counts again when the process is back, teleoperation before."""
        self._commands.lose_process(process.data)
        self._halt()
        self.remark.publish(String(f"{process.data} does not respond; the robot stands until it is back."))

    def on_process_back(self, process: String) -> None:
        """Accept navigation again once no process is missing."""
        self._commands.restore_process(process.data)

    def on_cliff(self, reading: Range) -> None:
        """Stop at once, without a ramp, if the present motion leads over a cliff."""
        self._cliffs.process(reading)
        if self._v and self._cliffs.reason(self._v, self.now_ns):
            self._halt()

    @every(hz=COMMAND_RATE)
    def command(self) -> None:
        """Publish the next step of the velocity ramp, as far as it is safe."""
        now_ns, was_blind = self.now_ns, self._verdict.restriction is Restriction.CREEP
        self._own_stops.clear()  # messages come before timers, so none of them is on its way
        if self._judge_sensors().restriction is Restriction.CREEP and not was_blind:
            self._commands.interrupt(CommandSource.TELEOP, now_ns)
            self._limiter.reset()  # at once, without a ramp
        command = StampedCommand(0.0, 0.0, now_ns) if self._stop.active else self._commands.select(now_ns)
        self._publish_remark(self._cliffs.take_remark(command.v, now_ns))
        allowed = self._allowed_fraction(command)
        target = self._cliffs.limit(allowed * command.v, now_ns), allowed * command.w
        v, w = self._limiter.step(*target, command.age(now_ns), COMMAND_PERIOD)
        checked = self._checked(v, w)
        if checked.fraction < 1.0:
            v, w = checked.fraction * v, checked.fraction * w
            self._limiter.reset(v, w)
        self._explain(command, v, w, checked)
        self._publish_command(v, w)

    def _halt(self) -> None:
        self._limiter.reset()
        self._publish_command(0.0, 0.0)

    def _publish_command(self, v: float, w: float) -> None:
        self._v = v
        self.cmd_vel.publish(Twist.of(v, w))
        left, right = wheel_speeds(v, w, self.robot)
        self.wheel_speeds.publish(WheelSpeeds(Header.of(self.now_ns, "base_link"), left, right))
