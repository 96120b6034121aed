"""The battery monitor: levels of the charge, learnt consumption, and sentences for the operator."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

from chefbot.battery.consumption import Consumption, ConsumptionEstimator, Window
from chefbot.battery.gauge import ChargeGauge, EnergyUse, Reading, Stored
from chefbot.battery.pack import BatteryPack
from chefbot.battery.params import BatteryParams

WINDOW_TIME = 300.0
"""Time of a window of the log with a measured current, s."""
CURRENT_DEVIATION = 0.02
"""Standard deviation of the energy by a measured current, as a share of it."""
DEEP_CHARGE, DEEP_SPAN = 0.35, 0.5
"""Measured charge at which a discharge ends as a window of the log, and its smallest span."""
DISCHARGE_DEVIATION, DOWNWARD_FACTOR = 0.15, 3.0
"""Standard deviation of the energy by a discharge, as a share of it: age and temperature of the day. It is larger for
one that seems to need less than is known: that may as well be a reading that lies high."""
VOLTAGE_FAULT_MARGIN = 0.8
"""Share of the energy that is planned with while the reading of the voltage is rejected."""


class BatteryLevel(Enum):
    """What the battery's charge allows the robot to do."""

    OK = "ok"
    WARN = "warn"
    RETURN = "return"
    PARK = "park"


ORDER = tuple(BatteryLevel)
SENTENCES = {
    BatteryLevel.OK: "Battery at {:.0f} %, for about {:.0f} m.",
    BatteryLevel.WARN: "Battery at {:.0f} %, for about {:.0f} m: charge it soon.",
    BatteryLevel.RETURN: "Battery at {:.0f} %, for about {:.0f} m: the robot goes home to be charged.",
    BatteryLevel.PARK: "Battery at {:.0f} %: only enough to park. Charge it.",
}


class BatteryAssessment(NamedTuple):
    """What is known of the battery: charge (0..1), energy to plan with (J), and why the voltage is rejected."""

    level: BatteryLevel
    charge: float
    energy: float
    consumption: Consumption
    voltage_fault: str
    description: str

    @property
    def range(self) -> float:
        """Distance that the energy is enough for, m."""
        return self.energy / self.consumption.driving


class BatteryMemory(NamedTuple):
    """What is kept on the disk: learnt consumption, charge, charge by voltage alone, and number of windows."""

    consumption: Consumption
    charge: float
    measured: float
    windows: int


class BatteryMonitor:
    """Estimates a battery pack's charge and consumption, and the level that follows from them.

    prior: consumption by the robot's sizing. log: what an earlier run has learnt. continued: whether the robot was
    switched on all the time since then.
    """

    def __init__(
        self,
        pack: BatteryPack,
        params: BatteryParams,
        prior: Consumption,
        log: BatteryMemory | None = None,
        *,
        continued: bool = False,
    ) -> None:
        self.params = params
        self._pack = pack
        self._estimator = ConsumptionEstimator(prior, log.consumption if log is not None else None)
        self._gauge = ChargeGauge(
            pack, Stored(log.charge, log.measured) if log is not None else None, continued=continued
        )
        self._windows = log.windows if log is not None else 0
        self._learnt_at = _LearntAt()
        self._level = BatteryLevel.OK

    @property
    def log(self) -> BatteryMemory:
        """What to keep on the disk."""
        measured = self._gauge.measured if math.isfinite(self._gauge.measured) else 1.0
        return BatteryMemory(self._estimator.value, self._gauge.charge, measured, self._windows)

    @property
    def assessment(self) -> BatteryAssessment:
        """What the battery allows now."""
        charge, fault, consumption = self._gauge.charge, self._gauge.voltage_fault, self._estimator.value
        energy = (
            max(0.0, charge - self.params.park) * self._pack.energy * (VOLTAGE_FAULT_MARGIN if fault else 1.0)
        )
        text = SENTENCES[self._level].format(100 * charge, energy / consumption.driving)
        return BatteryAssessment(self._level, charge, energy, consumption, fault, f"{text} {fault}".strip())

    def update(self, reading: Reading) -> None:
        """Process a reading; the times of the readings must not decrease."""
        self._gauge.update(reading, self._estimator.value)
        self._learn()
        self._level = self._next_level(self._gauge.charge)

    def _next_level(self, charge: float) -> BatteryLevel:
        """Return the level of a charge; a level ends only `hysteresis` above its share."""
        p = self.params
        shares = (p.warn, min(p.return_home, p.warn), min(p.park, p.return_home))
        reached = sum(charge < share for share in shares)
        kept = sum(charge < share + p.hysteresis for share in shares)
        return ORDER[max(reached, min(kept, ORDER.index(self._level)))]

    def _learn(self) -> None:
        """Learn from the log: every few minutes with a measured current, else once in a deep discharge."""
        gauge = self._gauge
        if gauge.anchors != self._learnt_at.anchors or gauge.is_frozen:
            self._learnt_at = _LearntAt(gauge.anchors, gauge.use, gauge.is_frozen)
        use = EnergyUse(*(now - then for now, then in zip(gauge.use[:], self._learnt_at.use[:], strict=True)))
        if math.isfinite(use.measured):
            if use.duration >= WINDOW_TIME:
                self._add(Window(*use, by_current=True), CURRENT_DEVIATION)
        elif not self._learnt_at.is_done and gauge.measured < DEEP_CHARGE and gauge.is_steady:
            span = gauge.anchor - gauge.measured
            if span >= DEEP_SPAN:
                learnt = Window(*use[:3], energy=span * self._pack.energy, by_current=False)
                is_less = learnt.energy < use.energy(self._estimator.value)
                self._add(learnt, DISCHARGE_DEVIATION * (DOWNWARD_FACTOR if is_less else 1.0))
            self._learnt_at = self._learnt_at._replace(is_done=True)

    def _add(self, window: Window, deviation: float) -> None:
        self._estimator.add(window, deviation * abs(window.energy))
        self._windows += 1
        self._learnt_at = _LearntAt(self._gauge.anchors, self._gauge.use, is_done=True)


class _LearntAt(NamedTuple):
    """Anchor and use at the end of the last window; `is_done`: the present discharge is not a window any more."""

    anchors: int = 0
    use: EnergyUse = EnergyUse()
    is_done: bool = False
