"""The parent of a launch: it starts it again after a crash or a hang, and not after its end, bad input or Ctrl-C."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.waiting import wait_for

from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import Loop
from chefbot.supervision import service_manager, supervised_launch
from chefbot.supervision.service_manager import SOCKET_VARIABLE, reports_to_service_manager
from chefbot.supervision.supervised_launch import LaunchParent

CHILD = """
import os, signal, socket, sys, time
out = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
notify = lambda text: out.sendto(text.encode(), os.environ["NOTIFY_SOCKET"])
with open(sys.argv[1], "a") as file:
    print(os.getpid(), file=file)
count = len(open(sys.argv[1]).readlines())
signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
"""
"""Records which processes have started; `count` is 1 in the first one."""


class Parent:
    """A LaunchParent in a thread, whose children run CHILD and then the given code."""

    def __init__(self, folder: Path, code: str) -> None:
        self._log = folder / "pids"
        self.sentences: list[str] = []
        self._parent = LaunchParent(
            [sys.executable, "-c", CHILD + code, str(self._log)], self.sentences.append
        )
        self.code: int | None = None
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        self.code = self._parent.run()

    def pids(self) -> list[int]:
        return list(map(int, self._log.read_text().split())) if self._log.exists() else []

    def end(self) -> int:
        self._thread.join()
        assert self.code is not None
        return self.code

    def request_end(self, number: int = signal.SIGTERM) -> None:
        self._parent._request = (number, time.monotonic())


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Short delays; signal handlers can be set in the main thread only, so the tests set the request."""
    monkeypatch.setattr(supervised_launch, "MIN_RESTART_DELAY", 0.01)
    monkeypatch.setattr(supervised_launch, "MAX_RESTART_DELAY", 0.04)
    monkeypatch.setattr(supervised_launch.signal, "signal", lambda *_: None)
    yield


def test_a_crashed_launch_is_started_again(tmp_path: Path) -> None:
    parent = Parent(tmp_path, "if count < 3: os.kill(os.getpid(), 9)\nsys.exit(1 if count == 3 else 0)")
    assert parent.end() == 0
    assert len(parent.pids()) == 4
    assert parent.sentences == [
        "The launch ended (signal 9); it starts again in 0.0 s.",
        "The launch ended (signal 9); it starts again in 0.0 s.",
        "The launch ended (exit code 1); it starts again in 0.0 s.",
    ]


@pytest.mark.parametrize("code", [0, 2, 130])
def test_an_orderly_end_is_final(tmp_path: Path, code: int) -> None:
    parent = Parent(tmp_path, f"sys.exit({code})")
    assert (parent.end(), len(parent.pids())) == (code, 1)


def test_faults_of_nodes_at_an_orderly_end_are_not_a_crash(tmp_path: Path) -> None:
    parent = Parent(tmp_path, "notify('READY=1'); notify('STOPPING=1'); sys.exit(1)")
    assert (parent.end(), len(parent.pids())) == (1, 1)


@pytest.mark.slow
def test_a_launch_that_falls_silent_is_killed_and_started_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervised_launch, "WATCHDOG_TIMEOUT", 0.3)
    parent = Parent(tmp_path, "notify('READY=1')\nif count == 1: time.sleep(1000)\nnotify('STOPPING=1')")
    assert parent.end() == 0
    assert len(parent.pids()) == 2
    assert parent.sentences[0].startswith("The launch ended (no sign of life for 0 s)")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_request_to_end_is_passed_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    monkeypatch.setattr(supervised_launch, "FORWARD_DELAY", 0.1)
    parent = Parent(tmp_path, "notify('READY=1')\nwhile True: notify('WATCHDOG=1'); time.sleep(0.1)")
    wait_for(parent.pids)
    time.sleep(0.3)
    parent.request_end(number)
    parent.end()
    assert len(parent.pids()) == 1


def test_a_launch_that_ignores_the_request_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervised_launch, "END_TIMEOUT", 0.3)
    parent = Parent(
        tmp_path, "signal.signal(15, signal.SIG_IGN); open(sys.argv[1] + 'x', 'w'); time.sleep(1000)"
    )
    wait_for((tmp_path / "pidsx").exists)
    parent.request_end()
    assert parent.end() == 128 + signal.SIGKILL


def test_a_loop_reports_while_it_progresses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service_manager, "PERIOD", 0.01)
    monkeypatch.setattr(service_manager, "STEP_TIMEOUT", 0.2)
    with supervised_launch._receiver() as (address, receiver):
        monkeypatch.setenv(SOCKET_VARIABLE, str(address))
        loop = Loop(WallClock(), time.time_ns())
        receiver.setblocking(True)
        with reports_to_service_manager() as reports, reports.watching(loop):
            assert SOCKET_VARIABLE not in os.environ  # worker processes must not report
            assert [receiver.recv(99) for _ in range(3)] == [b"READY=1", b"WATCHDOG=1", b"WATCHDOG=1"]
            loop.callback_start_ns = time.monotonic_ns() - 10**9  # a step of a second
            assert _falls_silent(receiver)
        assert _received(receiver) == b"STOPPING=1"


def test_a_loop_ends_when_its_manager_has_died(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service_manager, "PERIOD", 0.01)
    monkeypatch.setenv(SOCKET_VARIABLE, str(tmp_path / "nobody"))
    loop = Loop(WallClock(), time.time_ns())
    loop.schedule(time.time_ns() + 3600 * 10**9, 0, lambda: None)
    with reports_to_service_manager() as reports, reports.watching(loop):
        loop.run()


def test_a_program_is_watched_from_one_launch_to_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service_manager, "PERIOD", 0.01)
    with supervised_launch._receiver() as (address, receiver):
        monkeypatch.setenv(SOCKET_VARIABLE, str(address))
        receiver.setblocking(True)
        with reports_to_service_manager() as reports:
            for first in (b"READY=1", b"WATCHDOG=1"):  # it is ready once
                with reports.watching(Loop(WallClock(), time.time_ns())):
                    assert [receiver.recv(99) for _ in range(2)] == [first, b"WATCHDOG=1"]
                assert receiver.recv(99) == b"WATCHDOG=1"  # while nothing runs
            monkeypatch.setattr(
                service_manager, "CHANGE_TIMEOUT", 0.0
            )  # the next launch hangs before it begins
            assert _falls_silent(receiver)
        assert _received(receiver) == b"STOPPING=1"


def _falls_silent(receiver: socket.socket) -> bool:
    """Return whether nothing more is received, after what was sent before."""
    time.sleep(0.1)
    receiver.setblocking(False)
    while _received(receiver):
        pass
    time.sleep(0.1)
    return not _received(receiver)


def _received(receiver: object) -> bytes:
    try:
        return receiver.recv(99)  # type: ignore[attr-defined, no-any-return]
    except BlockingIOError:
        return b""
