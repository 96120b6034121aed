"""The one gate between everything that commands and the wheels."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.control.kinematics import wheel_speeds
from chefbot.control.limiter import Limiter, LimiterParams
from chefbot.control.limits import Limits
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.sensor_msgs import Range
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.runtime.node import In, Node, Out, every

RATE = 20.0
ECHO_TIMEOUT_NS = 300_000_000
"""An older echo says nothing of what is ahead now."""
CALM = 0.6
"""Share of the acceleration that this braking plans with."""


class BaseParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How long a person's hand on the controls keeps navigation off."""

    limiter: LimiterParams = LimiterParams()
    teleop_hold: Annotated[
        float, Meta(ge=0, le=10, description="navigation waits so long after the last key or joystick, s")
    ] = 1.0
    ultrasonic_margin: Annotated[
        float, Meta(ge=0, le=1, description="it stops so far before what the ultrasonic ranger sees ahead, m")
    ] = 0.04


class Heard(NamedTuple):
    """A command and when it came."""

    v: float
    w: float
    time_ns: int


class BaseNode(Node):
    """Twists to wheel speeds: a person before navigation, STOP before both, limits and ramps behind all.

    `cmd_vel` tells what was really commanded. A command that is not repeated is a stop.
    """

    live_params = ("*",)
    params: BaseParams
    cmd_vel_teleop: In[Twist]
    cmd_vel_nav: In[Twist]
    emergency_stop: In[Bool]
    process_lost: In[String]
    process_back: In[String]
    ultrasonic: In[Range]
    cmd_vel: Out[Twist]
    wheel_speeds: Out[WheelSpeeds]

    def start(self) -> None:
        """Stand still."""
        self._limiter = Limiter(Limits.of(self.robot), self.params.limiter)
        self._person: Heard | None = None
        self._navigation: Heard | None = None
        self._stopped = False
        self._missing: set[str] = set()

    def reconfigure(self, params: BaseParams) -> None:
        """From the next command on."""
        self.params = params
        self._limiter.params = params.limiter

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """A person drives."""
        self._person = self._heard(twist)

    def on_cmd_vel_nav(self, twist: Twist) -> None:
        """Navigation drives."""
        self._navigation = self._heard(twist)

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Latched: what was commanded before it does not come back."""
        self._stopped = pressed.data
        if pressed.data:
            self._person = self._navigation = None
            self._limiter.reset()

    def on_process_lost(self, process: String) -> None:
        """Nobody thinks about what it did any more: stand, at once and without a ramp.

        Navigation counts again when the process is back; a person may drive before.
        """
        self._missing.add(process.data)
        self._person = self._navigation = None
        self._limiter.reset()
        self._say(0.0, 0.0)

    def on_process_back(self, process: String) -> None:
        """All of it is there."""
        self._missing.discard(process.data)

    @every(hz=RATE)
    def command(self) -> None:
        """The next step of the ramp."""
        heard = None if self._stopped else self._chosen()
        v, w, age = (0.0, 0.0, 0.0) if heard is None else (heard.v, heard.w, self._age(heard))
        v, w = self._limiter.step(min(v, self._safe_speed()), w, age, 1.0 / RATE)
        self._say(v, w)

    def _say(self, v: float, w: float) -> None:
        self.cmd_vel.publish(Twist.of(v, w))
        left, right = wheel_speeds(v, w, self.robot)
        radius = self.robot.wheel_radius
        self.wheel_speeds.publish(
            WheelSpeeds(Header.of(self.now_ns, "base_link"), left * radius, right * radius)
        )

    def _safe_speed(self) -> float:
        """Forward speed from which it stops before what the ranger sees: the camera is blind to what is near."""
        sonar, echo = self.robot.sensors.ultrasonic, self.ultrasonic.last
        if sonar is None or echo is None or self.now_ns - echo.header.stamp.ns > ECHO_TIMEOUT_NS:
            return math.inf
        to_rim = self.robot.footprint_radius - sonar.mount.x
        room = max(0.0, echo.range - to_rim - self.params.ultrasonic_margin)
        return math.sqrt(2.0 * CALM * self.robot.max_acceleration * room)

    def _chosen(self) -> Heard | None:
        if self._person is not None and self._age(self._person) <= self.params.teleop_hold:
            return self._person
        return None if self._missing else self._navigation

    def _heard(self, twist: Twist) -> Heard:
        return Heard(twist.linear.x, twist.angular.z, self.now_ns)

    def _age(self, heard: Heard) -> float:
        return (self.now_ns - heard.time_ns) / 1e9
