"""Launches of several processes: they talk, come back when killed, and leave nothing behind."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from tests.support.processes import children_of, is_alive
from tests.support.waiting import PATIENCE, in_time, wait_for

from chefbot.config import ConfigError
from chefbot.launcher.service_unit import RESTART_STEPS
from chefbot.msgs.action_msgs import STATUS_SUCCEEDED
from chefbot.msgs.chefbot_msgs import Deliver, Deliver_Goal
from chefbot.msgs.std_msgs import Float64, String
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.launch import Launch, NodeEntry, load_launch, split_by_process
from chefbot.supervision.restart_delay import MAX_RESTART_DELAY, MIN_RESTART_DELAY
from chefbot.supervision.supervisor import PERIOD, Supervisor, WorkerSpec, _Child

LAUNCH = """
description: Counting here, doubling and cooking elsewhere.
clock: wall
nodes:
  counter: {kind: "own_toys:Counter"}
  guest: {kind: "own_toys:Guest"}
  doubler: {kind: "own_toys:Doubler", process: numbers}
  cook: {kind: "own_toys:Cook", process: kitchen}
"""
TOYS = Path(__file__).parents[1] / "runtime" / "toys.py"
EVERY_PROCESS_IS_LATE = """
from chefbot.bridge import bridged_actions

