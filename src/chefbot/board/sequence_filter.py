"""Which lines follow each other: what is repeated, old or from another run of the board is told apart."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.board.clock_sync import BoardTime
from chefbot.board.messages import BoardLine, Measured

EARLIEST_NS, LATEST_NS = -250_000_000, 5_000_000_000
"""A line is so much before or behind its time at most; else it is of another run of the board, or no line."""
SEQUENCE_HOLDS_NS = 60_000_000_000
"""In twice this time the board numbers fewer than 2^15 lines; after a longer silence they say nothing."""
LONGEST_STEP_US = 20_000
"""Between two numbered lines of the board, whose motion lines alone come at 50 Hz."""

CONFIRMED, CONFIRMED_IN_TIME = 2, 20
"""Lines that must follow each other to be a new run; more where their time is that of the run so far, for then
they are far more likely repeated or out of order."""


class Heard(NamedTuple):
    """A line that counts."""

    line: BoardLine
    stamp_ns: int
    """When it was measured, on the computer's clock; for `v`, when it was heard."""
    board_us: int
    """The board's time, not wrapped; for `v` that of the line before it."""
    restarted: bool
    """The first that counts of a new run: counters have begun anew."""


class Run:
    """One run of the board, from power-on on."""

    def __init__(self, line: BoardLine, heard_ns: int) -> None:
        self._sequence, self._heard_ns = line.sequence, heard_ns
        self._time = BoardTime(line.t, heard_ns) if isinstance(line, Measured) else None
        self._board_us = line.t if isinstance(line, Measured) else 0
        self.lost = 0
        """Lines that its numbers say are missing."""
        self.taken = 1

    def continues_with(self, line: BoardLine, heard_ns: int) -> bool:
        """Whether the line is a later one of this run."""
        ahead = (line.sequence - self._sequence) % 65536
        if heard_ns - self._heard_ns < SEQUENCE_HOLDS_NS and not 0 < ahead < 32768:
            return False
        if not isinstance(line, Measured) or self._time is None:
            return True
        passed_us = self._time.unwrap(line.t, heard_ns) - self._board_us
        return passed_us >= 0 and self.in_time(line, heard_ns, explained_us=ahead * LONGEST_STEP_US)

    def in_time(self, line: BoardLine, heard_ns: int, explained_us: int = 0) -> bool:
        """Whether its time is about now on this run's clock.

        A line may be further ahead of its time if no more than `explained_us` passed on the board since the line
        before: where that one was read late and many behind it were lost.
        """
        if not isinstance(line, Measured) or self._time is None:
            return False
        full_us = self._time.unwrap(line.t, heard_ns)
        late_ns = self._time.late_ns(full_us, heard_ns)
        is_explained = full_us - self._board_us <= explained_us
        return late_ns <= LATEST_NS and (late_ns >= EARLIEST_NS or is_explained)

    def take(self, line: BoardLine, heard_ns: int, restarted: bool = False) -> Heard:
        """The line, placed in time."""
        self.lost += max(0, (line.sequence - self._sequence) % 65536 - 1)
        self._sequence, self._heard_ns = line.sequence, heard_ns
        self.taken += 1
        if not isinstance(line, Measured):
            return Heard(line, heard_ns, self._board_us, restarted)
        if self._time is None:
            self._time = BoardTime(line.t, heard_ns)
        self._board_us = self._time.unwrap(line.t, heard_ns)
        return Heard(line, self._time.stamp(self._board_us, heard_ns), self._board_us, restarted)


class Stream:
    """Lines whose CRC holds, in the order they came.

    A line that does not follow is left out; if the next one follows *it*, the board has restarted. So neither
    a repeated line nor the one damaged line in 65536 whose CRC holds by chance does harm.
    """

    def __init__(self) -> None:
        self._run: Run | None = None
        self._other: Run | None = None
        self.left_out = 0
        self.restarts = 0
        self._lost_before = 0

    @property
    def lost(self) -> int:
        """Lines that the board has numbered and nobody has seen."""
        return self._lost_before + (self._run.lost if self._run else 0)

    def take(self, line: BoardLine, heard_ns: int) -> Heard | None:
        """The line with its time; None if it does not count."""
        if self._run is None:
            self._run = Run(line, heard_ns)
            return self._run.take(line, heard_ns, restarted=True)
        if self._run.continues_with(line, heard_ns):
            self._other = None
            return self._run.take(line, heard_ns)
        return self._doubt(self._run, line, heard_ns)

    def _doubt(self, run: Run, line: BoardLine, heard_ns: int) -> Heard | None:
        needed = CONFIRMED_IN_TIME if run.in_time(line, heard_ns) else CONFIRMED
        other = self._other
        if other is None or not other.continues_with(line, heard_ns):
            self._other = Run(line, heard_ns)
        elif other.taken + 1 < needed:
            other.take(line, heard_ns)
        else:
            self._lost_before += run.lost
            self._run, self._other = other, None
            self.restarts += 1
            return other.take(line, heard_ns, restarted=True)
        self.left_out += 1
        return None
