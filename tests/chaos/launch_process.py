"""Starts `chefbot` as a process of its own, with a node of the test on the same ROS 2 network."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from tests.support.processes import children_of, is_alive
from tests.support.waiting import PATIENCE

HERE = Path(__file__).parent


def wait_for(condition: Callable[[], object], patience: float = PATIENCE) -> float:
    """Wait until the condition is true and return the seconds that it took; AssertionError after `patience`."""
    began = time.monotonic()
    while not condition():
        assert time.monotonic() < began + patience
        time.sleep(0.01)
    return time.monotonic() - began


def report(sentence: str) -> None:
    """Print a measured figure, which `pytest -s` shows."""
    sys.stdout.write(sentence + "\n")


def name_of(pid: int) -> str:
    """Return the name of a process; empty if it has ended."""
    try:
        return Path(f"/proc/{pid}/comm").read_text().strip()
    except (FileNotFoundError, ProcessLookupError):
        return ""


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


FAULT_SIGNALS = {"killed": signal.SIGKILL, "hung": signal.SIGSTOP}
"""Signal for each fault of a process, in the words of the simulator's fault events."""


class LaunchProcess:
    """A process of `chefbot` with the given arguments, such as `launch` and a file."""

    def __init__(self, arguments: Sequence[str], port: int) -> None:
        self.port = port
        environment = {**os.environ, "CHEFBOT_WIRE_PORT": str(port), "ROS_DOMAIN_ID": "0"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "chefbot", *arguments],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def child(self, name: str) -> int | None:
        """Return the PID of its worker process of that name; None while there is none."""
        return next((pid for pid in children_of(self.process.pid) if name_of(pid) == name), None)

    def inject(self, fault: str, name: str) -> int:
        """Let one of its worker processes fail, `killed` or `hung` (docs/faults.md), and return its PID."""
        pid = self.child(name)
        assert pid is not None, f"there is no process {name}"
        os.kill(pid, FAULT_SIGNALS[fault])
        return pid

    def stop(self) -> str:
        """Interrupt it as Ctrl-C does and return its output."""
        self.process.send_signal(signal.SIGINT)
        return self.process.communicate(timeout=PATIENCE)[0]


@contextmanager
def run_chefbot(*arguments: str) -> Iterator[tuple[LaunchProcess, RmwNode]]:
    """Run `chefbot` with the given arguments and a node; on exit kill all processes that are left."""
    chefbot = LaunchProcess(arguments, free_port())
    children: list[int] = []
    try:
        with RmwContext(port=chefbot.port, router=False) as wire, RmwNode(wire, "outsider") as node:
            yield chefbot, node
            children = children_of(chefbot.process.pid)
    finally:
        for pid in [chefbot.process.pid, *children, *children_of(chefbot.process.pid)]:
            if is_alive(pid):
                os.kill(pid, signal.SIGKILL)
        chefbot.process.communicate()


@contextmanager
def run_launch_file(name: str, *arguments: str) -> Iterator[tuple[LaunchProcess, RmwNode]]:
    """Run `chefbot launch` with a launch file of this folder."""
    with run_chefbot("launch", str(HERE / name), *arguments) as running:
        yield running
