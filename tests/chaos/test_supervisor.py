"""Tests that the supervisor notices a dead worker, restarts it with its restored messages and uses a spare worker."""

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
from tests.chaos.launch_process import wait_for
from tests.support.processes import is_alive
from tests.support.waiting import in_time

WORKER = """
import json, os, sys
preparation, order = json.loads(sys.stdin.readline()), json.loads(sys.stdin.readline())
sizes = [len(message["cdr"]) for message in order["restored_messages"]]
with open(sys.argv[1], "a") as file:
    print(json.dumps([os.getpid(), preparation["spare"], sizes]), file=file)
sys.stdin.read()
"""
"""Appends its PID, whether it is a spare worker, and the sizes of its restored messages to a file."""
DETECTION_S = 0.1
LONG = StoredMessage("map", "nav_msgs/msg/OccupancyGrid", bytes(300_000))
"""Larger than the buffer of a pipe."""
SHORT = StoredMessage.serialize("localized", Bool(True))


class Events:
    """Callbacks of a supervisor that record their calls."""

    def __init__(self) -> None:
        self.down: list[tuple[float, str]] = []
        self.up: list[str] = []
        self.log: list[str] = []
        self.ready = True

    def callbacks(self) -> SupervisorCallbacks:
        return SupervisorCallbacks(
            on_down=lambda name: self.down.append((time.monotonic(), name)),
            is_ready=lambda _: self.ready,
            on_up=self.up.append,
            restored_messages=lambda _: (LONG, SHORT),
        )


@contextmanager
def supervise(events: Events, log: Path) -> Iterator[Supervisor]:
    order = WorkerSpec(Launch(name="x", description="", args={}, nodes={}), "a", ".", 0, 7447)
    command = (sys.executable, "-c", WORKER, str(log))
    supervisor = Supervisor([order], events.log.append, command, hooks=events.callbacks())
    try:
        yield supervisor
    finally:
        supervisor.close()


def started(log: Path) -> list[tuple[int, bool, list[int]]]:
    """Return PID, spare and sizes of restored messages of each worker that has started."""
    return [tuple(json.loads(line)) for line in log.read_text().splitlines()] if log.exists() else []


@pytest.mark.timed
@pytest.mark.slow
def test_a_restarted_process_gets_its_latched_messages(tmp_path: Path) -> None:
    events, log = Events(), tmp_path / "log"
    with supervise(events, log) as supervisor:
        wait_for(lambda: len(started(log)) == 1)
        assert started(log)[0][1:] == (False, [])
        began = time.monotonic()
        os.kill(supervisor.pids()["a"], signal.SIGKILL)
        wait_for(lambda: events.down)
        assert events.down[0][1] == "a"
        assert in_time(events.down[0][0] - began, 5 * DETECTION_S)
        wait_for(lambda: len(started(log)) == 2)
        assert started(log)[1][2] == [len(base64.b64encode(message.cdr)) for message in (LONG, SHORT)]


@pytest.mark.slow
def test_a_restarted_process_counts_as_up_only_when_ready(tmp_path: Path) -> None:
    events, log = Events(), tmp_path / "log"
    with supervise(events, log) as supervisor:
        wait_for(lambda: events.up == ["a"] and started(log))
        events.ready = False
        os.kill(supervisor.pids()["a"], signal.SIGKILL)
        wait_for(lambda: len(started(log)) == 2)
        time.sleep(2 * module.PERIOD)
        assert events.up == ["a"]
        events.ready = True
        wait_for(lambda: events.up == ["a", "a"])
    assert events.log[-1].startswith("process a is ready again, ")


@pytest.mark.slow
def test_a_spare_worker_replaces_a_killed_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SPARE_DELAY", 0.2)
    events, log = Events(), tmp_path / "log"
    with supervise(events, log) as supervisor:
        for count in (1, 2, 3):
            wait_for(lambda: len(started(log)) == count)  # noqa: B023
            wait_for(lambda: supervisor._spare is not None)
            spare = supervisor._spare
            assert spare is not None
            os.kill(supervisor.pids()["a"], signal.SIGKILL)
            wait_for(lambda: supervisor.pids().get("a") == spare.process.pid)  # noqa: B023
        wait_for(lambda: len(started(log)) == 4)
        assert [spare for _, spare, _ in started(log)] == [False, True, True, True]
        wait_for(lambda: supervisor._spare is not None)
        left = [supervisor.pids()["a"], supervisor._spare.process.pid]
    assert not any(map(is_alive, left))
