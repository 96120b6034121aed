"""The board's microseconds on the computer's clock."""

from __future__ import annotations

from chefbot.board.counter_unwrap import signed

WINDOW_NS = 1_000_000_000
"""In each such time at least one line comes with hardly a delay."""


class BoardTime:
    """Stamps for lines: when the board measured, not when the computer got round to reading.

    Computer minus board is the least that it ever was lately: a delay only ever adds (Cristian 1989,
    "Probabilistic clock synchronization": the message with the least delay tells most). Once a second it
    follows the least delay of that second, as quartzes drift.

    Stamps never run backwards: where a line comes that was quicker than all before, the next ones follow at half
    the board's pace until they are right. A speed worked out from two of them is then at most twice too high.
    """

    def __init__(self, t_us: int, heard_ns: int) -> None:
        """From the first line."""
        self._offset_ns = heard_ns - t_us * 1000
        self._window_ns, self._least_ns = heard_ns, 0
        self._last_us, self._last_ns = t_us, heard_ns

    def unwrap(self, t_us: int, heard_ns: int) -> int:
        """Microseconds since power-on, not wrapped: the value of the 32 bits nearest to what is expected."""
        expected = (heard_ns - self._offset_ns) // 1000
        return expected + signed(t_us - expected)

    def late_ns(self, full_us: int, heard_ns: int) -> int:
        """How much later than the quickest line it came; negative: quicker."""
        return heard_ns - self._offset_ns - full_us * 1000

    def stamp(self, full_us: int, heard_ns: int) -> int:
        """Nanoseconds on the computer's clock, after all earlier ones; learns from the line."""
        self._learn(full_us, heard_ns)
        pace = (full_us - self._last_us) * 500
        self._last_ns = max(self._offset_ns + full_us * 1000, self._last_ns + pace)
        self._last_us = full_us
        return self._last_ns

    def _learn(self, full_us: int, heard_ns: int) -> None:
        late = self.late_ns(full_us, heard_ns)
        if heard_ns - self._window_ns > WINDOW_NS:
            self._offset_ns += max(self._least_ns, 0)
            late = self.late_ns(full_us, heard_ns)
            self._window_ns, self._least_ns = heard_ns, late
        self._least_ns = min(self._least_ns, late)
        if late < 0:
            self._offset_ns += late
            self._least_ns = 0
