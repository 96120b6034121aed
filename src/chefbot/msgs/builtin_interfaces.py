"""builtin_interfaces: time."""

from __future__ import annotations

from chefbot.msgs.idl.message import Int32, Message, Uint32

SECOND = 1_000_000_000


class Time(Message, frozen=True, eq=False):
    """A point in time: seconds and nanoseconds."""

    sec: Int32 = 0
    nanosec: Uint32 = 0

    @property
    def ns(self) -> int:
        """Nanoseconds as one integer."""
        return self.sec * SECOND + self.nanosec

    @staticmethod
    def of(ns: int) -> Time:
        """From integer nanoseconds."""
        return Time(*divmod(ns, SECOND))


class Duration(Message, frozen=True, eq=False):
    """A span of time."""

    sec: Int32 = 0
    nanosec: Uint32 = 0

    @property
    def seconds(self) -> float:
        """As a float."""
        return self.sec + self.nanosec / SECOND

    @staticmethod
    def of(seconds: float) -> Duration:
        """From seconds."""
        return Duration(*divmod(round(seconds * SECOND), SECOND))
