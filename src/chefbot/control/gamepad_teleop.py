"""Driving with a gamepad: a dead-man button and a stick to twists, as pure logic."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.robot.motion_limits import Limits

START, LEAST = 0.5, 0.1
"""Share of the robot's limits that a session begins with, and the smallest."""
STEP = 1.1
"""Factor of a press on the cross."""


class GamepadParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which stick and buttons, as `jstest` numbers them; the defaults fit pads of the Xbox and PlayStation kind."""

    forward_axis: Annotated[int, Meta(ge=0, le=63, description="axis to drive; up is negative")] = 1
    turn_axis: Annotated[int, Meta(ge=0, le=63, description="axis to turn; left is negative")] = 0
    speed_axis: Annotated[int, Meta(ge=0, le=63, description="cross: up is faster, down slower")] = 7
    dead_man_button: Annotated[int, Meta(ge=0, le=63, description="held to drive: left shoulder")] = 4
    stop_button: Annotated[int, Meta(ge=0, le=63, description="STOP: the red one, B or circle")] = 1
    dead_zone: Annotated[
        float, Meta(ge=0, le=0.5, description="of the stick's way, where it counts as centred")
    ] = 0.1
    patience: Annotated[
        float,
        Meta(ge=0.5, le=60, description="without a sign of life a held button counts as let go, s"),
    ] = 5.0


class PadEvent(NamedTuple):
    """A button (0, 1) or an axis (-1 to 1) that has changed; `initial`: how it stood when the pad was found."""

    kind: Literal["axis", "button"]
    number: int
    value: float
    initial: bool = False


class GamepadDrive:
    """Nothing drives unless the dead-man button was seen up and is then pressed and held.

    `share` is what the stick's end asks for of the robot's limits.
    """

    def __init__(self, limits: Limits, params: GamepadParams) -> None:
        self._limits, self._params = limits, params
        self.share = START
        self.forget()

    def forget(self) -> None:
        """The pad is gone: whatever was held is held no more."""
        self._ready = self._held = False
        self._silent = 0.0
        self._axes: dict[int, float] = {}

    def hear(self, event: PadEvent) -> bool:
        """Take it in; True if it asks for STOP."""
        self._silent = 0.0
        params = self._params
        if event.kind == "axis":
            self._hear_axis(event)
        elif event.number == params.dead_man_button:
            self._held = self._ready and bool(event.value) and not event.initial
            self._ready = not event.value
        return event.kind == "button" and event.number == params.stop_button and bool(event.value)

    @property
    def held(self) -> bool:
        """Whether a person holds the robot."""
        return self._held

    def twist(self, dt: float) -> tuple[float, float] | None:
        """m/s and rad/s, `dt` seconds after the last call; None where nobody drives."""
        self._silent += dt
        if self._silent > self._params.patience:
            self._held = False
        if not self._held:
            return None
        v = -self._stick(self._params.forward_axis) * self.share * self._limits.speed
        w = -self._stick(self._params.turn_axis) * self.share * self._limits.turn
        part = self._limits.scale(v, w)
        return v * part, w * part

    def _hear_axis(self, event: PadEvent) -> None:
        before = self._axes.get(event.number, 0.0)
        self._axes[event.number] = event.value
        pressed = event.number == self._params.speed_axis and not event.initial and abs(event.value) > 0.5
        if pressed and abs(before) <= 0.5:
            wanted = self.share * (STEP if event.value < 0.0 else 1.0 / STEP)
            self.share = min(1.0, max(LEAST, wanted))

    def _stick(self, axis: int) -> float:
        """From the edge of the dead zone on, so that it does not jump there."""
        value, dead = self._axes.get(axis, 0.0), self._params.dead_zone
        way = max(0.0, abs(value) - dead) / (1.0 - dead)
        return min(1.0, way) if value > 0.0 else -min(1.0, way)
