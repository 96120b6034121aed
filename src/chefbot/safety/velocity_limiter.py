"""Velocity and acceleration limiter for all commands to the base."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.robot.motion_limits import Limits


class VelocityLimiterParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the velocity limiter `VelocityLimiter`."""

    timeout: Annotated[
        float, Meta(ge=0.05, le=0.5, description="command timeout, s", extra={"safer": "smaller"})
    ] = 0.3


class VelocityLimiter:
    """Limits a twist in speed, turn rate, wheel speeds and acceleration; scaling keeps the curvature.

    A twist that slows down does so with the robot's deceleration, the one of a stop. The state `v`, `w` (m/s, rad/s)
    is the last output. The set of allowed twists is convex and the ramp is a straight line between two of them, so
    the output never leaves the set. `notice` is the reason why the last command was not followed, or "".
    """

    def __init__(self, limits: Limits, params: VelocityLimiterParams | None = None) -> None:
        self.limits = limits
        self.params = params or VelocityLimiterParams()
        self.notice = ""
        self.v = self.w = 0.0

    def step(self, v: float, w: float, age: float, dt: float) -> tuple[float, float]:
        """Return the twist (m/s, rad/s) for the next `dt` seconds; `age` is the age of the command in seconds."""
        v, w = self._target(v, w, age)
        limits = self.limits
        period = max(dt, 0.0) if math.isfinite(dt) else 0.0
        # the common fraction of the change that both axes allow; each stops before it reverses
        dv, fraction_v = _ramp(self.v, v, limits.acceleration * period, limits.deceleration * period)
        dw, fraction_w = _ramp(
            self.w, w, limits.angular_acceleration * period, limits.angular_deceleration * period
        )
        scale = min(fraction_v, fraction_w)
        self.v += scale * dv
        self.w += scale * dw
        return self.v, self.w

    def reset(self, v: float = 0.0, w: float = 0.0) -> None:
        """Continue the ramp from another twist (m/s, rad/s), by default from standstill."""
        self.v, self.w = v, w

    def _target(self, v: float, w: float, age: float) -> tuple[float, float]:
        self.notice = ""
        if not (math.isfinite(v) and math.isfinite(w)):
            self.notice = "the commanded twist is not a number"
        elif not age <= self.params.timeout:
            self.notice = f"the last command is older than {self.params.timeout} s"
        if self.notice:
            return 0.0, 0.0
        scale = self.limits.scale(v, w)
        if scale < 1.0:
            self.notice = f"the commanded twist is beyond the robot's limits and was scaled by {scale:.2f}"
        return v * scale, w * scale


def _ramp(now: float, target: float, max_increase: float, max_decrease: float) -> tuple[float, float]:
    """Return the change of a speed to its target, or to zero before it reverses, and the fraction of it that the
    maximum increase or decrease of its magnitude allows."""
    target = 0.0 if target * now < 0.0 else target
    change = target - now
    max_change = max_decrease if abs(target) < abs(now) else max_increase
    return change, max_change / abs(change) if abs(change) > max_change else 1.0
