"""Progress of a proof in the terminal: runs done, failures as they come, and the remaining time."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from chefbot.plural import number_of
from chefbot.proving.record import RunRecord

LINE_PERIOD = 30.0
"""Period of progress lines where the output is not a terminal, s."""


class RunProgress:
    """Counts runs that are done and prints what is left."""

    def __init__(self, console: Console, total: int, done: Collection[RunRecord], bar: Progress) -> None:
        self._console, self._total, self._done, self._bar = console, total, len(done), bar
        self._began, self._first_done, self._printed = time.monotonic(), len(done), time.monotonic()
        self._failed = sum(not record.success for record in done)
        self._task = bar.add_task("runs", total=total, completed=len(done), left="")

    def add(self, record: RunRecord) -> None:
        """Count a run; print a failed one."""
        self._done += 1
        if not record.success:
            self._failed += 1
            reason = record.failure.strip().splitlines()[-1]
            self._console.print(f"{record.scenario}, seed {record.seed}: {reason}", markup=False)
        self._bar.update(self._task, completed=self._done, left=self.remaining())
        if not self._console.is_terminal and time.monotonic() - self._printed > LINE_PERIOD:
            self._printed = time.monotonic()
            self._console.print(
                f"{self._done} of {number_of(self._total, 'run')}, {self._failed} failed, {self.remaining()}"
            )

    def remaining(self) -> str:
        """Return the remaining time by the runs done so far."""
        made = self._done - self._first_done
        if not made:
            return ""
        seconds = (time.monotonic() - self._began) / made * (self._total - self._done)
        return f"{seconds / 60:.0f} min left" if seconds >= 90 else f"{seconds:.0f} s left"


@contextmanager
def run_progress(console: Console, total: int, done: Collection[RunRecord]) -> Iterator[RunProgress]:
    """Yield the progress of `total` runs, of which `done` are done already."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield RunProgress(console, total, done, bar)
