"""The launch's own process dies or hangs, with base and driver: no child outlives it, the board stops by itself."""

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
from tests.chaos.launched import running, tell, wait_for
from tests.chaos.waiter import waiting_robot
from tests.hil.boards import HostPort
from tests.hil.desk import ROBOT, Desk
from tests.support.processes import children_of, is_alive
from tests.support.waiting import in_time

STOP_MS = 200.0
LEFT_S = 3.0
BUILT = """
include: [robot_standalone]
nodes:
  odometry: {kind: "chefbot.nodes.odometry:OdometryNode", process: senses}
  frames: {kind: "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode", process: frames}
"""


class Hand:
    """On the joystick: lets go first, as the board wants it, then pushes until it lets go."""

    def __init__(self, say: Callable[[Twist], None]) -> None:
        self._say, self._speed = say, 0.0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def push(self, speed: float) -> None:
        """m/s"""
        self._speed = speed

    def __enter__(self) -> Hand:
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()

    def _work(self) -> None:
        while not self._ending.wait(0.05):
            self._say(Twist.of(self._speed, 0.0))


def drive(hand: Hand, desk: Desk) -> None:
    """Until it is fast."""
    hand.push(0.0)
    time.sleep(0.5)
    hand.push(0.6 * max_speed(ROBOT))
    wait_for(lambda: min(desk.wheels.speed) > 0.5 * max_speed(ROBOT) / ROBOT.metres_per_tick)


@pytest.mark.slow
@pytest.mark.timed
def test_a_killed_launch_stops_the_board_and_leaves_no_process(tmp_path: Path) -> None:
    path = tmp_path / "built.yaml"
    path.write_text(BUILT)
    desk = Desk(HostPort(), tmp_path / "board")
    try:
        with (
            running("launch", str(path), f"board_port:={desk.path}", "headless:=true") as (one, node),
            Hand(node.publisher("/cmd_vel_teleop", Twist).publish) as hand,
        ):
            wait_for(lambda: one.child("senses") and one.child("frames"))
            drive(hand, desk)
            stopped = desk.stops_after(lambda: one.process.send_signal(signal.SIGSTOP))
            tell(f"the board stopped {stopped:.0f} ms after its launch hung")
            assert in_time(stopped, STOP_MS)
            one.process.send_signal(signal.SIGCONT)
            drive(hand, desk)
            children = children_of(one.process.pid)
            assert len(children) >= 2
            stopped = desk.stops_after(one.process.kill)
            took = wait_for(lambda: not any(map(is_alive, children)))
            tell(f"the board stopped after {stopped:.0f} ms; its children were gone {took:.1f} s later")
            assert in_time(took, LEFT_S)
            assert in_time(stopped, STOP_MS)
    finally:
        desk.close()


@pytest.mark.slow
@pytest.mark.timed
def test_all_waiter_processes_end_with_the_simulator(tmp_path: Path) -> None:
    with waiting_robot(tmp_path) as watched:
        watched.order("table_1")
        wait_for(watched.drives)
        children = children_of(watched.one.process.pid)
        assert len(children) >= len(watched.parts)  # and a spare
        os.kill(children[0], signal.SIGSTOP)  # it sees no end of its input
        watched.one.process.kill()
        took = wait_for(lambda: not any(map(is_alive, children)))
        tell(f"{len(children)} children were gone {took:.1f} s after their launch")
        assert in_time(took, LEFT_S)
