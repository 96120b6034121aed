"""The one gate between everything that commands and the base."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.robot.motion_limits import Limits


class LimiterParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of `Limiter`."""

    timeout: Annotated[float, Meta(ge=0.05, le=0.5, description="a command older than this is a stop, s")] = (
        0.3
    )


class Limiter:
    """Clamps a twist to speed, turn, rims and acceleration; scaling keeps the curvature.

    The state is the twist it gave last. The set of allowed twists is convex and so is the ramp between two
    of them: what it gives never leaves the set. `remark` says why the last command was not followed, "" if
    it was.
    """

    def __init__(self, limits: Limits, params: LimiterParams | None = None) -> None:
        self.limits = limits
        self.params = params or LimiterParams()
        self.remark = ""
        self._v = self._w = 0.0

    def step(self, v: float, w: float, age: float, dt: float) -> tuple[float, float]:
        """The twist (m/s, rad/s) for the next `dt` seconds; `age` seconds is how old the command is."""
        v, w = self._target(v, w, age)
        top = self.limits
        room = max(dt, 0.0) if math.isfinite(dt) else 0.0
        dv, dw = v - self._v, w - self._w
        part = min(1.0, _ratio(top.acceleration * room, dv), _ratio(top.turn_acceleration * room, dw))
        self._v += part * dv
        self._w += part * dw
        return self._v, self._w

    def reset(self) -> None:
        """The base stands: forget the ramp."""
        self._v = self._w = 0.0

    def _target(self, v: float, w: float, age: float) -> tuple[float, float]:
        self.remark = ""
        if not (math.isfinite(v) and math.isfinite(w)):
            self.remark = "the commanded twist is not a number"
        elif not age <= self.params.timeout:
            self.remark = f"the last command is older than {self.params.timeout} s"
        if self.remark:
            return 0.0, 0.0
        part = self.limits.scale(v, w)
        if part < 1.0:
            self.remark = f"the commanded twist is beyond the robot's limits and was scaled by {part:.2f}"
        return v * part, w * part


def _ratio(room: float, change: float) -> float:
    return room / abs(change) if abs(change) > room else 1.0
