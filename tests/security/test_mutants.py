"""Mutants of the files of strangers by seed are read or refused in a sentence, within limits of memory and time."""

from __future__ import annotations

import sys

import pytest
from tests.support.mutants.samples import samples
from tests.support.mutants.trial import Report, run, table

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the children are measured by /proc")
SEED = 7
"""Odd, as every seed that judges."""
KINDS = sorted(samples())


def judge(kind: str, number: int) -> Report:
    """Read mutants of a kind of file; none may do anything but be read or be refused."""
    report = run(kind, SEED, number)
    assert not report.faults, table({kind: report})
    assert sum(report.counts.values()) == number
    return report


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_mutants_are_read_or_refused_in_a_sentence(kind: str) -> None:
    judge(kind, 30)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_many_mutants_are_read_or_refused(kind: str) -> None:
    report = judge(kind, 10_000)
    assert report.counts["read"] > 100 and report.counts["sentence"] > 100


@pytest.mark.parametrize("kind", KINDS)
def test_the_sample_itself_is_read(kind: str, tmp_path) -> None:
    from tests.support.mutants.samples import write

    write(tmp_path, samples()[kind].files)
    samples()[kind].read(tmp_path)


@pytest.mark.parametrize("fault", ["signal", "memory", "time", "traceback", "page", "wait"])
@pytest.mark.slow
def test_faults_of_a_reader_would_be_found(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader with a fault in place of a real one."""
    from tests.support.mutants import trial

    monkeypatch.setattr(trial, "CPU_SECONDS", 0.3)
    monkeypatch.setattr(trial, "HANG_SECONDS", 3.0)
    broken = samples()["places"]._replace(read=FAULTS[fault][0])
    monkeypatch.setattr(trial, "samples", lambda: {"places": broken})
    (outcome,) = trial.run("places", SEED, 1).faults
    assert outcome.kind == FAULTS[fault][1] and FAULTS[fault][2] in outcome.detail


def _killed(_: object) -> None:
    import os
    import signal

    os.kill(os.getpid(), signal.SIGSEGV)


def _large(_: object) -> None:
    bytearray(10**9)


def _slow(_: object) -> None:
    while True:
        pass


def _broken(_: object) -> None:
    raise KeyError("home")


def _page(_: object) -> None:
    from chefbot.errors import UserError

    raise UserError("a\nb")


def _waits(_: object) -> None:
    import time

    time.sleep(600.0)


FAULTS = {
    "signal": (_killed, "signal", "SIGSEGV"),
    "memory": (_large, "traceback", "MemoryError"),
    "time": (_slow, "signal", "of CPU"),
    "traceback": (_broken, "traceback", "KeyError: 'home'"),
    "page": (_page, "no sentence", "a"),
    "wait": (_waits, "hang", "waited"),
}
