"""When a round reaches its stops, by the lengths of its legs and the time that people take."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from chefbot.delivery.params import DeliveryParams
from chefbot.msgs.chefbot_msgs import BatteryStatus, DeliveryStatus, RoundStop

NEWEST_SHARE = 0.3
"""Share of the newest stop in the average time of a stop."""
PRIOR_LENGTH, MEMORY = 10.0, 100.0
"""Distance that the prior counts for, and distance after which a drive counts half, m."""


class StopTimes:
    """The time that people take to load and to take their food: the owner's timers, else the average so far, s."""

    def __init__(self, params: DeliveryParams) -> None:
        self.params = params
        self._average: dict[str, float] = {}
        self._state, self._since = "", 0.0

    def update(self, status: DeliveryStatus, now: float) -> None:
        """Process a status at a time (s): a stop ends when its state does."""
        state = "" if status.hold_reason else status.state
        if state == self._state:
            return
        if self._state in ("loading", "waiting"):
            taken = now - self._since
            average = self._average.get(self._state, taken)
            self._average[self._state] = average + NEWEST_SHARE * (taken - average)
        self._state, self._since = state, now

    def expected(self, *, at_kitchen: bool) -> float:
        """Return the expected time of a stop in the kitchen or at a table, s."""
        timer = self.params.loading_timeout if at_kitchen else self.params.pickup_timeout
        return timer or self._average.get("loading" if at_kitchen else "waiting", self.params.stop_time)

    def rest(self, now: float) -> float:
        """Return the expected rest of the present stop, s; 0 while the robot drives."""
        if self._state not in ("loading", "waiting", "unloading"):
            return 0.0
        return max(0.0, self.expected(at_kitchen=self._state == "loading") - (now - self._since))


class DriveTimes:
    """The time of a metre between two stops, with turns, waits for people and arrival, from the drives so far.

    prior: time of a metre before the first drive, s.
    """

    def __init__(self, prior: float) -> None:
        self._time, self._length = prior * PRIOR_LENGTH, PRIOR_LENGTH
        self._begun: tuple[float, float] | None = None

    @property
    def seconds_per_metre(self) -> float:
        """Average time of a metre, s."""
        return self._time / self._length

    def begin(self, length: float, now: float) -> None:
        """Process the begin of a drive over a length (m, inf if that is not known) at a time (s)."""
        self._begun = None if math.isinf(length) else (length, now)

    def end(self, now: float, *, arrived: bool) -> None:
        """Process the end of a drive; one that was interrupted does not count."""
        if arrived and self._begun is not None:
            length, begun = self._begun
            share = 0.5 ** (length / MEMORY)
            self._length = share * self._length + length
            self._time = share * self._time + now - begun
        self._begun = None


class Pace(NamedTuple):
    """Time of a metre, s, and the battery with the energy of its full charge, J; None without a battery monitor."""

    seconds_per_metre: float
    battery: BatteryStatus | None
    full_energy: float

    def charge_after(self, distance: float, time: float) -> float:
        """Return the charge (0..1) after a distance (m) driven in a time (s); -1 without a battery monitor."""
        if self.battery is None:
            return -1.0
        used = self.battery.standing_power * time + self.battery.energy_per_metre * distance
        return max(0.0, self.battery.charge - used / self.full_energy)


def forecast_stops(
    stops: Sequence[str], legs: Sequence[float], begin: float, stays: Sequence[float], pace: Pace
) -> tuple[RoundStop, ...]:
    """Return the forecast of each stop.

    legs: length of the path to each stop from the reachable one before, m; inf where there is none.
    begin: time before the first leg, s. stays: time at each stop, s.
    """
    distance, time = 0.0, begin
    forecast: list[RoundStop] = []
    for place, leg, stay in zip(stops, legs, stays, strict=True):
        if math.isinf(leg):
            forecast.append(RoundStop(place, reachable=False))
            continue
        distance += leg
        time += leg * pace.seconds_per_metre
        forecast.append(RoundStop(place, distance, time, pace.charge_after(distance, time)))
        time += stay
    return tuple(forecast)
