"""Whether the battery is enough for a route and its stops."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from chefbot.msgs.chefbot_msgs import BatteryStatus
from chefbot.msgs.geometry_msgs import PoseStamped

MARGIN = 1.3
"""Factor on the energy of a route: people to wait for, detours, retries."""
Stop = str | PoseStamped
"""A place by its name on the map, or a pose."""
Length = Callable[[tuple[Stop, ...]], float]
"""Returns the length of the route from the robot over all stops, m; NaN where that is not known."""


class PlannedRoute(NamedTuple):
    """The route from the robot over all stops, the last of them home, and at how many of them it waits for people.

    A sum is one after the other without the drive home between them.
    """

    stops: tuple[Stop, ...]
    waits: int

    def __add__(self, other: PlannedRoute) -> PlannedRoute:  # type: ignore[override]
        return PlannedRoute(self.stops[:-1] + other.stops, self.waits + other.waits)


class EnergyForecast:
    """Compares routes with the latest status of the battery; without a battery monitor everything suffices.

    length: of routes from the robot. stop_time: time that people take at a stop on average, s.
    """

    def __init__(self, length: Length, stop_time: float) -> None:
        self.length, self.stop_time = length, stop_time
        self.battery: BatteryStatus | None = None

    @property
    def is_low(self) -> bool:
        """Whether the robot has to go home to be charged."""
        return self.battery is not None and self.battery.level in ("return", "park")

    def reach(self, waits: int = 0, margin: float = MARGIN) -> float:
        """Return the distance that the energy is enough for, m, with a number of stops."""
        if self.battery is None:
            return math.inf
        battery = self.battery
        standing = battery.standing_power * self.stop_time * waits
        per_metre = battery.energy_per_metre + battery.standing_power * battery.seconds_per_metre
        return max(0.0, (battery.energy / margin - standing) / max(per_metre, 1e-9))

    def suffices(self, route: PlannedRoute, margin: float = MARGIN) -> bool:
        """Return whether the energy is enough; True where the length is not known."""
        if self.battery is None:
            return True
        length = self.length(route.stops)
        return math.isnan(length) or length <= self.reach(route.waits, margin)
