"""State of charge from voltage and use, and the fault where the two contradict each other.

Two estimates run side by side: `measured`, from the voltage under load, and `counted`, the charge at the last
anchor less what was used since. The charge is the smaller one, so a reading that lies high cannot lengthen a drive,
and a weak pack is accepted at once. A reading that rises is accepted only of a robot that stands, and only as a
charger raises it. A pack is changed while the board is off: after a pause of the readings they count again.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from chefbot.battery.consumption import Consumption
from chefbot.battery.pack import BatteryPack

SMOOTHING_TIME, QUICK_TIME = 20.0, 5.0
"""Time constants of the measured charge and of its rises, s. The second is much shorter than STANDING_TIME, so that
the tail of a jump does not look like charging."""
CONTRADICTION = 0.1
"""Difference between measured and counted charge that is named."""
MAX_STEP = 0.04
"""Largest rise in a minute, as a share, of a pack that is being charged (2.4 C)."""
MIN_STEP = 0.002
"""Smallest rise in a minute of a pack that is being charged (0.12 C)."""
MAX_STEADY_CHANGE = 0.04
"""Largest change in STANDING_TIME, as a share, by use alone."""
POWER_OFF_TIME = 10.0
"""Time without a reading from which the board may have been without power, and its pack changed, s."""
STANDING_TIME, RELAXATION_TIME = 180.0, 60.0
"""Time that a robot has to stand before a rise is accepted, s, and its first part, in which the voltage recovers from
the load of the drive and nothing is concluded from it."""
STANDING_DISTANCE = 0.02
"""Distance driven in that time up to which a robot stands, m: noise of the odometry."""
FROZEN_USE = 0.015
"""Share of the charge that is used while the voltage shows the same number, from which it is frozen."""
VERIFIED_USE = 0.03
"""Fall of the measured charge from which a new anchor is confirmed."""
MAX_RATE = 20.0
"""Largest power that is accepted, as a multiple of what empties the pack in an hour."""
COUNT_MARGIN = 1.1
"""Factor on the counted use: a count drifts, and a flat voltage cannot correct it."""
UNKNOWN_CHARGE = 0.5
"""Charge that a robot assumes whose very first reading is frozen."""

NO_READING = "The battery's voltage is not measured; its charge is counted."
FROZEN = "The battery's voltage does not change although energy is used; the reading is not used."
TOO_HIGH = "The battery's reading rose to {:.0f} % without being charged; {:.0f} % is assumed."
TOO_LOW = "The battery's voltage is lower than its use explains ({:.0f} %, not {:.0f} %): it is weak or cold."


class Reading(NamedTuple):
    """A measurement: time (s), voltage (V), current drawn (A, NaN where not measured).

    distance: driven since the last reading, m. moving: time in motion since then, s. charging: reported by the board.
    """

    time: float
    voltage: float
    current: float
    distance: float
    moving: float
    charging: bool = False


class Stored(NamedTuple):
    """What is known of an earlier run: the charge, and that by the voltage alone."""

    charge: float
    measured: float


class Anchor(NamedTuple):
    """Charge from which the use is counted, and the charge that was assumed before it; None if none was."""

    charge: float
    before: float | None


class ChargeGauge:
    """Estimates the charge, 0..1, of a pack.

    stored: of an earlier run. continued: whether the robot was switched on all the time since then, so that
    its pack cannot have been changed.
    """

    def __init__(self, pack: BatteryPack, stored: Stored | None = None, *, continued: bool = False) -> None:
        self._pack, self._stored, self._continued = pack, stored, continued
        self._anchor: Anchor | None = None
        self._used = EnergyUse()
        self.measured = math.nan
        """Charge by the voltage, smoothed; NaN before the first reading."""
        self._quick = math.nan
        self._last: Reading | None = None
        self._recent = _RecentCharge()
        self._has_risen = False
        self._distance = 0.0
        self._frozen = EnergyUse()
        self.is_frozen = False
        self._consumption = Consumption(0.0, 0.0, 1.0)
        self.anchors = 0
        """Number of anchors so far."""

    @property
    def charge(self) -> float:
        """Charge above the firmware's stop, 0..1; 0 before the first reading."""
        if self._anchor is None:
            return 0.0
        estimates = [self.counted, self.measured]
        if self.is_frozen:
            before = self._anchor.before
            estimates.append((UNKNOWN_CHARGE if before is None else before) - COUNT_MARGIN * self._share())
        return max(0.0, min(estimate for estimate in estimates if math.isfinite(estimate)))

    @property
    def counted(self) -> float:
        """Charge at the anchor less the use since, with a margin, by the consumption as it is known now."""
        return (self._anchor.charge if self._anchor else 0.0) - COUNT_MARGIN * self._share()

    @property
    def voltage_fault(self) -> str:
        """Why the reading of the voltage is rejected, or an empty string."""
        if self._anchor is None or self._last is None or not self._pack.is_possible(self._last.voltage):
            return NO_READING
        if self.is_frozen:
            return FROZEN
        excess = self.measured - self.counted
        if excess > CONTRADICTION and self._has_risen:
            return TOO_HIGH.format(100 * self.measured, 100 * self.charge)
        return TOO_LOW.format(100 * self.measured, 100 * self.counted) if -excess > CONTRADICTION else ""

    @property
    def use(self) -> EnergyUse:
        """What was used since the last anchor."""
        return self._used

    @property
    def anchor(self) -> float:
        """Charge from which the use is counted."""
        return self._anchor.charge if self._anchor is not None else math.nan

    @property
    def is_steady(self) -> bool:
        """Whether the measured charge has not jumped lately."""
        return abs(self._recent.rise) <= MAX_STEADY_CHANGE

    @property
    def is_standing(self) -> bool:
        """Whether the robot has stood for STANDING_TIME."""
        return self._recent.is_full and self._recent.distance <= STANDING_DISTANCE

    def update(self, reading: Reading, consumption: Consumption) -> None:
        """Process a reading with the consumption as it is known now."""
        self._consumption = consumption
        previous, self._last = self._last, reading
        duration = max(0.0, reading.time - previous.time) if previous is not None else 0.0
        use = EnergyUse(duration, reading.moving, reading.distance, self._energy(reading, duration))
        self._used = self._used + use
        if not self._pack.is_possible(reading.voltage):
            return
        share = self._measured_share(reading, duration)
        paused = duration > POWER_OFF_TIME and reading.distance <= STANDING_DISTANCE
        if paused and abs(share - self.measured) > CONTRADICTION and self._anchor is not None:
            self.measured = self._quick = share
            self._set_anchor(share, self.counted)
            self._recent.restart()
        self.measured = _smoothed(self.measured, share, duration / SMOOTHING_TIME)
        self._quick = _smoothed(self._quick, share, duration / QUICK_TIME)
        if self._anchor is None:
            self._set_first_anchor()
        self._check_frozen(reading, previous, use)
        self._distance += reading.distance
        self._recent.add(reading.time, self._distance, self._quick)
        self._check_charging(reading)
        self._confirm()

    def _measured_share(self, reading: Reading, duration: float) -> float:
        known = self._consumption
        power = known.standing + (known.per_metre * reading.distance / duration if duration > 0.0 else 0.0)
        if math.isfinite(reading.current):
            power = reading.current * reading.voltage
        return self._pack.charge_share(reading.voltage, power, known.driving_power)

    def _energy(self, reading: Reading, duration: float) -> float:
        """Return the measured energy since the last reading, J; NaN where the current is not measured or absurd."""
        power = reading.voltage * reading.current
        return power * duration if abs(power) <= MAX_RATE * self._pack.energy / 3600.0 else math.nan

    def _share(self) -> float:
        """Share of the charge that was used since the anchor."""
        return self._used.energy(self._consumption) / self._pack.energy

    def _set_anchor(self, charge: float, before: float | None) -> None:
        self._anchor, self._used = Anchor(charge, before), EnergyUse()
        self.anchors += 1

    def _set_first_anchor(self) -> None:
        """Begin with the reading, or with the stored charge if the reading has not risen since: a flat voltage shows
        the same for many charges."""
        stored = self._stored
        if stored is None:
            self._set_anchor(self.measured, None)
        elif self._continued or not self.measured > stored.measured + CONTRADICTION:
            self._set_anchor(min(stored.charge, self.measured), stored.charge)
        else:
            self._set_anchor(self.measured, stored.charge)

    def _check_frozen(self, reading: Reading, previous: Reading | None, use: EnergyUse) -> None:
        """Note whether the very same voltage lasts while charge is used."""
        same = previous is not None and reading.voltage == previous.voltage
        self._frozen = self._frozen + use if same else EnergyUse()
        used = self._frozen.energy(self._consumption) / self._pack.energy
        self.is_frozen = used > FROZEN_USE or (self.is_frozen and same)

    def _check_charging(self, reading: Reading) -> None:
        """Believe a rise of a robot that stands if it is as a charger or a new pack makes it."""
        rise, excess = self._recent.rise_per_minute, self.measured - self.counted
        self._has_risen = self._recent.rise > 3.0 * MAX_STEP or (
            self._has_risen and excess > 0.5 * CONTRADICTION
        )
        if self.is_frozen or excess <= 0.0 or not self.is_standing:
            return
        if MIN_STEP <= rise <= MAX_STEP or reading.charging:
            self._set_anchor(self.measured, self.counted)

    def _confirm(self) -> None:
        """Forget what was assumed before the anchor once the reading has fallen as the use explains."""
        anchor = self._anchor
        if anchor is not None and not self.is_frozen and anchor.charge - self.measured > VERIFIED_USE:
            self._anchor = Anchor(anchor.charge, anchor.charge)


