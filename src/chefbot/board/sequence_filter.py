"""Sequence filter: accepts each line once and in order; detects duplicates, old lines and restarts of the
board."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.board.messages import BoardLine, TimedLine
from chefbot.maths.clock_sync import ClockSync

MIN_DELAY_NS, MAX_DELAY_NS = -250_000_000, 5_000_000_000
"""Limits of a line's delay on the clock model, ns; outside, it is from another run of the board or damaged."""
SEQUENCE_VALID_NS = 60_000_000_000
"""Maximum silence after which sequence numbers are compared, ns; the board sends fewer than 2^15 lines in
twice this time."""
MAX_LINE_PERIOD_US = 20_000
"""Maximum time between two numbered lines of the board, us; its motion lines alone are sent at 50 Hz."""

MIN_CONFIRMATIONS, MIN_CONFIRMATIONS_IN_TIME = 2, 20
"""Consecutive lines that confirm a restart; more where their time fits the current run, for then they are far
more likely duplicates or out of order."""


class ReceivedLine(NamedTuple):
    """An accepted line with its time stamp."""

    line: BoardLine
    stamp_ns: int
    """Time of the measurement on the computer's clock, ns; for `v`, the time of reception."""
    board_time_us: int
    """The board's time without wraparound, us; for `v`, that of the line before it."""
    restarted: bool
    """Whether this is the first accepted line after a restart of the board: its counters have started again."""


class BoardRun:
    """One run of the board, from power-on to the next restart."""

    def __init__(self, line: BoardLine, received_ns: int) -> None:
        self._sequence, self._received_ns = line.sequence, received_ns
        self._time = ClockSync(line.t, received_ns) if isinstance(line, TimedLine) else None
        self._board_us = line.t if isinstance(line, TimedLine) else 0
        self.lost = 0
        """Number of lines missing according to the sequence numbers."""
        self.accepted = 1

    def continues_with(self, line: BoardLine, received_ns: int) -> bool:
        """Return whether the line is a later one of this run."""
        # Serial number arithmetic modulo 2^16: a later line is less than half the range ahead.
        ahead = (line.sequence - self._sequence) % 65536
        if received_ns - self._received_ns < SEQUENCE_VALID_NS and not 0 < ahead < 32768:
            return False
        if not isinstance(line, TimedLine) or self._time is None:
            return True
        full_us = self._time.unwrap(line.t, received_ns)
        is_later = full_us >= self._board_us
        return is_later and self._plausible(full_us, received_ns, explained_us=ahead * MAX_LINE_PERIOD_US)

    def in_time(self, line: BoardLine, received_ns: int) -> bool:
        """Return whether the line's time is plausible on this run's clock."""
        if not isinstance(line, TimedLine) or self._time is None:
            return False
        return self._plausible(self._time.unwrap(line.t, received_ns), received_ns, explained_us=0)

    def _plausible(self, full_us: int, received_ns: int, explained_us: int) -> bool:
        """Return whether a line of that time of the board is plausible on this run's clock.

        A line may be further ahead of its time if no more than `explained_us` passed on the board since the
        line before: where that one was read late and many behind it were lost.
        """
        assert self._time is not None
        # Delay against the clock model of this run.
        late_ns = self._time.delay_ns(full_us, received_ns)
        is_explained = full_us - self._board_us <= explained_us
        return late_ns <= MAX_DELAY_NS and (late_ns >= MIN_DELAY_NS or is_explained)

    def take(self, line: BoardLine, received_ns: int, restarted: bool = False) -> ReceivedLine:
        """Accept the line and return it with its time stamp."""
        self.lost += max(0, (line.sequence - self._sequence) % 65536 - 1)
        self._sequence, self._received_ns = line.sequence, received_ns
        self.accepted += 1
        if not isinstance(line, TimedLine):
            return ReceivedLine(line, received_ns, self._board_us, restarted)
        if self._time is None:
            self._time = ClockSync(line.t, received_ns)
        self._board_us = self._time.unwrap(line.t, received_ns)
        return ReceivedLine(line, self._time.stamp(self._board_us, received_ns), self._board_us, restarted)


class SequenceFilter:
    """Filters lines with a valid checksum, in the order of reception.

    A line that does not continue the run is dropped; if the next lines continue *it*, the board has
    restarted. So neither a duplicate nor the one damaged line in 65536 whose checksum is valid by chance does
    harm.
    """

    def __init__(self) -> None:
        self._run: BoardRun | None = None
        self._candidate: BoardRun | None = None
        self.rejected = 0
        self.restarts = 0
        self._lost_in_earlier_runs = 0

    @property
    def lost(self) -> int:
        """Number of lines that the board sent and that were not received."""
        return self._lost_in_earlier_runs + (self._run.lost if self._run else 0)

    def accept(self, line: BoardLine, received_ns: int) -> ReceivedLine | None:
        """Return the line with its time stamp; None if it is dropped."""
        if self._run is None:
            self._run = BoardRun(line, received_ns)
            return self._run.take(line, received_ns, restarted=True)
        if self._run.continues_with(line, received_ns):
            self._candidate = None
            return self._run.take(line, received_ns)
        return self._check_restart(self._run, line, received_ns)

    def _check_restart(self, run: BoardRun, line: BoardLine, received_ns: int) -> ReceivedLine | None:
        # Hypothesis test for a restart: enough consecutive lines of another run confirm it.
        min_lines = MIN_CONFIRMATIONS_IN_TIME if run.in_time(line, received_ns) else MIN_CONFIRMATIONS
        candidate = self._candidate
        # A first line of a possible new run, or one that does not continue it: start again.
        if candidate is None or not candidate.continues_with(line, received_ns):
            self._candidate = BoardRun(line, received_ns)
        elif candidate.accepted + 1 < min_lines:
            candidate.take(line, received_ns)
        else:
            self._lost_in_earlier_runs += run.lost
            self._run, self._candidate = candidate, None
            self.restarts += 1
            return candidate.take(line, received_ns, restarted=True)
        self.rejected += 1
        return None
