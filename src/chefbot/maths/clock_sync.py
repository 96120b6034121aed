"""Clock synchronization: maps the board's microsecond counter to the computer's clock."""

from __future__ import annotations

from chefbot.maths.counter_unwrap import wrap_signed

WINDOW_NS = 1_000_000_000
"""Window of the minimum filter, ns; at least one line per window arrives with hardly any delay."""


class ClockSync:
    """Stamps lines with the time at which the board measured, not at which the computer read them.

    The clock offset (computer minus board) is the recent minimum of receive time minus board time, as a delay
    can only increase it (Cristian 1989, "Probabilistic clock synchronization": the message with the minimum
    delay has the most information). Once a second it follows the minimum delay of that second, to compensate
    for clock drift.

    Stamps never decrease: after a line with a smaller delay than all before, the next stamps advance at half
    the board's rate until they agree with the offset. A speed calculated from two of them is then at most
    twice too high.
    """

    def __init__(self, t_us: int, received_ns: int) -> None:
        """Initialize the clock offset from the first line, received at `received_ns`."""
        self._offset_ns = received_ns - t_us * 1000
        self._window_ns, self._min_delay_ns = received_ns, 0
        self._last_us, self._last_ns = t_us, received_ns

    def unwrap(self, t_us: int, received_ns: int) -> int:
        """Return the microseconds since power-on: the value congruent to the 32-bit counter that is nearest
        to the expected one."""
        expected = (received_ns - self._offset_ns) // 1000
        return expected + wrap_signed(t_us - expected)

    def delay_ns(self, full_us: int, received_ns: int) -> int:
        """Return the delay of a line relative to the minimum delay, ns; negative for an even smaller delay."""
        return received_ns - self._offset_ns - full_us * 1000

    def stamp(self, full_us: int, received_ns: int) -> int:
        """Return the stamp of a line on the computer's clock, ns, not before earlier stamps, and update the
        clock offset."""
        self._update_offset(full_us, received_ns)
        # Monotonic stamps: advance by at least half of the board's elapsed time.
        min_advance_ns = (full_us - self._last_us) * 500
        self._last_ns = max(self._offset_ns + full_us * 1000, self._last_ns + min_advance_ns)
        self._last_us = full_us
        return self._last_ns

    def _update_offset(self, full_us: int, received_ns: int) -> None:
        # Minimum filter over a window: at its end the offset grows by the minimum delay in it.
        delay = self.delay_ns(full_us, received_ns)
        if received_ns - self._window_ns > WINDOW_NS:
            self._offset_ns += max(self._min_delay_ns, 0)
            delay = self.delay_ns(full_us, received_ns)
            self._window_ns, self._min_delay_ns = received_ns, delay
        self._min_delay_ns = min(self._min_delay_ns, delay)
        # A line with a smaller delay lowers the offset at once.
        if delay < 0:
            self._offset_ns += delay
            self._min_delay_ns = 0
