"""Tests that the board stops and all worker processes end when the main process of a launch dies or hangs."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from chefbot.msgs.geometry_msgs import Twist
from chefbot.robot.motion_limits import max_speed
from tests.chaos.delivery_launch import localized_robot
from tests.chaos.launch_process import report, run_chefbot, wait_for
from tests.hil.board_bench import ROBOT, BoardBench
from tests.hil.boards import HostPort
from tests.support.processes import children_of, is_alive
from tests.support.waiting import in_time

STOP_MS = 200.0
END_S = 3.0
LAUNCH = """
include: [robot_standalone]
nodes:
  odometry: {kind: "chefbot.nodes.odometry:OdometryNode", process: odometry}
  robot_state_publisher:
    kind: chefbot.nodes.robot_state_publisher:RobotStatePublisherNode
    process: robot_state
"""


class Joystick:
    """Publishes the velocity set last every 50 ms from a thread, as an operator with a joystick does."""

    def __init__(self, publish: Callable[[Twist], None]) -> None:
        self._publish, self._speed = publish, 0.0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def push(self, speed: float) -> None:
        """Set the forward velocity, m/s."""
        self._speed = speed

    def __enter__(self) -> Joystick:
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ending.wait(0.05):
            self._publish(Twist.of(self._speed, 0.0))


def drive(joystick: Joystick, bench: BoardBench) -> None:
    """Release the joystick, as the board requires first, then push it until the robot has half its maximum speed."""
    joystick.push(0.0)
    time.sleep(0.5)
    joystick.push(0.6 * max_speed(ROBOT))
    wait_for(lambda: min(bench.wheels.speed) > 0.5 * max_speed(ROBOT) / ROBOT.metres_per_tick)


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
@pytest.mark.timed
def test_a_killed_launch_stops_the_board_and_leaves_no_process(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(LAUNCH)
    bench = BoardBench(HostPort(), tmp_path / "board")
    try:
        with (
            run_chefbot("launch", str(path), f"board_port:={bench.path}", "headless:=true") as (
                chefbot,
                node,
            ),
            Joystick(node.publisher("/cmd_vel_teleop", Twist).publish) as joystick,
        ):
            wait_for(lambda: chefbot.child("odometry") and chefbot.child("robot_state"))
            drive(joystick, bench)
            stopped = bench.stops_after(lambda: chefbot.process.send_signal(signal.SIGSTOP))
            report(f"the board stopped {stopped:.0f} ms after its launch hung")
            assert in_time(stopped, STOP_MS)
            chefbot.process.send_signal(signal.SIGCONT)
            drive(joystick, bench)
            children = children_of(chefbot.process.pid)
            assert len(children) >= 2
            stopped = bench.stops_after(chefbot.process.kill)
            took = wait_for(lambda: not any(map(is_alive, children)))
            report(
                f"the board stopped after {stopped:.0f} ms; the worker processes had ended {took:.1f} s later"
            )
            assert in_time(took, END_S)
            assert in_time(stopped, STOP_MS)
    finally:
        bench.close()


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
@pytest.mark.timed
def test_all_worker_processes_end_with_the_main_process(tmp_path: Path) -> None:
    with localized_robot(tmp_path) as observer:
        observer.order("table_1")
        wait_for(observer.drives)
        children = children_of(observer.chefbot.process.pid)
        assert len(children) >= len(observer.processes)  # and a spare worker
        os.kill(children[0], signal.SIGSTOP)  # suspended, it does not notice the end of its input
        observer.chefbot.process.kill()
        took = wait_for(lambda: not any(map(is_alive, children)))
        report(f"{len(children)} worker processes had ended {took:.1f} s after the main process")
        assert in_time(took, END_S)
