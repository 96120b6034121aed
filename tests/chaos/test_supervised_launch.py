"""Tests that a supervised launch comes back on the wire after its main process is killed, and ends on Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from tests.chaos.launch_process import HERE, report, run_chefbot, wait_for
from tests.support.processes import children_of, is_alive

KILLS = 3


def main_process(parent: int) -> int | None:
    """Return the PID of the launch below its parent, if it runs."""
    return next(iter(children_of(parent)), None)


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
def test_a_supervised_launch_is_back_after_each_kill() -> None:
    with run_chefbot("launch", "--supervised", str(HERE / "two_processes.yaml")) as (chefbot, node):

        def on_the_wire() -> bool:
            return {"odometry", "robot_state_publisher"} <= {found.name for found in node.wire.graph.nodes()}

        for _ in range(KILLS):
            wait_for(on_the_wire)
            pid = main_process(chefbot.process.pid)
            assert pid is not None
            family = [pid, *children_of(pid)]
            os.kill(pid, signal.SIGKILL)
            took = wait_for(lambda: not on_the_wire())
            took += wait_for(on_the_wire)
            report(f"back on the wire {took:.1f} s after the kill")
            assert not any(map(is_alive, family))
        family = children_of(chefbot.process.pid)
        output = chefbot.stop()
        assert chefbot.process.returncode == 0
    assert not any(map(is_alive, family))
    assert output.count("The launch ended (signal 9)") == KILLS
    assert "Without ROS 2" not in output


@pytest.mark.slow
def test_bad_input_is_reported_once() -> None:
    command = [sys.executable, "-m", "chefbot", "launch", "--supervised", "two_processes", "nonsense:=1"]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("chefbot: ") == 1 and "again" not in done.stdout
