"""The drive base: command multiplexer, emergency stop and velocity limits in front of the wheels."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.control.kinematics import wheel_speeds
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, WheelSpeeds
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.sensor_msgs import Range
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.robot.motion_limits import Limits, max_acceleration
from chefbot.runtime.node import RESTARTED, In, Node, Out, every, restored, topic
from chefbot.safety.velocity_limiter import VelocityLimiter, VelocityLimiterParams

RATE = 20.0
ECHO_TIMEOUT_NS = 300_000_000
"""Maximum age of an echo of the ultrasonic ranger, ns."""
PLANNED_BRAKING_FRACTION = 0.6
"""Fraction of the maximum acceleration that braking before the ultrasonic ranger's obstacle plans with."""
RELEASE_TIMEOUT_NS = 300_000_000
"""Pause after which a command counts as a new one, ns."""
PRESSED = "Emergency stop was pressed."
RELEASED = "Emergency stop was released."
PRESSED_BY_TOPIC = "Emergency stop was published on emergency_stop by another node."
ESTOP_RESTORED = "Drive base restarted; emergency stop is still active. Release it to drive."
ESTOP_STATE_UNKNOWN = "Drive base restarted with an unknown emergency stop state: emergency stop is active. Release it to drive."


class DriveBaseParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the velocity limiter, the teleop priority and the ultrasonic safety margin."""

    limiter: VelocityLimiterParams = VelocityLimiterParams()
    teleop_hold: Annotated[
        float,
        Meta(ge=0, le=10, description="time after the last teleop command before navigation is accepted, s"),
    ] = 1.0
    ultrasonic_margin: Annotated[
        float, Meta(ge=0, le=1, description="safety margin to obstacles of the ultrasonic ranger, m")
    ] = 0.04


class StampedCommand(NamedTuple):
    """A commanded twist (m/s, rad/s) with its time of reception."""

    v: float
    w: float
    time_ns: int


class DriveBaseNode(Node):
    """Converts twists to wheel speeds: teleop overrides navigation, the emergency stop overrides both.

    Velocity limits and ramps apply to all. `cmd_vel` is the twist actually commanded. A command that is not repeated
    is a stop.

    This node alone owns the state of the emergency stop: others request a change on `stop_request`, and the node
    publishes the state on `emergency_stop` and the reason on `stop_status`, both transient local. A stop published
    on `emergency_stop` by another node counts; a release published there does not.
    """

    live_params = ("*",)
    params: DriveBaseParams
    cmd_vel_teleop: In[Twist]
    cmd_vel_nav: In[Twist]
    stop_request: In[Bool]
    external_stop: In[Bool] = topic("emergency_stop")
    restored_status: In[EmergencyStopStatus] = restored("stop_status")
    restarted: In[Empty] = restored(RESTARTED)
    process_lost: In[String]
    process_back: In[String]
    ultrasonic: In[Range]
    cmd_vel: Out[Twist]
    wheel_speeds: Out[WheelSpeeds]
    emergency_stop: Out[Bool] = topic(latched=True)
    stop_status: Out[EmergencyStopStatus] = topic(latched=True)
    remark: Out[String] = topic("base/remark")

    def start(self) -> None:
        """Start at standstill and publish the state of the emergency stop."""
        self._limiter = VelocityLimiter(Limits.of(self.robot), self.params.limiter)
        self._teleop: StampedCommand | None = None
        self._navigation: StampedCommand | None = None
        self._stop = EmergencyStopStatus()
        self._stop_published = False
        self._refused_ns: dict[str, int] = {}
        self._lost_processes: set[str] = set()
        self.spawn(self._publish_initial_stop())

    async def _publish_initial_stop(self) -> None:
        """Publish the initial emergency stop state, unless a state restored after a restart was published before."""
        await self.sleep(0.0)
        if not self._stop_published:
            self._publish_stop(self._stop)

    def reconfigure(self, params: DriveBaseParams) -> None:
        """Apply new parameters from the next command on."""
        self.params = params
        self._limiter.params = params.limiter

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """Accept a twist from teleoperation."""
        if not self._held_since_estop("person", twist):
            self._teleop = self._stamped(twist)

    def on_cmd_vel_nav(self, twist: Twist) -> None:
        """Accept a twist from navigation."""
        if not self._held_since_estop("navigation", twist):
            self._navigation = self._stamped(twist)

    def _held_since_estop(self, source: str, twist: Twist) -> bool:
        """Return whether a source has commanded motion without a pause since the emergency stop.

        After the release a command counts only once its source has paused for RELEASE_TIMEOUT_NS.
        """
        moving = bool(twist.linear.x or twist.angular.z)
        last_ns = self._refused_ns.pop(source, None)
        held = moving and (
            self._stop.active or (last_ns is not None and self.now_ns - last_ns <= RELEASE_TIMEOUT_NS)
        )
        if held:
            self._refused_ns[source] = self.now_ns
        return held

    def on_restored_status(self, status: EmergencyStopStatus) -> None:
        """Restore an active emergency stop after a restart."""
        self._stop = status
        if status.active:
            self._restore_stop(ESTOP_RESTORED)

    def on_restarted(self, _: Empty) -> None:
        """Activate the emergency stop after a restart if its state could not be restored."""
        if self.restored_status.last is None:
            self._restore_stop(ESTOP_STATE_UNKNOWN)

    def on_stop_request(self, request: Bool) -> None:
        """Press or release the emergency stop on request; repeated requests have no effect."""
        if request.data != self._stop.active:
            self._set_stop(request.data, PRESSED if request.data else RELEASED)

    def on_external_stop(self, pressed: Bool) -> None:
        """Process `emergency_stop`: this node's own message or that of another publisher."""
        if pressed.data and not self._stop.active:
            self._set_stop(True, PRESSED_BY_TOPIC)
        elif not pressed.data and self._stop.active:
            self._publish_stop(self._stop)  # overrides the other publisher's message at all subscribers

    def _restore_stop(self, sentence: str) -> None:
        self._set_stop(True, sentence)
        self.remark.publish(String(sentence))

    def _set_stop(self, stopped: bool, sentence: str) -> None:
        """Change the emergency stop state; earlier commands are discarded and do not resume after the release."""
        now = Header.of(self.now_ns, "base_link")
        pressed_at = now.stamp if stopped and not self._stop.active else self._stop.pressed_at
        if stopped:
            self._teleop = self._navigation = None
            self._limiter.reset()
            self._publish_command(0.0, 0.0)
        self._publish_stop(EmergencyStopStatus(now, stopped, pressed_at, sentence))

    def _publish_stop(self, status: EmergencyStopStatus) -> None:
        self._stop, self._stop_published = status, True
        self.stop_status.publish(status)
        self.emergency_stop.publish(Bool(status.active))

    def on_process_lost(self, process: String) -> None:
        """Stop at once, without a ramp, when a process of the launch is lost.

        Navigation commands count again when the process is back; teleoperation is possible before.
        """
        self._lost_processes.add(process.data)
        self._teleop = self._navigation = None
        self._limiter.reset()
        self._publish_command(0.0, 0.0)

    def on_process_back(self, process: String) -> None:
        """Accept navigation again once no process is missing."""
        self._lost_processes.discard(process.data)

    @every(hz=RATE)
    def command(self) -> None:
        """Publish the next step of the velocity ramp."""
        command = None if self._stop.active else self._select_command()
        v, w, age = (0.0, 0.0, 0.0) if command is None else (command.v, command.w, self._age(command))
        v, w = self._limiter.step(min(v, self._safe_speed()), w, age, 1.0 / RATE)
        self._publish_command(v, w)

    def _publish_command(self, v: float, w: float) -> None:
        self.cmd_vel.publish(Twist.of(v, w))
        left, right = wheel_speeds(v, w, self.robot)
        self.wheel_speeds.publish(WheelSpeeds(Header.of(self.now_ns, "base_link"), left, right))

    def _safe_speed(self) -> float:
        """Return the forward speed (m/s) from which the robot stops before the ultrasonic ranger's obstacle.

        The depth camera does not see what is that near.
        """
        sonar, echo = self.robot.sensors.ultrasonic, self.ultrasonic.last
        if sonar is None or echo is None or self.now_ns - echo.header.stamp.ns > ECHO_TIMEOUT_NS:
            return math.inf
        sonar_to_edge = self.robot.footprint_radius - sonar.mount.x
        free_distance = max(0.0, echo.range - sonar_to_edge - self.params.ultrasonic_margin)
        return math.sqrt(2.0 * PLANNED_BRAKING_FRACTION * max_acceleration(self.robot) * free_distance)

    def _select_command(self) -> StampedCommand | None:
        if self._teleop is not None and self._age(self._teleop) <= self.params.teleop_hold:
            return self._teleop
        return None if self._lost_processes else self._navigation

    def _stamped(self, twist: Twist) -> StampedCommand:
        return StampedCommand(twist.linear.x, twist.angular.z, self.now_ns)

    def _age(self, command: StampedCommand) -> float:
        return (self.now_ns - command.time_ns) / 1e9
