"""The supervisor with small programs for children: how soon it knows, what it tells, who takes the place."""

from __future__ import annotations

import base64
import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from chefbot.msgs.std_msgs import Bool
from chefbot.runtime.launch import Launch
from chefbot.supervision import supervisor as module
from chefbot.supervision.state_handover import StoredMessage
from chefbot.supervision.supervisor import Supervisor, SupervisorCallbacks
from chefbot.supervision.worker_process import WorkerSpec
from tests.chaos.launched import wait_for
from tests.support.processes import is_alive
from tests.support.waiting import in_time

NOTING = """
import json, os, sys
preparation, order = json.loads(sys.stdin.readline()), json.loads(sys.stdin.readline())
words = [len(word["cdr"]) for word in order["restored_messages"]]
with open(sys.argv[1], "a") as file:
    print(json.dumps([os.getpid(), preparation["spare"], words]), file=file)
sys.stdin.read()
"""
"""Notes who it is and what it was told."""
SEEN_S = 0.1
LONG = StoredMessage("map", "nav_msgs/msg/OccupancyGrid", bytes(300_000))
"""More than a pipe holds."""
SHORT = StoredMessage.serialize("localized", Bool(True))


class Kept:
    """What the hooks were told."""

    def __init__(self) -> None:
        self.lost: list[tuple[float, str]] = []
        self.back: list[str] = []
        self.told: list[str] = []
        self.ready = True

    def hooks(self) -> SupervisorCallbacks:
        return SupervisorCallbacks(
            on_down=lambda name: self.lost.append((time.monotonic(), name)),
            is_ready=lambda _: self.ready,
            on_up=self.back.append,
            restored_messages=lambda _: (LONG, SHORT),
        )


@contextmanager
def supervised(kept: Kept, notes: Path) -> Iterator[Supervisor]:
    order = WorkerSpec(Launch(name="x", description="", args={}, nodes={}), "a", ".", 0, 7447)
    command = (sys.executable, "-c", NOTING, str(notes))
    one = Supervisor([order], kept.told.append, command, hooks=kept.hooks())
    try:
        yield one
    finally:
        one.close()


def noted(notes: Path) -> list[tuple[int, bool, list[int]]]:
    return [tuple(json.loads(line)) for line in notes.read_text().splitlines()] if notes.exists() else []


@pytest.mark.timed
def test_a_restarted_process_gets_its_latched_messages(tmp_path: Path) -> None:
    kept, notes = Kept(), tmp_path / "notes"
    with supervised(kept, notes) as one:
        wait_for(lambda: len(noted(notes)) == 1)
        assert noted(notes)[0][1:] == (False, [])
        began = time.monotonic()
        os.kill(one.pids()["a"], signal.SIGKILL)
        wait_for(lambda: kept.lost)
        assert kept.lost[0][1] == "a"
        assert in_time(kept.lost[0][0] - began, 5 * SEEN_S)
        wait_for(lambda: len(noted(notes)) == 2)
        assert noted(notes)[1][2] == [len(base64.b64encode(word.cdr)) for word in (LONG, SHORT)]


def test_a_restarted_process_counts_as_up_only_when_ready(tmp_path: Path) -> None:
    kept, notes = Kept(), tmp_path / "notes"
    with supervised(kept, notes) as one:
        wait_for(lambda: kept.back == ["a"] and noted(notes))
        kept.ready = False
        os.kill(one.pids()["a"], signal.SIGKILL)
        wait_for(lambda: len(noted(notes)) == 2)
        time.sleep(2 * module.PERIOD)
        assert kept.back == ["a"]
        kept.ready = True
        wait_for(lambda: kept.back == ["a", "a"])
    assert kept.told[-1].startswith("process a is ready again, ")


@pytest.mark.slow
def test_a_spare_worker_replaces_a_killed_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SPARE_AFTER", 0.2)
    kept, notes = Kept(), tmp_path / "notes"
    with supervised(kept, notes) as one:
        for lives in (1, 2, 3):
            wait_for(lambda: len(noted(notes)) == lives)  # noqa: B023
            wait_for(lambda: one._spare is not None)
            spare = one._spare
            assert spare is not None
            os.kill(one.pids()["a"], signal.SIGKILL)
            wait_for(lambda: one.pids().get("a") == spare.process.pid)  # noqa: B023
        wait_for(lambda: len(noted(notes)) == 4)
        assert [spare for _, spare, _ in noted(notes)] == [False, True, True, True]
        wait_for(lambda: one._spare is not None)
        left = [one.pids()["a"], one._spare.process.pid]
    assert not any(map(is_alive, left))
