"""The speed limit of a slow zone, as a fraction of a command."""

from __future__ import annotations

from chefbot.msgs.nav2_msgs import SpeedLimit

LOWEST = 0.02
"""Limit, m/s, below which the robot stands: a slower one looks like a robot that is stuck."""


def fraction_within(limit: SpeedLimit | None, v: float, max_speed: float) -> float:
    """Return the largest fraction of a forward speed v that keeps a limit; speeds in m/s, 0 for no limit."""
    if limit is None or limit.speed_limit <= 0.0:
        return 1.0
    return min(1.0, _limited_speed(limit, max_speed) / abs(v)) if v else 1.0


def too_slow_reason(limit: SpeedLimit | None, max_speed: float) -> str:
    """Return why a robot that reaches max_speed, m/s, must stand because of its limit; or an empty string."""
    if limit is None or limit.speed_limit <= 0.0 or _limited_speed(limit, max_speed) >= LOWEST:
        return ""
    return f"The speed limit of {1000.0 * _limited_speed(limit, max_speed):.1f} mm/s is too low to drive."


def _limited_speed(limit: SpeedLimit, max_speed: float) -> float:
    return limit.speed_limit / 100.0 * max_speed if limit.percentage else limit.speed_limit
