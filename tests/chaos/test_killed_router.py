"""Tests that a launch and a subscriber stay connected when the process with the Zenoh router dies."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from chefbot.msgs.std_msgs import Float64
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from tests.chaos.launch_process import PATIENCE, LaunchProcess, free_port, report, wait_for

LAUNCH = """
clock: wall
nodes:
  counter: {kind: "tests.runtime.toys:Counter"}
  doubler: {kind: "tests.runtime.toys:Doubler", process: doubler}
"""
ROUTER = """
import sys
from chefbot.ros2.rmw.session import RmwContext
with RmwContext(port=int(sys.argv[1])) as wire:
    print(wire.is_router, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def launch_file(tmp_path: Path) -> Path:
    path = tmp_path / "launch.yaml"
    path.write_text(LAUNCH)
    return path


@contextmanager
def run_launch(path: Path, port: int) -> Iterator[LaunchProcess]:
    chefbot = LaunchProcess(["launch", str(path)], port)
    try:
        yield chefbot
    finally:
        chefbot.process.kill()
        chefbot.process.communicate()


@contextmanager
def topic_hz(port: int) -> Iterator[queue.SimpleQueue[str]]:
    """Run `chefbot topic hz /double` and yield a queue of its output lines."""
    environment = {
        **os.environ,
        "CHEFBOT_WIRE_PORT": str(port),
        "ROS_DOMAIN_ID": "0",
        "PYTHONUNBUFFERED": "1",
    }
    command = [sys.executable, "-m", "chefbot", "topic", "hz", "/double", "--duration", "0"]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    stream = process.stdout
    assert stream is not None
    reader = threading.Thread(target=lambda: [lines.put(line) for line in stream])
    reader.start()
    try:
        yield lines
    finally:
        process.kill()
        process.wait()
        reader.join()
        stream.close()


def next_rate(lines: queue.SimpleQueue[str]) -> float:
    """Return the next rate in the output, Hz."""
    while True:
        line = lines.get(timeout=PATIENCE)
        if " Hz, every" in line:
            return float(line.split(":")[1].split("Hz")[0])


def new_subscriber_receives(port: int) -> bool:
    """Return whether a new node finds the topic in the graph and receives a message on it."""
    received: queue.SimpleQueue[Float64] = queue.SimpleQueue()
    with RmwContext(port=port, router=False) as wire, RmwNode(wire, "newcomer") as node:
        node.subscription("/double", Float64, received.put)
        found = wire.graph.wait_for(lambda graph: "/double" in graph.topics(), PATIENCE)
        return found and received.get(timeout=PATIENCE).data > 0.0


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
def test_a_killed_external_router_interrupts_no_topic(launch_file: Path) -> None:
    port = free_port()
    command = [sys.executable, "-c", ROUTER, str(port)]
    router = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert router.stdout is not None and router.stdout.readline() == "True\n"
    with run_launch(launch_file, port):
        assert new_subscriber_receives(port)
        with topic_hz(port) as lines:
            assert next_rate(lines) == pytest.approx(10.0, abs=2.0)
            router.kill()
            router.communicate()
            rates = [next_rate(lines) for _ in range(4)]
            report(f"after the router was killed: {rates} Hz")
            assert min(rates) > 8.0  # an interruption of 0.2 s would show
            assert new_subscriber_receives(port)


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
def test_another_launch_connects_after_the_router_launch_dies(launch_file: Path) -> None:
    port = free_port()
    with ExitStack() as stack:
        with run_launch(launch_file, port) as first:
            assert new_subscriber_receives(port)
            lines = stack.enter_context(topic_hz(port))
            next_rate(lines)
            first.process.kill()
        while not lines.empty():
            lines.get()
        began = time.monotonic()
        with run_launch(launch_file, port):
            wait_for(lambda: not lines.empty())
            report(f"received again {time.monotonic() - began:.1f} s after the next launch began")
            next_rate(lines)  # includes the time without a launch
            assert next_rate(lines) == pytest.approx(10.0, abs=2.0)
            assert new_subscriber_receives(port)
