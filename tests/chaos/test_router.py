"""The router's process dies: who talks goes on talking, whoever it was that had the router."""

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
from tests.chaos.launched import PATIENCE, Launched, free_port, tell, wait_for

COUNTING = """
clock: wall
nodes:
  counter: {kind: "tests.runtime.toys:Counter"}
  doubler: {kind: "tests.runtime.toys:Doubler", process: sums}
"""
ROUTER = """
import sys
from chefbot.ros2.rmw.session import RmwContext
with RmwContext(port=int(sys.argv[1])) as wire:
    print(wire.is_router, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def counting(tmp_path: Path) -> Path:
    path = tmp_path / "counting.yaml"
    path.write_text(COUNTING)
    return path


@contextmanager
def counted(path: Path, port: int) -> Iterator[Launched]:
    one = Launched(["launch", str(path)], port)
    try:
        yield one
    finally:
        one.process.kill()
        one.process.communicate()


@contextmanager
def topic_hz(port: int) -> Iterator[queue.SimpleQueue[str]]:
    """Lines of `chefbot topic hz /double`."""
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
    """Hz."""
    while True:
        line = lines.get(timeout=PATIENCE)
        if " Hz, every" in line:
            return float(line.split(":")[1].split("Hz")[0])


def hears(port: int) -> bool:
    """Whether a newcomer is told who is there, and hears it."""
    got: queue.SimpleQueue[Float64] = queue.SimpleQueue()
    with RmwContext(port=port, router=False) as wire, RmwNode(wire, "newcomer") as node:
        node.subscription("/double", Float64, got.put)
        found = wire.graph.wait_for(lambda graph: "/double" in graph.topics(), PATIENCE)
        return found and got.get(timeout=PATIENCE).data > 0.0


@pytest.mark.slow
def test_death_of_a_foreign_router_interrupts_nothing(counting: Path) -> None:
    port = free_port()
    command = [sys.executable, "-c", ROUTER, str(port)]
    router = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert router.stdout is not None and router.stdout.readline() == "True\n"
    with counted(counting, port):
        assert hears(port)
        with topic_hz(port) as lines:
            assert next_rate(lines) == pytest.approx(10.0, abs=2.0)
            router.kill()
            router.communicate()
            rates = [next_rate(lines) for _ in range(4)]
            tell(f"after the router's death: {rates} Hz")
            assert min(rates) > 8.0  # an interruption of 0.2 s would show
            assert hears(port)


@pytest.mark.slow
def test_another_launch_connects_after_the_router_launch_dies(counting: Path) -> None:
    port = free_port()
    with ExitStack() as stack:
        with counted(counting, port) as first:
            assert hears(port)
            lines = stack.enter_context(topic_hz(port))
            next_rate(lines)
            first.process.kill()
        while not lines.empty():
            lines.get()
        began = time.monotonic()
        with counted(counting, port):
            wait_for(lambda: not lines.empty())
            tell(f"heard again {time.monotonic() - began:.1f} s after the next launch began")
            next_rate(lines)  # of the time between
            assert next_rate(lines) == pytest.approx(10.0, abs=2.0)
            assert hears(port)
