"""Sensor fault detection: the health of each source of motion readings."""

from __future__ import annotations

from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.odometry.motion_model import Array

STUCK_READINGS = 5
"""Number of consecutive bit-identical readings that makes a source suspect; with noise above the sensor's
last digit that is rarer than one in ten thousand."""


class Source(Enum):
    """The source of a motion reading."""

    WHEELS = "wheels"
    GYRO = "gyro"
    ACCELEROMETER = "accelerometer"
    ATTITUDE = "attitude"


IMU_SOURCES = (Source.GYRO, Source.ACCELEROMETER, Source.ATTITUDE)
GYRO, ACCELEROMETER, ATTITUDE = range(len(IMU_SOURCES))
"""Indices of `IMU_SOURCES` among the records of their monitors."""


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


FAULTS = (Condition.FRESH, Condition.STUCK, Condition.SATURATED, Condition.REVERSED)
"""Conditions of a source by its last readings alone."""
NO_FAULT, STUCK, SATURATED, REVERSED = range(len(FAULTS))
"""Codes of `FAULTS` in the records."""
NEVER_NS = int(np.iinfo(np.int64).min)
"""Stamp in a record of something that has not happened yet."""

Record = Any
"""An element of an array of records."""
Records = NDArray[np.void]
MONITOR = np.dtype(
    [
        ("last_ns", np.int64),
        ("used_ns", np.int64),
        ("value", np.float64, 3),
        ("repeats", np.int64),
        ("expected_change", np.float64),
        ("mirrored", np.int64),
        ("refused", np.int64),
        ("refused_run", np.int64),
        ("fault", np.int64),
    ]
)
"""Record of a `SensorMonitor`."""


class SensorMonitor(NamedTuple):
    """A fault monitor for one source.

    `expected_change` accumulates the motion of the wheels since the readings repeat, which a working sensor
    would show.
    """

    last_ns: int | None
    """Stamp of the last reading, used or not."""
    used_ns: int | None
    """Stamp of the last reading that was used."""
    value: tuple[float, ...]
    """The last reading; NaN before the first, and always for the wheels, whose counts may repeat."""
    repeats: int
    """Readings before the last one that were equal to it."""
    expected_change: float
    mirrored: int
    """Surplus of readings with the wrong sign over those with the right one."""
    refused: int
    """Number of readings that were damaged or outside the gate."""
    refused_run: int
    """Number of consecutive refused readings up to the last one."""
    fault: Condition
    """Fault by the last readings: stuck, saturated or reversed; FRESH for none."""

    @classmethod
    def of_wheels(cls, last_ns: int | None) -> SensorMonitor:
        """Return the monitor of the wheels, all of whose readings are used."""
        return cls.of(new_monitors()[0])._replace(last_ns=last_ns, used_ns=last_ns)

    @classmethod
    def of(cls, record: Record) -> SensorMonitor:
        """Return the monitor that a record holds."""
        last_ns, used_ns, value, repeats, expected_change, mirrored, refused, run, fault = record.item()
        last, used = (None if stamp == NEVER_NS else stamp for stamp in (last_ns, used_ns))
        counts = repeats, expected_change, mirrored, refused, run
        return cls(last, used, tuple(value.tolist()), *counts, FAULTS[fault])


def new_monitors() -> Records:
    """Return the monitors (3,) of `IMU_SOURCES` before the first reading."""
    monitors = np.zeros(len(IMU_SOURCES), MONITOR)
    monitors["last_ns"] = monitors["used_ns"] = NEVER_NS
    monitors["value"] = np.nan
    return monitors


@njit(cache=True, nogil=True)
def note_reading(monitor: Record, stamp_ns: int, value: Array, enough: float) -> None:
    """Note a reading with its value (3,) in the monitor's record.

    The source is stuck when `STUCK_READINGS` are bit-identical although a change above `enough` was expected.
    """
    monitor["last_ns"] = stamp_ns
    if not _is_repeated(monitor["value"], value):
        monitor["value"][:] = value
        monitor["repeats"], monitor["expected_change"], monitor["fault"] = 0, 0.0, NO_FAULT
        return
    stuck = monitor["repeats"] + 2 >= STUCK_READINGS and abs(monitor["expected_change"]) > enough
    monitor["fault"] = STUCK if stuck or monitor["fault"] == STUCK else NO_FAULT
    monitor["repeats"] += 1


@njit(cache=True, nogil=True)
def _is_repeated(before: Array, value: Array) -> bool:
    """Return whether two readings are equal; NaN, which is damaged and not stuck, equals nothing."""
    for i in range(before.size):  # noqa: SIM110 (a generator in a kernel)
        if before[i] != value[i]:
            return False
    return True


@njit(cache=True, nogil=True)
def note_use(monitor: Record) -> None:
    """Note that the last reading was used in the estimate."""
    monitor["used_ns"], monitor["refused_run"] = monitor["last_ns"], 0


@njit(cache=True, nogil=True)
def note_rejection(monitor: Record) -> None:
    """Note that the last reading was rejected, for a fault or as an outlier."""
    monitor["refused"] += 1
    monitor["refused_run"] += 1


@njit(cache=True, nogil=True)
def note_fault(monitor: Record, fault: int) -> None:
    """Note that the last reading was rejected for a fault, as a code of `FAULTS`."""
    note_rejection(monitor)
    monitor["fault"] = fault
