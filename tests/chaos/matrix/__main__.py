"""`python -m tests.chaos.matrix --minutes 20`: run units of the reliability matrix and write docs/reliability.md."""

from __future__ import annotations

import argparse
import os
import subprocess
import time
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from datetime import UTC, datetime
from pathlib import Path

import msgspec
from rich.console import Console
from tests.chaos.matrix.measure import UnitResult, measure
from tests.chaos.matrix.page import page
from tests.chaos.matrix.rows import ROOT, load_rows
from tests.chaos.matrix.units import Unit, rotated, units_of

from chefbot.kernels.precompile import compile_kernels
from chefbot.proving.scenario import Scenario
from chefbot.storage.atomic_files import make_folder, write_atomic

RESULTS = Path("runs/chaos/results.json")
SAFE_RUNS = Path(__file__).parent / "safe_runs.txt"
"""Runs that were safe when they were made last, of which each test of the project makes some again."""
console = Console(highlight=False, soft_wrap=True)


def current_commit() -> str:
    """Return the commit of the checkout, with a + if files have been changed since, other than by the matrix."""
    commit = _git("rev-parse", "--short", "HEAD")
    own = f":!{SAFE_RUNS.relative_to(ROOT)}"
    changed = _git("status", "--porcelain", "--", "src", "firmware", "tests", own)
    return f"{commit}+" if changed else commit


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.strip()


def safe_runs() -> set[str]:
    """Return the runs that were safe when they were made last."""
    return set(SAFE_RUNS.read_text().splitlines()) if SAFE_RUNS.exists() else set()


class Matrix:
    """The results so far, on disk after each unit, and what is left of the time."""

    def __init__(self, path: Path, out: Path, minutes: float) -> None:
        self._path, self._out = path, out
        self._ends = time.monotonic() + 60.0 * minutes
        self._rows = load_rows()
        self.units = [unit for row in self._rows for unit in units_of(row)]
        self.commit, self._date = current_commit(), datetime.now(UTC).date().isoformat()
        self._results = msgspec.json.decode(path.read_bytes(), type=list[UnitResult]) if path.exists() else []

    @property
    def seconds_left(self) -> float:
        """Time in which units may begin, s."""
        return self._ends - time.monotonic()

    def missing(self) -> list[Unit]:
        """Return the units without a result for this commit, in its order."""
        known = {(result.row, result.unit) for result in self._results if result.commit == self.commit}
        return [unit for unit in rotated(self.units, self.commit) if (unit.row, unit.name) not in known]

    def measure(self, unit: Unit) -> UnitResult:
        """Run one unit."""
        return measure(unit, self.commit, self._date, max(60.0, self.seconds_left))

    def add(self, result: UnitResult) -> None:
        """Keep a result, print it, and write results and page."""
        self._results = [one for one in self._results if (one.row, one.unit) != (result.row, result.unit)] + [
            result
        ]
        word = "passes" if result.safe else "FAILS "
        console.print(f"{word} {result.row:4} {result.unit}: {result.sentence}", markup=False)
        make_folder(self._path.parent)
        write_atomic(self._path, msgspec.json.format(msgspec.json.encode(self._results)))
        counts = {row.id: sum(unit.row == row.id for unit in self.units) for row in self._rows}
        write_atomic(SAFE_RUNS, "\n".join(sorted(self._safe_runs(result))).encode() + b"\n")
        write_atomic(self._out, page(self._rows, counts, self._results, self.commit, self._date).encode())

    def _safe_runs(self, result: UnitResult) -> set[str]:
        known = safe_runs()
        line = f"{result.row} {result.unit}"
        return (known | {line} if result.safe else known - {line}) if result.seed else known

    def failures(self) -> int:
        """Return the number of units that fail with this commit."""
        return sum(not result.safe for result in self._results if result.commit == self.commit)


def run_all(matrix: Matrix, units: Sequence[Unit], workers: int) -> None:
    """Run units on several workers until all are done or no time is left."""
    waiting = list(units)
    pending: set[Future[UnitResult]] = set()
    with ThreadPoolExecutor(workers) as pool:
        while waiting or pending:
            while waiting and len(pending) < workers and matrix.seconds_left > 0.0:
                pending.add(pool.submit(matrix.measure, waiting.pop(0)))
            if not pending:
                break
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                matrix.add(future.result())


def main() -> int:
    """Run the units that this commit lacks; tests one at a time, as some of them keep limits of time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--rows", nargs="*", help="only these rows, as R10 R21")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="runs at once")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "reliability.md")
    parser.add_argument("--results", type=Path, default=ROOT / RESULTS)
    given = parser.parse_args()
    compile_kernels(console)
    matrix = Matrix(given.results, given.out, given.minutes)
    units = [unit for unit in matrix.missing() if not given.rows or unit.row in given.rows]
    console.print(f"{len(units)} of {len(matrix.units)} units are to be run; {given.minutes:g} minutes")
    runs = [unit for unit in units if isinstance(unit.work, Scenario)]
    half = Matrix(given.results, given.out, given.minutes / 2.0) if runs else matrix
    run_all(half, [unit for unit in units if unit not in runs], 1)
    matrix = Matrix(given.results, given.out, matrix.seconds_left / 60.0)
    run_all(matrix, runs, given.workers)
    console.print(f"{matrix.failures()} units fail; page in {given.out}")
    return int(matrix.failures() > 0)


if __name__ == "__main__":
    raise SystemExit(main())