class EnergyUse(NamedTuple):
    """Time and time in motion (s), distance driven (m), measured energy (J; NaN where no current is measured)."""

    duration: float = 0.0
    moving: float = 0.0
    distance: float = 0.0
    measured: float = 0.0

    def __add__(self, other: EnergyUse) -> EnergyUse:  # type: ignore[override]
        return EnergyUse(*(a + b for a, b in zip(self[:], other[:], strict=True)))

    def energy(self, consumption: Consumption) -> float:
        """Return the energy, J: measured where it is, else as the consumption has it."""
        if math.isfinite(self.measured):
            return self.measured
        return consumption.standing * self.duration + consumption.per_metre * self.distance


class _RecentCharge:
    """Distance driven and measured charge of the last STANDING_TIME seconds."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float, float]] = deque()

    @property
    def rise_per_minute(self) -> float:
        """Mean rise since the voltage has recovered from the drive, per minute."""
        begin = self._samples[0][0] + RELAXATION_TIME
        settled = [sample for sample in self._samples if sample[0] >= begin]
        if len(settled) < 2 or not self.is_full:
            return 0.0
        return 60.0 * (settled[-1][2] - settled[0][2]) / (settled[-1][0] - settled[0][0])

    def add(self, time: float, distance: float, charge: float) -> None:
        """Add a sample and drop those that are too old."""
        self._samples.append((time, distance, charge))
        while len(self._samples) > 2 and time - self._samples[1][0] >= STANDING_TIME:
            self._samples.popleft()

    def restart(self) -> None:
        """Begin again after a pause."""
        self._samples.clear()

    @property
    def is_full(self) -> bool:
        """Whether the samples span the whole time."""
        return len(self._samples) > 1 and self._samples[-1][0] - self._samples[0][0] >= STANDING_TIME

    @property
    def distance(self) -> float:
        """Distance driven between the first and the last sample, m."""
        return self._samples[-1][1] - self._samples[0][1]

    @property
    def rise(self) -> float:
        """Rise of the measured charge between the first and the last sample."""
        return self._samples[-1][2] - self._samples[0][2] if self._samples else 0.0


def _smoothed(value: float, new: float, share: float) -> float:
    """Return an exponentially smoothed value; the first one is taken as it is."""
    return new if math.isnan(value) else value + (new - value) * min(1.0, share)
