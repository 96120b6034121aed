"""Tests that the robot stops while a process hangs, that it is restarted, and that a long computation is not."""

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
from tests.chaos.delivery_launch import ARRIVED_M, DeliveryObserver, ProcessFault, localized_robot
from tests.chaos.launch_process import report, run_chefbot, wait_for
from tests.support.waiting import in_simulated_time, in_time

STOP_MS, BACK_S = 200.0, 5.0
LONG_CALLBACK = """
description: A node with a callback that takes long, in a process of its own.
clock: wall
nodes:
  robot_state_publisher: {kind: "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode"}
  long_callback: {kind: "tests.chaos.lateness:LongCallbackNode", process: computation,
    params: {seconds: %g, compiles: %s}}
"""


def check_hang(observer: DeliveryObserver, process: str) -> None:
    """Suspend a process and check that the robot stops, stands, and the process returns in time."""
    fault = ProcessFault(observer, process, "hung")
    took = fault.wait_until_back()
    report(f"{process}: stopped {fault.stopped_ms:.0f} ms after it hung, back after {took:.1f} s")
    assert in_simulated_time(fault.stopped_ms, STOP_MS) and in_time(took, BACK_S)


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
@pytest.mark.timed
def test_deliveries_succeed_while_each_process_hangs(tmp_path: Path) -> None:
    with localized_robot(tmp_path) as observer:
        observer.order("table_1")
        wait_for(lambda: observer.delivery_is("driving", "table_1"))
        fault = ProcessFault(observer, "navigation", "hung")
        os.kill(fault.pid, signal.SIGCONT)
        report(f"drives again {wait_for(observer.drives):.2f} s after the process continues")
        assert in_simulated_time(fault.stopped_ms, STOP_MS)
        assert observer.chefbot.child("navigation") == fault.pid
        for process in PROCESSES:
            check_hang(observer, process)
        observer.await_arrival("table_1")
        assert observer.distance_to("table_1") < ARRIVED_M
        output = observer.chefbot.stop()
    assert "process navigation did not respond; the robot was stopped for" in output
    for process in PROCESSES:
        assert f"process {process} ended (no heartbeat for 2.0 s); restart in 0.5 s" in output


@contextmanager
def other_load(loops: int) -> Iterator[None]:
    """Keep the processors busy with so many endless loops."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
@pytest.mark.parametrize("compiles", [False, True], ids=["computes", "compiles"])
def test_a_long_computation_on_a_busy_machine_is_not_killed(tmp_path: Path, compiles: bool) -> None:
    path = tmp_path / "long_callback.yaml"
    path.write_text(LONG_CALLBACK % (4.0, str(compiles).lower()))
    with run_chefbot("launch", str(path)) as (chefbot, node):
        done: list[float] = []
        node.subscription("/done", Float64, lambda message: done.append(message.data))
        ticks = node.publisher("/ticks", Twist)
        wait_for(lambda: ticks.has_subscribers)
        pid = chefbot.child("computation")
        with other_load(os.cpu_count() or 1):
            ticks.publish(Twist.of(0.0, 0.0))
            wait_for(lambda: done)
            time.sleep(0.2)
        assert chefbot.child("computation") == pid
        output = chefbot.stop()
    report(f"one callback of {done[0]:.1f} s; the robot was stopped {output.count('did not respond')} times")
    assert "ended" not in output
    assert "process computation did not respond; the robot was stopped for" in output  # after one second
