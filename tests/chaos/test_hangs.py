"""Processes that hang without dying: the robot stands, they are ended and return; who only thinks is waited for."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from chefbot.demo.processes import PROCESSES
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Float64
from tests.chaos.launched import running, tell, wait_for
from tests.chaos.waiter import ARRIVED_M, Blow, Watched, waiting_robot
from tests.support.waiting import in_time

STOP_MS, BACK_S = 200.0, 5.0
PONDERING = """
description: A step that takes long, in a process of its own.
clock: wall
nodes:
  frames: {kind: "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode"}
  ponder: {kind: "tests.chaos.lateness:PonderNode", process: thought, params: {seconds: %g, compiles: %s}}
"""


def hung(watched: Watched, process: str) -> None:
    """It stops, stands, and comes back."""
    blow = Blow(watched, process, signal.SIGSTOP)
    took = blow.wait_until_back()
    tell(f"{process}: stood {blow.stopped_ms:.0f} ms after it hung, back after {took:.1f} s")
    assert in_time(blow.stopped_ms, STOP_MS) and in_time(took, BACK_S)


@pytest.mark.slow
@pytest.mark.timed
def test_deliveries_succeed_while_each_process_hangs(tmp_path: Path) -> None:
    with waiting_robot(tmp_path) as watched:
        watched.order("table_1")
        wait_for(lambda: watched.has("driving", "table_1"))
        blow = Blow(watched, "navigation", signal.SIGSTOP)
        os.kill(blow.pid, signal.SIGCONT)
        tell(f"drives again {wait_for(watched.drives):.2f} s after it goes on")
        assert in_time(blow.stopped_ms, STOP_MS)
        assert watched.one.child("navigation") == blow.pid
        for process in PROCESSES:
            hung(watched, process)
        watched.await_arrival("table_1")
        assert watched.at("table_1") < ARRIVED_M
        said = watched.one.stop()
    assert "process navigation did not respond; the robot was stopped for" in said
    for process in PROCESSES:
        assert f"process {process} ended (no heartbeat for 2.0 s); restart in 0.5 s" in said


@contextmanager
def other_work(loops: int) -> Iterator[None]:
    """A machine that has too much to do."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops)]
    try:
        yield
    finally:
        for one in busy:
            one.kill()
            one.wait()


@pytest.mark.slow
@pytest.mark.parametrize("compiles", [False, True], ids=["counts", "compiles"])
def test_a_long_computation_on_a_busy_machine_is_not_killed(tmp_path: Path, compiles: bool) -> None:
    path = tmp_path / "pondering.yaml"
    path.write_text(PONDERING % (4.0, str(compiles).lower()))
    with running("launch", str(path)) as (one, node):
        done: list[float] = []
        node.subscription("/done", Float64, lambda said: done.append(said.data))
        ticks = node.publisher("/ticks", Twist)
        wait_for(lambda: ticks.has_subscribers)
        pid = one.child("thought")
        with other_work(os.cpu_count() or 1):
            ticks.publish(Twist.of(0.0, 0.0))
            wait_for(lambda: done)
            time.sleep(0.2)
        assert one.child("thought") == pid
        said = one.stop()
    tell(f"one step of {done[0]:.1f} s; the robot stood {said.count('did not answer')} times")
    assert "ended" not in said
    assert "process thought did not respond; the robot was stopped for" in said  # from the second second on
