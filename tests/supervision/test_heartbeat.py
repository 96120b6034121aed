"""Heartbeats: what a process reports of its loop, and what its launch makes of it."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from hypothesis import given
from hypothesis import strategies as st
from tests.support.waiting import wait_for

from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import TIMER, Loop
from chefbot.supervision.heartbeat import (
    BUSY,
    HEARTBEAT_PERIOD,
    HEARTBEAT_TIMEOUT,
    MAX_SILENCE,
    MAX_STEP_TIME,
    PROGRESSING,
    STEP_TIMEOUT,
    HeartbeatMonitor,
    HeartbeatSender,
)
from chefbot.supervision.supervisor import PERIOD

looks = st.lists(
    st.tuples(st.sampled_from([b"", PROGRESSING, BUSY, BUSY + PROGRESSING]), st.floats(0.0, 2 * PERIOD)),
    max_size=300,
)


@given(looks)
def test_only_missing_heartbeats_make_a_process_unresponsive(updates: list[tuple[bytes, float]]) -> None:
    pulse, silent, thinks, begun = HeartbeatMonitor(), 0.0, 0.0, False
    for signs, elapsed in updates:
        pulse.update(signs, elapsed)
        begun |= bool(signs)
        silent = 0.0 if signs else silent + elapsed
        thinks = 0.0 if PROGRESSING in signs else thinks + elapsed
        assert pulse.is_unresponsive == (begun and (silent > MAX_SILENCE or thinks > MAX_STEP_TIME))
        assert bool(pulse.kill_reason) == (begun and silent > HEARTBEAT_TIMEOUT)


def after(signs: bytes, seconds: float) -> HeartbeatMonitor:
    """Felt every PERIOD; a last look is beyond."""
    pulse = HeartbeatMonitor()
    pulse.update(PROGRESSING, PERIOD)
    for _ in range(round(seconds / PERIOD) + 1):
        pulse.update(signs, PERIOD)
    return pulse


def test_silence_makes_a_process_unresponsive_then_kills_it() -> None:
    assert not after(b"", MAX_SILENCE - 2 * PERIOD).is_unresponsive
    assert after(b"", MAX_SILENCE).is_unresponsive
    assert HEARTBEAT_PERIOD + MAX_SILENCE + 2 * PERIOD < 0.2, "the robot stands within 200 ms"
    assert after(b"", HEARTBEAT_TIMEOUT - 2 * PERIOD).kill_reason == ""
    assert after(b"", HEARTBEAT_TIMEOUT).kill_reason == "no heartbeat for 2.0 s"


def test_a_long_step_is_unresponsive_and_killed_after_a_timeout() -> None:
    assert not after(BUSY, MAX_STEP_TIME - 2 * PERIOD).is_unresponsive
    assert after(BUSY, MAX_STEP_TIME).is_unresponsive
    assert after(BUSY, 10 * HEARTBEAT_TIMEOUT).kill_reason == ""
    assert after(BUSY, STEP_TIMEOUT).kill_reason == "busy with one step for 30 s"


def test_a_loading_process_has_more_time() -> None:
    pulse = HeartbeatMonitor()
    for _ in range(round(59.0 / PERIOD)):
        pulse.update(b"", PERIOD)
    assert not pulse.is_unresponsive
    assert pulse.kill_reason == ""
    for _ in range(round(2.0 / PERIOD)):
        pulse.update(b"", PERIOD)
    assert pulse.kill_reason == "no heartbeat within 60 s of its start"


@contextmanager
def beating() -> Iterator[tuple[Loop, socket.socket]]:
    """A loop in a thread of its own, and the launch's end of its line."""
    ours, theirs = socket.socketpair()
    loop = Loop(WallClock(), time.monotonic_ns())
    loop.schedule(loop.now_ns + 600_000_000_000, TIMER, lambda: None)
    thread = threading.Thread(target=loop.run)
    with ours, theirs:
        ours.settimeout(10.0)
        HeartbeatSender(loop, theirs.fileno())
        thread.start()
        yield loop, ours
        loop.stop()
        thread.join()


def test_a_waiting_loop_is_idle_and_a_blocked_one_busy() -> None:
    with beating() as (loop, line):
        assert line.recv(1) == PROGRESSING
        let_go = threading.Event()
        loop.post(lambda: let_go.wait(10.0))
        wait_for(lambda: line.recv(1) == BUSY)
        assert [line.recv(1) for _ in range(5)] == [BUSY] * 5
        let_go.set()
        wait_for(lambda: line.recv(1) == PROGRESSING)
        assert [line.recv(1) for _ in range(5)] == [PROGRESSING] * 5


def test_heartbeat_sender_ends_when_the_pipe_closes() -> None:
    hearts = lambda: [one for one in threading.enumerate() if one.name == "heart"]  # noqa: E731
    with beating() as (_, line):
        line.setblocking(False)
        assert hearts()
    wait_for(lambda: not hearts())
