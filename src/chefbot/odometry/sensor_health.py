"""Sensor fault detection: the health of each source of motion readings."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

STUCK_READINGS = 5
"""Number of consecutive bit-identical readings that makes a source suspect; with noise above the sensor's
last digit that is rarer than one in ten thousand."""


class Source(Enum):
    """The source of a motion reading."""

    WHEELS = "wheels"
    GYRO = "gyro"
    ACCELEROMETER = "accelerometer"
    ATTITUDE = "attitude"


class Condition(Enum):
    """The condition of a source of readings."""

    FRESH = "fresh"
    LATE = "late"
    SATURATED = "saturated"
    REVERSED = "reversed"
    STUCK = "stuck"
    LOST = "lost"
    ABSENT = "absent"
    """No reading has been received yet."""


class SensorMonitor(NamedTuple):
    """A fault monitor for one source.

    `expected_change` accumulates the motion of the wheels since the readings repeat, which a working sensor
    would show.
    """

    last_ns: int | None = None
    """Stamp of the last reading, used or not."""
    used_ns: int | None = None
    """Stamp of the last reading that was used."""
    value: tuple[float, ...] = ()
    repeats: int = 0
    """Readings before the last one that were equal to it."""
    expected_change: float = 0.0
    mirrored: int = 0
    """Surplus of readings with the wrong sign over those with the right one."""
    refused: int = 0
    """Number of readings that were damaged or outside the gate."""
    refused_run: int = 0
    """Number of consecutive refused readings up to the last one."""
    fault: Condition = Condition.FRESH
    """Fault by the last readings: stuck, saturated or reversed; FRESH for none."""

    @property
    def repeating(self) -> bool:
        """Whether the last two readings were bit-identical."""
        return self.repeats > 0

    def with_expected_change(self, amount: float) -> SensorMonitor:
        """Return the monitor with a change added that the readings must show, in sign and unit of the
        source."""
        return self._replace(expected_change=self.expected_change + amount)

    def with_reading(self, stamp_ns: int, value: tuple[float, ...], enough: float) -> SensorMonitor:
        """Return the monitor after a reading.

        The source is stuck when `STUCK_READINGS` are bit-identical although a change above `enough` was
        expected.
        """
        if value != self.value:  # true for NaN, which is damaged, not stuck
            return self._replace(
                last_ns=stamp_ns, value=value, repeats=0, expected_change=0.0, fault=Condition.FRESH
            )
        stuck = self.repeats + 2 >= STUCK_READINGS and abs(self.expected_change) > enough
        flaw = Condition.STUCK if stuck or self.fault is Condition.STUCK else Condition.FRESH
        return self._replace(last_ns=stamp_ns, repeats=self.repeats + 1, fault=flaw)

    def used(self) -> SensorMonitor:
        """Return the monitor with the last reading used in the estimate."""
        return self._replace(used_ns=self.last_ns, refused_run=0)

    def with_rejected(self, flaw: Condition | None = None) -> SensorMonitor:
        """Return the monitor with the last reading rejected, for a fault or as an outlier."""
        run = self.refused_run + 1
        return self._replace(refused=self.refused + 1, refused_run=run, fault=flaw or self.fault)
