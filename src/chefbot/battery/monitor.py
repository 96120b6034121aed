"""The battery monitor: levels of the charge, learnt consumption, and sentences for the operator."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from chefbot.battery.consumption import Consumption, ConsumptionEstimator, Window
from chefbot.battery.gauge import ChargeGauge, Reading
from chefbot.battery.pack import BatteryPack
from chefbot.battery.params import BatteryParams

WINDOW_TIME, LONGEST_WINDOW = 300.0, 1800.0
"""Time of a window of the log, s: it ends while the robot stands, or after the longest time."""
WINDOW_DEVIATION = 0.004
"""Standard deviation of the charge used in a window, as a share: the voltage under another load at its ends."""
DOUBT_MARGIN = 0.8
"""Share of the energy that is planned with while the reading is doubted."""


class BatteryLevel(Enum):
    """What the charge allows."""

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
    """What is known of the battery: charge (0..1), energy to plan with (J), and why a reading is doubted."""

    level: BatteryLevel
    charge: float
    energy: float
    consumption: Consumption
    doubt: str
    description: str

    @property
    def range(self) -> float:
        """Way that the energy is enough for, m."""
        return self.energy / self.consumption.driving


class BatteryMemory(NamedTuple):
    """What is kept on the disk: the learnt consumption, the charge, and the number of windows learnt from."""

    consumption: Consumption
    charge: float
    windows: int


class BatteryMonitor:
    """Watches a pack.

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
        self._gauge = ChargeGauge(pack, log.charge if log is not None else None, continued=continued)
        self._windows = log.windows if log is not None else 0
        self._window = _OpenWindow()
        self._level = BatteryLevel.OK

    @property
    def log(self) -> BatteryMemory:
        """What to keep on the disk."""
        return BatteryMemory(self._estimator.value, self._gauge.charge, self._windows)

    @property
    def assessment(self) -> BatteryAssessment:
        """What the battery allows now."""
        charge, doubt, consumption = self._gauge.charge, self._gauge.doubt, self._estimator.value
        energy = max(0.0, charge - self.params.park) * self._pack.energy * (DOUBT_MARGIN if doubt else 1.0)
        text = SENTENCES[self._level].format(100 * charge, energy / consumption.driving)
        return BatteryAssessment(self._level, charge, energy, consumption, doubt, f"{text} {doubt}".strip())

    def update(self, reading: Reading) -> None:
        """Process a reading; the times of the readings must not decrease."""
        self._gauge.update(reading, self._estimator.value)
        self._learn(reading)
        self._level = self._next_level(self._gauge.charge)

    def _next_level(self, charge: float) -> BatteryLevel:
        """Return the level of a charge; a level ends only `hysteresis` above its share."""
        p = self.params
        shares = (p.warn, min(p.return_home, p.warn), min(p.park, p.return_home))
        reached = sum(charge < share for share in shares)
        kept = sum(charge < share + p.hysteresis for share in shares)
        return ORDER[max(reached, min(kept, ORDER.index(self._level)))]

    def _learn(self, reading: Reading) -> None:
        """Add the reading to the window of the log, and learn from the window once it ends."""
        window, gauge = self._window, self._gauge
        if gauge.doubt or gauge.anchors != window.anchors:
            self._window = _OpenWindow(gauge.measured, reading.time, 0.0, 0.0, gauge.anchors)
            return
        window = self._window = window.after(reading)
        duration = reading.time - window.start
        if duration < WINDOW_TIME or not (gauge.is_standing or duration >= LONGEST_WINDOW):
            return
        used = window.charge - gauge.measured
        if used > 0.0:
            learnt = Window(duration, window.moving, window.distance, used * self._pack.energy)
            self._estimator.add(learnt, WINDOW_DEVIATION * self._pack.energy)
            self._windows += 1
        self._window = _OpenWindow(gauge.measured, reading.time, 0.0, 0.0, gauge.anchors)


class _OpenWindow(NamedTuple):
    """A window of the log that has not ended: measured charge and time of its start, way, time in motion."""

    charge: float = 0.0
    start: float = 0.0
    distance: float = 0.0
    moving: float = 0.0
    anchors: int = 0

    def after(self, reading: Reading) -> _OpenWindow:
        """Return the window with another reading."""
        return self._replace(distance=self.distance + reading.distance, moving=self.moving + reading.moving)
