"""Energy per second of standing and per metre of driving, learnt from the robot's own log.

Ageing and cold appear as a higher consumption: energies are measured in charge of the pack as its voltage shows it,
times the energy of the new pack.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

STANDING_STD, DRIVING_STD = 0.3, 0.5
"""Standard deviations of the prior as shares of it: the electronics are known better than the floor."""
STANDING_BOUNDS, DRIVING_BOUNDS = (0.5, 3.0), (0.2, 5.0)
"""Smallest and largest learnt values as multiples of the prior."""
LOWEST_BY_VOLTAGE = 1.0
"""Smallest learnt value as a multiple of the prior without a measured current: the voltage of most chemistries is
flat over most of the charge, and that must not look like a robot that needs little."""
DRIFT = 0.01
"""Standard deviation of the change from one window to the next, as a share: floor, age and temperature change."""
TIME_MEMORY = 50.0
"""Metres after which half of the time per metre is that of the log."""
TIME_BOUNDS = (0.5, 5.0)


class Consumption(NamedTuple):
    """What standing (W, the electronics, always drawn) and driving (J per metre in addition) cost.

    seconds_per_metre: time that a metre takes on average, turns included.
    """

    standing: float
    per_metre: float
    seconds_per_metre: float

    def energy(self, distance: float, standing: float = 0.0) -> float:
        """Return the energy (J) to drive a distance (m) and to stand for a time (s)."""
        return self.driving * distance + self.standing * standing

    @property
    def driving(self) -> float:
        """Energy of a metre with all that is drawn meanwhile, J."""
        return self.per_metre + self.standing * self.seconds_per_metre

    @property
    def driving_power(self) -> float:
        """Power drawn while driving, W."""
        return self.standing + self.per_metre / self.seconds_per_metre


class Window(NamedTuple):
    """A part of the log: its duration and the time in motion (s), the distance driven (m), and the energy used (J).

    by_current: whether the energy was measured by the current, not by the fall of the voltage.
    """

    duration: float
    moving: float
    distance: float
    energy: float
    by_current: bool


class ConsumptionEstimator:
    """Recursive least squares on windows of the log: energy = standing * duration + per_metre * distance.

    A window by voltage has to be nearly a whole discharge, because the voltage does not fall evenly.

    prior: from the robot's sizing. learnt: values of an earlier run.
    """

    def __init__(self, prior: Consumption, learnt: Consumption | None = None) -> None:
        self._prior = prior
        self.value = bounded(learnt, prior) if learnt is not None else prior
        start = np.array([STANDING_STD * prior.standing, DRIVING_STD * prior.per_metre])
        self._covariance = np.diag((start * (0.3 if learnt is not None else 1.0)) ** 2)

    def add(self, window: Window, deviation: float) -> None:
        """Add a window; `deviation` is the standard deviation of its energy, J."""
        estimate = np.array([self.value.standing, self.value.per_metre])
        covariance = self._covariance + np.diag((DRIFT * estimate) ** 2)
        # Kalman gain of one scalar measurement: K = P h / (h' P h + r)
        h = np.array([window.duration, window.distance])
        gain = covariance @ h / (h @ covariance @ h + deviation**2)
        standing, per_metre = (estimate + gain * (window.energy - h @ estimate)).tolist()
        self._covariance = covariance - np.outer(gain, h @ covariance)
        learnt = Consumption(standing, per_metre, self._time_per_metre(window))
        self.value = bounded(learnt, self._prior, 0.0 if window.by_current else LOWEST_BY_VOLTAGE)

    def _time_per_metre(self, window: Window) -> float:
        if window.distance <= 0.0:
            return self.value.seconds_per_metre
        share = window.distance / (window.distance + TIME_MEMORY)
        return self.value.seconds_per_metre * (1.0 - share) + share * window.moving / window.distance


def bounded(value: Consumption, prior: Consumption, lowest: float = 0.0) -> Consumption:
    """Return the consumption within plausible multiples of the prior; powers at least `lowest` times the prior."""

    def within(number: float, base: float, bounds: tuple[float, float]) -> float:
        return min(bounds[1] * base, max(bounds[0] * base, number))

    value = value._replace(
        standing=max(value.standing, lowest * prior.standing),
        per_metre=max(value.per_metre, lowest * prior.per_metre),
    )

    return Consumption(
        within(value.standing, prior.standing, STANDING_BOUNDS),
        within(value.per_metre, prior.per_metre, DRIVING_BOUNDS),
        within(value.seconds_per_metre, prior.seconds_per_metre, TIME_BOUNDS),
    )
