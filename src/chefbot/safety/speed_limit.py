"""The speed limit of a slow zone, as a fraction of a command."""

from __future__ import annotations

from chefbot.msgs.nav2_msgs import SpeedLimit


def fraction_within(limit: SpeedLimit | None, v: float, max_speed: float) -> float:
    """Return the largest fraction of a forward speed v that keeps a limit; speeds in m/s, 0 for no limit."""
    if limit is None or limit.speed_limit <= 0.0:
        return 1.0
    speed = limit.speed_limit / 100.0 * max_speed if limit.percentage else limit.speed_limit
    return min(1.0, speed / abs(v)) if v else 1.0
