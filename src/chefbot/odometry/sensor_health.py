"""Is a sensor to be believed? What each source of readings shows of its own health."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

STUCK_READINGS = 5
"""So many equal to the last bit, one after the other; with a sensor's noise over its last digit that is rarer
than one in ten thousand."""


class Source(Enum):
    """Who tells of motion."""

    WHEELS = "wheels"
    GYRO = "gyro"
    ACCELEROMETER = "accelerometer"
    ATTITUDE = "attitude"
    SCANS = "scan matching"


class Condition(Enum):
    """How a source is."""

    FRESH = "fresh"
    LATE = "late"
    SATURATED = "saturated"
    REVERSED = "reversed"
    STUCK = "stuck"
    LOST = "lost"
    ABSENT = "absent"
    """It has never said anything."""


class Watch(NamedTuple):
    """One source. `stir` sums what the wheels did since its readings are equal, and a live sensor would tell."""

    last_ns: int | None = None
    """Stamp of the last reading, used or not."""
    used_ns: int | None = None
    """Stamp of the last reading that was used."""
    value: tuple[float, ...] = ()
    repeats: int = 0
    """Readings before the last one that were equal to it."""
    stir: float = 0.0
    mirrored: int = 0
    """How many more turns it told with the wrong sign than with the right one."""
    refused: int = 0
    """Readings so far that were damaged or beyond belief."""
    refused_run: int = 0
    """How many of these were the last ones, one after the other."""
    flaw: Condition = Condition.FRESH
    """Stuck, saturated or reversed, by what it said last."""

    @property
    def repeating(self) -> bool:
        """Whether the last two readings were equal to the last bit."""
        return self.repeats > 0

    def stirred(self, amount: float) -> Watch:
        """Something happened that its readings have to show; sign and units are the source's own."""
        return self._replace(stir=self.stir + amount)

    def heard(self, stamp_ns: int, value: tuple[float, ...], enough: float) -> Watch:
        """A reading came; it is stuck when `STUCK_READINGS` are equal though it was stirred by `enough`."""
        if value != self.value:  # so does a NaN, which is damaged, not stuck
            return self._replace(last_ns=stamp_ns, value=value, repeats=0, stir=0.0, flaw=Condition.FRESH)
        stuck = self.repeats + 2 >= STUCK_READINGS and abs(self.stir) > enough
        flaw = Condition.STUCK if stuck or self.flaw is Condition.STUCK else Condition.FRESH
        return self._replace(last_ns=stamp_ns, repeats=self.repeats + 1, flaw=flaw)

    def used(self) -> Watch:
        """The last reading went into the estimate."""
        return self._replace(used_ns=self.last_ns, refused_run=0)

    def left_out(self, flaw: Condition | None = None) -> Watch:
        """The last reading did not go into the estimate, for `flaw` or as an outlier."""
        run = self.refused_run + 1
        return self._replace(refused=self.refused + 1, refused_run=run, flaw=flaw or self.flaw)
