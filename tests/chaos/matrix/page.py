"""Writes the matrix as a page: what fails first, then every row with what was promised and what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tests.chaos.matrix.measure import UnitResult
from tests.chaos.matrix.rows import Row

from chefbot.plural import number_of
from chefbot.proving.statistics import wilson

HEAD = """# Reliability

What happens when a part of the robot fails: the faults R1 to R38, what is promised for each, and what was measured.
Written by `make chaos` on {date}, commit {commit}; `make chaos ARGS="--minutes 60"` continues where it ended. A unit
is a file of tests or a run on the proving ground. The order of the units changes with the commit, so that all come in
turn. Only units that were run with this commit count.
"""
FAILURES_SHOWN = 40
SENTENCE = 160


def page(
    rows: Sequence[Row], counts: Mapping[str, int], results: Sequence[UnitResult], commit: str, date: str
) -> str:
    """Return the page in Markdown. counts: number of units of each row."""
    known = [result for result in results if result.commit == commit]
    broken = [result for result in known if not result.safe]
    lines = [HEAD.format(date=date, commit=commit)]
    lines += ["## What fails", "", *(_failures(broken) or ["Nothing that was run."]), ""]
    lines += [
        "## All faults",
        "",
        "| | fault | promised | measured | units run | result |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        _line(row, counts[row.id], [result for result in known if result.row == row.id]) for row in rows
    ]
    return "\n".join(lines) + "\n"


def _failures(broken: Sequence[UnitResult]) -> list[str]:
    shown = [f"- {one.row}, {one.unit}: {_cell(one.sentence)}" for one in broken[:FAILURES_SHOWN]]
    rest = len(broken) - FAILURES_SHOWN
    return [*shown, f"- and {rest} more"] if rest > 0 else shown


def _line(row: Row, count: int, results: Sequence[UnitResult]) -> str:
    measured = "; ".join(part for part in (_summary(results), row.unmeasured) if part) or "not run"
    run = f"{len(results)} of {count}" if count else "none"
    return f"| {row.id} | {row.fault} | {row.target} | {measured} | {run} | {verdict(count, results)} |"


def verdict(count: int, results: Sequence[UnitResult]) -> str:
    """Return the result of a row in a word or two, marked if the row was run in part only."""
    if not count:
        return "not measured"
    if not results:
        return "not run"
    if not all(result.safe for result in results):
        return "**fails**"
    return "passes" if len(results) == count else "passes so far"


def _summary(results: Sequence[UnitResult]) -> str:
    """Return what was measured: shares of runs with their intervals, and the figures of tests."""
    runs = [result for result in results if result.seed]
    sentences = [_cell(result.sentence) for result in results if not result.seed]
    if runs:
        safe = wilson(sum(run.safe for run in runs), len(runs))
        done = sum(run.done for run in runs)
        share = f"{safe.successes} of {number_of(safe.total, 'run')} safe"
        sentences.append(f"{share} ({safe.low:.0%} to {safe.high:.0%}), task done in {done}")
    return "; ".join(sentences)


def _cell(text: str) -> str:
    """Return a text that fits into a cell of a table."""
    flat = " ".join(text.split()).replace("|", "/")
    return flat if len(flat) <= SENTENCE else flat[: SENTENCE - 3] + "..."
