"""Gamepad teleoperation with a dead-man button, as pure logic."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.robot.motion_limits import Limits

INITIAL_SHARE, MIN_SHARE = 0.5, 0.1
"""Initial and minimum fraction of the robot's speed limits."""
STEP = 1.1
"""Speed factor per press of the directional pad."""


AXIS = r"^((left|right|dpad)_[xy]|\d{1,3})$"
BUTTON = r"^(south|east|north|west|(left|right)_(shoulder|trigger)|select|start|mode|\d{1,3})$"
"""Names of the kernel's gamepad specification, or the number of an event."""


class GamepadParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Axes and buttons by their names, or by the number that `evtest` shows, for devices that are no gamepads."""

    forward_axis: Annotated[str, Meta(pattern=AXIS, description="axis to drive; up is negative")] = "left_y"
    turn_axis: Annotated[str, Meta(pattern=AXIS, description="axis to turn; left is negative")] = "left_x"
    speed_axis: Annotated[
        str, Meta(pattern=AXIS, description="directional pad: up is faster, down slower")
    ] = "dpad_y"
    dead_man_button: Annotated[str, Meta(pattern=BUTTON, description="held to drive: left shoulder")] = (
        "left_shoulder"
    )
    stop_button: Annotated[
        str, Meta(pattern=BUTTON, description="emergency stop: the red button, B or circle")
    ] = "east"
    dead_zone: Annotated[
        float, Meta(ge=0, le=0.5, description="fraction of the stick's range that counts as centred")
    ] = 0.1
    timeout: Annotated[
        float,
        Meta(
            ge=0.5,
            le=60,
            description="timeout without events after which a held button counts as released, s",
        ),
    ] = 5.0


class GamepadEvent(NamedTuple):
    """A change of a button (0, 1) or an axis (-1 to 1); `initial` marks its state when the gamepad was opened."""

    kind: Literal["axis", "button"]
    name: str
    value: float
    initial: bool = False


class GamepadTeleop:
    """Converts gamepad events to twists while the dead-man button is held.

    The button must have been seen released before a press counts. `share` is the fraction of the robot's speed
    limits at full deflection of the stick.
    """

    def __init__(self, limits: Limits, params: GamepadParams) -> None:
        self._limits, self._params = limits, params
        self.speed_fraction = INITIAL_SHARE
        self.reset()

    def reset(self) -> None:
        """Reset all buttons and axes when the gamepad is disconnected."""
        self._seen_released = self._pressed = False
        self._time_since_event = 0.0
        self._axes: dict[str, float] = {}

    def process_event(self, event: GamepadEvent) -> bool:
        """Process an event and return whether it requests an emergency stop."""
        self._time_since_event = 0.0
        params = self._params
        if event.kind == "axis":
            self._update_axis(event)
        elif event.name == params.dead_man_button:
            self._pressed = self._seen_released and bool(event.value) and not event.initial
            self._seen_released = not event.value
        return event.kind == "button" and event.name == params.stop_button and bool(event.value)

    @property
    def enabled(self) -> bool:
        """Whether the dead-man button is held."""
        return self._pressed

    def twist(self, dt: float) -> tuple[float, float] | None:
        """Return (v, w) in m/s and rad/s, `dt` seconds after the last call, or None if not enabled."""
        self._time_since_event += dt
        if self._time_since_event > self._params.timeout:
            self._pressed = False
        if not self._pressed:
            return None
        v = -self._stick(self._params.forward_axis) * self.speed_fraction * self._limits.speed
        w = -self._stick(self._params.turn_axis) * self.speed_fraction * self._limits.angular_speed
        scale = self._limits.scale(v, w)
        return v * scale, w * scale

    def _update_axis(self, event: GamepadEvent) -> None:
        previous = self._axes.get(event.name, 0.0)
        self._axes[event.name] = event.value
        pressed = event.name == self._params.speed_axis and not event.initial and abs(event.value) > 0.5
        if pressed and abs(previous) <= 0.5:
            share = self.speed_fraction * (STEP if event.value < 0.0 else 1.0 / STEP)
            self.speed_fraction = min(1.0, max(MIN_SHARE, share))

    def _stick(self, axis: str) -> float:
        """Return the deflection of an axis, rescaled to start at zero at the edge of the dead zone."""
        value, dead = self._axes.get(axis, 0.0), self._params.dead_zone
        magnitude = max(0.0, abs(value) - dead) / (1.0 - dead)
        return min(1.0, magnitude) if value > 0.0 else -min(1.0, magnitude)
