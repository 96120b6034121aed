"""What a proof prints while it runs: failures, lines where there is no terminal, and the time that is left."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from tests.support.proving_runs import a_record

from chefbot.proving import progress
from chefbot.proving.progress import LINE_PERIOD, run_progress


class Watch:
    """A clock that the test advances."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Watch:
    made = Watch()
    monkeypatch.setattr(progress, "time", made)
    return made


def text_console() -> tuple[Console, io.StringIO]:
    out = io.StringIO()
    return Console(file=out, width=200), out


def test_a_failed_run_is_printed_with_its_last_line(watch: Watch) -> None:
    console, out = text_console()
    with run_progress(console, 3, []) as shown:
        shown.add(a_record(1))
        assert out.getvalue() == ""
        shown.add(
            a_record(2, success=False, failure="Traceback\n  [bold]line[/bold]\nValueError: [no] map\n")
        )
    assert out.getvalue() == "tiny, seed 2: ValueError: [no] map\n"


def test_without_a_terminal_a_line_is_printed_now_and_then(watch: Watch) -> None:
    console, out = text_console()
    with run_progress(console, 10, []) as shown:
        for seed in range(1, 9):
            watch.now += LINE_PERIOD / 3.5
            shown.add(a_record(seed, success=seed != 2))
    lines = [line for line in out.getvalue().splitlines() if "runs" in line]
    assert [line.split(",")[0] for line in lines] == ["4 of 10 runs", "8 of 10 runs"]
    assert all("1 failed" in line for line in lines)


def test_failures_of_an_earlier_session_count(watch: Watch) -> None:
    console, out = text_console()
    with run_progress(console, 10, [a_record(1, success=False), a_record(3)]) as shown:
        watch.now += 2 * LINE_PERIOD
        shown.add(a_record(5))
    assert out.getvalue().startswith("3 of 10 runs, 1 failed, ")


@pytest.mark.parametrize(
    ("done", "made", "seconds", "left"),
    [
        (0, 2, 20.0, "80 s left"),
        (5, 1, 30.0, "2 min left"),
        (0, 5, 10.0, "10 s left"),
        (9, 1, 50.0, "0 s left"),
    ],
)
def test_the_time_left_is_that_of_the_runs_made_now(
    watch: Watch, done, made, seconds: float, left: str
) -> None:
    console, _ = text_console()
    with run_progress(console, 10, [a_record(-seed) for seed in range(done)]) as shown:
        assert shown.remaining() == "", "nothing is known before the first run"
        watch.now += seconds
        for seed in range(made):
            shown.add(a_record(seed))
        assert shown.remaining() == left


def test_a_terminal_shows_a_bar(watch: Watch) -> None:
    out = io.StringIO()
    console = Console(file=out, width=100, force_terminal=True)
    with run_progress(console, 7, [a_record(3), a_record(5)]) as shown:
        watch.now += 2 * LINE_PERIOD
        shown.add(a_record(1))
        shown._bar.refresh()
    assert "3/7" in out.getvalue() and "of 7 runs" not in out.getvalue()
