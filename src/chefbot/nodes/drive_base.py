"""The one gate between everything that commands and the wheels."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.control.kinematics import wheel_speeds
from chefbot.msgs.chefbot_msgs import StopStatus, WheelSpeeds
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.sensor_msgs import Range
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.robot.motion_limits import Limits, max_acceleration
from chefbot.runtime.node import LIFE, In, Node, Out, every, last_words, topic
from chefbot.safety.velocity_limiter import Limiter, LimiterParams

RATE = 20.0
ECHO_TIMEOUT_NS = 300_000_000
"""An older echo says nothing of what is ahead now."""
CALM = 0.6
"""Share of the acceleration that this braking plans with."""
LET_GO_NS = 300_000_000
"""Silence after which a command is a new one."""
PRESSED = "STOP was pressed."
RELEASED = "STOP was released."
SAID_ELSEWHERE = "Somebody said STOP on emergency_stop."
STILL_STOPPED = "The base began anew; STOP was pressed before, and still is. Release it to drive."
NOT_KNOWN = "The base began anew and does not know whether it was stopped, so it is. Release STOP to drive."


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

    The state of STOP is this node's alone: all others ask by `stop_request`, and it tells everybody, late comers
    too, on `emergency_stop`, and why on `stop_status`. A STOP that somebody says on `emergency_stop` itself counts;
    to take one back there does not.
    """

    live_params = ("*",)
    params: BaseParams
    cmd_vel_teleop: In[Twist]
    cmd_vel_nav: In[Twist]
    stop_request: In[Bool]
    stop_elsewhere: In[Bool] = topic("emergency_stop")
    told_before: In[StopStatus] = last_words("stop_status")
    lived_before: In[Empty] = last_words(LIFE)
    process_lost: In[String]
    process_back: In[String]
    ultrasonic: In[Range]
    cmd_vel: Out[Twist]
    wheel_speeds: Out[WheelSpeeds]
    emergency_stop: Out[Bool] = topic(latched=True)
    stop_status: Out[StopStatus] = topic(latched=True)
    remark: Out[String] = topic("base/remark")

    def start(self) -> None:
        """Stand still."""
        self._limiter = Limiter(Limits.of(self.robot), self.params.limiter)
        self._person: Heard | None = None
        self._navigation: Heard | None = None
        self._stop = StopStatus()
        self._stop_is_told = False
        self._held_ns: dict[str, int] = {}
        self._missing: set[str] = set()
        self.spawn(self._begin())

    async def _begin(self) -> None:
        """Tell how it stands, once the life before, if there was one, has told it."""
        await self.sleep(0.0)
        if not self._stop_is_told:
            self._take_stop(self._stop)

    def reconfigure(self, params: BaseParams) -> None:
        """From the next command on."""
        self.params = params
        self._limiter.params = params.limiter

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """A person drives."""
        if not self._is_held_on("person", twist):
            self._person = self._heard(twist)

    def on_cmd_vel_nav(self, twist: Twist) -> None:
        """Navigation drives."""
        if not self._is_held_on("navigation", twist):
            self._navigation = self._heard(twist)

    def _is_held_on(self, who: str, twist: Twist) -> bool:
        """Whether it is said without a pause since STOP was pressed: who means it now lets go and says it again."""
        wants = bool(twist.linear.x or twist.angular.z)
        last_ns = self._held_ns.pop(who, None)
        held = wants and (self._stop.stopped or (last_ns is not None and self.now_ns - last_ns <= LET_GO_NS))
        if held:
            self._held_ns[who] = self.now_ns
        return held

    def on_told_before(self, status: StopStatus) -> None:
        """Who was stopped when the process died still is."""
        self._stop = status
        if status.stopped:
            self._still_stopped(STILL_STOPPED)

    def on_lived_before(self, _: Empty) -> None:
        """A robot that does not know stops."""
        if self.told_before.last is None:
            self._still_stopped(NOT_KNOWN)

    def on_stop_request(self, press: Bool) -> None:
        """A person, by a page or a button; again while it is pressed says nothing new."""
        if press.data != self._stop.stopped:
            self._change_stop(press.data, PRESSED if press.data else RELEASED)

    def on_stop_elsewhere(self, pressed: Bool) -> None:
        """Our own word, or that of somebody who does not know whose it is to say."""
        if pressed.data and not self._stop.stopped:
            self._change_stop(True, SAID_ELSEWHERE)
        elif not pressed.data and self._stop.stopped:
            self._take_stop(self._stop)  # whoever heard the other word hears ours after it

    def _still_stopped(self, sentence: str) -> None:
        self._change_stop(True, sentence)
        self.remark.publish(String(sentence))

    def _change_stop(self, stopped: bool, sentence: str) -> None:
        """Latched: what was commanded before it does not come back."""
        now = Header.of(self.now_ns, "base_link")
        pressed_at = now.stamp if stopped and not self._stop.stopped else self._stop.pressed_at
        if stopped:
            self._person = self._navigation = None
            self._limiter.reset()
            self._say(0.0, 0.0)
        self._take_stop(StopStatus(now, stopped, pressed_at, sentence))

    def _take_stop(self, status: StopStatus) -> None:
        self._stop, self._stop_is_told = status, True
        self.stop_status.publish(status)
        self.emergency_stop.publish(Bool(status.stopped))

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
        heard = None if self._stop.stopped else self._chosen()
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
        return math.sqrt(2.0 * CALM * max_acceleration(self.robot) * room)

    def _chosen(self) -> Heard | None:
        if self._person is not None and self._age(self._person) <= self.params.teleop_hold:
            return self._person
        return None if self._missing else self._navigation

    def _heard(self, twist: Twist) -> Heard:
        return Heard(twist.linear.x, twist.angular.z, self.now_ns)

    def _age(self, heard: Heard) -> float:
        return (self.now_ns - heard.time_ns) / 1e9
