"""builtin_interfaces: time and duration."""

from __future__ import annotations

from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Int32, Message, Uint32

SECOND = 1_000_000_000


class Time(Message, frozen=True, eq=False):
    """A point in time, in seconds and nanoseconds."""

    BOUNDS = per_field(sec=(0, 2**31 - 1), nanosec=(0, SECOND - 1))

    sec: Int32 = 0
    nanosec: Uint32 = 0

    @property
    def ns(self) -> int:
        """The time as integer nanoseconds."""
        return self.sec * SECOND + self.nanosec

    @staticmethod
    def of(ns: int) -> Time:
        """Create a time from integer nanoseconds."""
        return Time(*divmod(ns, SECOND))


class Duration(Message, frozen=True, eq=False):
    """A time span, in seconds and nanoseconds."""

    BOUNDS = per_field(nanosec=(0, SECOND - 1))

    sec: Int32 = 0
    nanosec: Uint32 = 0

    @property
    def seconds(self) -> float:
        """The duration in seconds, as a float."""
        return self.sec + self.nanosec / SECOND

    @staticmethod
    def of(seconds: float) -> Duration:
        """Create a duration from seconds."""
        return Duration(*divmod(round(seconds * SECOND), SECOND))
