"""Speed limits of slow zones; the robot brakes before it enters one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from chefbot.maths.polygon import distance_ahead
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import MapZone
from chefbot.robot.motion_limits import Limits

BRAKING_FRACTION = 0.5
"""Fraction of the maximum acceleration with which the robot brakes before a slow zone."""
REACTION_TIME = 0.4
"""Time from the pose that a limit is made of to the wheels, s."""


class ZoneLimit(NamedTuple):
    """The present maximum speed, m/s, and the slow zone that sets it."""

    speed: float
    zone: MapZone


def zone_limit(zones: Iterable[MapZone], pose: SE2, limits: Limits) -> ZoneLimit | None:
    """Return the lowest limit of the slow zones at and ahead of a pose, whose yaw is the direction of motion.

    None if there is none below the robot's speed. At the distance d before a zone of speed v_z the limit is
    sqrt(v_z^2 + 2 a d), the speed from which planned braking ends at v_z.
    """
    found = (ZoneLimit(_allowed(zone, pose, limits), zone) for zone in zones)
    lowest = min(found, key=lambda limit: limit.speed, default=None)
    return lowest if lowest is not None and lowest.speed < limits.speed else None


def _allowed(zone: MapZone, pose: SE2, limits: Limits) -> float:
    ahead = max(distance_ahead(zone.array, pose) - REACTION_TIME * limits.speed, 0.0)
    return math.sqrt(zone.speed**2 + 2.0 * BRAKING_FRACTION * limits.acceleration * ahead)