bridged_actions.SERVER_TIMEOUT = 0.0
"""
"""Added to the toys: every process takes longer to start than goals wait for servers outside the launch."""


def order(name: str) -> WorkerSpec:
    return WorkerSpec(Launch(name="x", description="", args={}, nodes={}), name, ".", 0, 7447)


SLEEPY = "import sys; sys.stdin.readline(); sys.stdin.read()"
DYING = "import sys; sys.stdin.readline(); sys.exit(3)"
STUBBORN = "import sys, time; sys.stdin.readline(); time.sleep(600)"


@pytest.mark.slow
def test_a_crashing_process_restarts_with_growing_delay() -> None:
    reported: list[tuple[float, str]] = []
    supervisor = Supervisor(
        [order("a")], lambda text: reported.append((time.monotonic(), text)), (sys.executable, "-c", DYING)
    )
    wait_for(lambda: sum("ended" in text for _, text in reported) >= 3)
    supervisor.close()
    lives = [
        (at, text) for at, text in reported if " is ready again" not in text
    ]  # reported where it ran for long enough
    assert [text for _, text in lives[:4]] == [
        "process a ended (exit code 3); restart in 0.5 s",
        "process a restarted",
        "process a ended (exit code 3); restart in 1.0 s",
        "process a restarted",
    ]
    assert lives[3][0] - lives[2][0] >= 1.0


def test_the_delay_doubles_up_to_its_maximum_and_stays_there() -> None:
    child = _Child(order("a"))
    delays = [child.back_off() for _ in range(10)]
    assert delays[0] == MIN_RESTART_DELAY and delays[-3:] == [MAX_RESTART_DELAY] * 3
    growing = [delay for delay in delays if delay < MAX_RESTART_DELAY]
    assert all(b == pytest.approx(2.0 * a) for a, b in pairwise(growing))
    assert len(growing) == RESTART_STEPS, "systemd restarts a launch as often before the longest delay"


def test_a_launch_without_workers_keeps_no_spare() -> None:
    """Its thread goes on."""
    supervisor = Supervisor([], lambda _: None, (sys.executable, "-c", SLEEPY))
    time.sleep(2.5 * PERIOD)
    supervisor.close()


@pytest.mark.slow
@pytest.mark.timed
def test_processes_end_with_their_pipe_or_are_killed() -> None:
    for program, limit in ((SLEEPY, 10.0), (STUBBORN, 20.0)):
        supervisor = Supervisor([order("a"), order("b")], lambda _: None, (sys.executable, "-c", program))
        wait_for(lambda: len(supervisor.pids()) == 2)  # noqa: B023
        pids = supervisor.pids().values()
        began = time.monotonic()
        supervisor.close()
        assert in_time(time.monotonic() - began, limit)
        assert not any(map(is_alive, pids))


def test_a_launch_is_split_into_its_processes(tmp_path: Path) -> None:
    path = tmp_path / "parts.yaml"
    path.write_text(LAUNCH)
    own, others = split_by_process(load_launch(str(path)))
    assert list(own.nodes) == ["counter", "guest"]
    assert {name: list(one.nodes) for name, one in others.items()} == {
        "numbers": ["doubler"],
        "kitchen": ["cook"],
    }
    with pytest.raises(ConfigError, match="process"):
        path.write_text(LAUNCH.replace("kitchen", "my kitchen"))
        load_launch(str(path))
    assert NodeEntry(kind="a:B").process == ""


class Launched:
    """`chefbot launch` of the file above, and an outsider."""

    def __init__(self, folder: Path, port: int) -> None:
        (folder / "own_toys.py").write_text(TOYS.read_text() + EVERY_PROCESS_IS_LATE)
        (folder / "parts.yaml").write_text(LAUNCH)
        environment = {**os.environ, "CHEFBOT_WIRE_PORT": str(port), "ROS_DOMAIN_ID": "0"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "chefbot", "launch", str(folder / "parts.yaml")],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.wire = RmwContext(port=port, router=False)
        self.node = RmwNode(self.wire, "outsider")

    def there(self, *names: str) -> bool:
        return set(names) <= {one.name for one in self.wire.graph.nodes()}


@pytest.fixture
def launched(tmp_path: Path, port: int) -> Iterator[Launched]:
    one = Launched(tmp_path, port)
    yield one
    one.node.close()
    one.wire.close()
    for pid in [*children_of(one.process.pid), one.process.pid]:
        if is_alive(pid):
            os.kill(pid, signal.SIGKILL)
    one.process.communicate()


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
def test_processes_communicate_restart_and_leave_nothing_behind(launched: Launched, port: int) -> None:
    double: queue.Queue[Float64] = queue.Queue()
    dishes: queue.Queue[String] = queue.Queue()
    launched.node.subscription("/double", Float64, double.put)
    launched.node.subscription("/dishes", String, dishes.put, TRANSIENT_LOCAL_QOS)
    assert launched.wire.graph.wait_for(lambda _: launched.there("cook", "doubler", "counter"), PATIENCE)
    assert double.get(timeout=PATIENCE).data % 2.0 == 0.0
    # the guest's order; a late-joining subscriber receives the last dish only
    served = [dishes.get(timeout=PATIENCE).data]
    while served[-1] != "salad":
        served.append(dishes.get(timeout=PATIENCE).data)
    assert served in (["soup", "salad"], ["salad"])

    children = children_of(launched.process.pid)
    assert len(children) >= 2  # a spare may be there too
    for pid in children:
        os.kill(pid, signal.SIGKILL)
    assert launched.wire.graph.wait_for(lambda _: not launched.there("cook"), PATIENCE)
    assert launched.wire.graph.wait_for(lambda _: launched.there("cook", "doubler"), PATIENCE)
    while not double.empty():
        double.get()
    assert double.get(timeout=PATIENCE).data % 2.0 == 0.0
    client = ActionClient(launched.node, "/deliver", Deliver)
    wait_for(lambda: client.served)
    assert client.send_goal_async(Deliver_Goal(("tea",))).result.result(PATIENCE)[0] == STATUS_SUCCEEDED

    children = children_of(launched.process.pid)
    launched.process.send_signal(signal.SIGINT)
    output, _ = launched.process.communicate(timeout=PATIENCE)
    assert launched.process.returncode == 0
    assert "process numbers ended (signal 9); restart in 0.5 s" in output
    assert not any(map(is_alive, children))
    with RmwContext(port=port) as again:
        assert again.is_router  # the port is free


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
def test_a_killed_launch_leaves_no_orphan_processes(launched: Launched) -> None:
    assert launched.wire.graph.wait_for(lambda _: launched.there("cook", "doubler"), PATIENCE)
    children = children_of(launched.process.pid)
    assert len(children) >= 2  # a spare may be there too
    launched.process.send_signal(signal.SIGSTOP)
    time.sleep(0.2)  # what they print meanwhile is never read
    launched.process.kill()
    wait_for(lambda: not any(map(is_alive, children)))
