"""A launch or a demo in processes of its own, and an outsider on its wire."""

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
    """Seconds that it took; AssertionError after `patience`."""
    began = time.monotonic()
    while not condition():
        assert time.monotonic() < began + patience
        time.sleep(0.01)
    return time.monotonic() - began


def tell(sentence: str) -> None:
    """A figure, for `pytest -s`."""
    sys.stdout.write(sentence + "\n")


def name_of(pid: int) -> str:
    """What it calls itself; empty if it is no more."""
    try:
        return Path(f"/proc/{pid}/comm").read_text().strip()
    except (FileNotFoundError, ProcessLookupError):
        return ""


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


class Launched:
    """`chefbot` with these words, such as `launch` and a file."""

    def __init__(self, words: Sequence[str], port: int) -> None:
        self.port = port
        environment = {**os.environ, "CHEFBOT_WIRE_PORT": str(port), "ROS_DOMAIN_ID": "0"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "chefbot", *words],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def child(self, name: str) -> int | None:
        """The number of its process of that name, None while there is none."""
        return next((pid for pid in children_of(self.process.pid) if name_of(pid) == name), None)

    def kill(self, name: str, by: signal.Signals = signal.SIGKILL) -> int:
        """`kill -9` of a process of its own, or another signal; its number."""
        pid = self.child(name)
        assert pid is not None, f"there is no process {name}"
        os.kill(pid, by)
        return pid

    def stop(self) -> str:
        """Ctrl-C; what it said."""
        self.process.send_signal(signal.SIGINT)
        return self.process.communicate(timeout=PATIENCE)[0]


@contextmanager
def running(*words: str) -> Iterator[tuple[Launched, RmwNode]]:
    """`chefbot` with these words; whatever happens in between, nothing of it is left."""
    one = Launched(words, free_port())
    children: list[int] = []
    try:
        with RmwContext(port=one.port, router=False) as wire, RmwNode(wire, "outsider") as node:
            yield one, node
            children = children_of(one.process.pid)
    finally:
        for pid in [one.process.pid, *children, *children_of(one.process.pid)]:
            if is_alive(pid):
                os.kill(pid, signal.SIGKILL)
        one.process.communicate()


@contextmanager
def launched(name: str, *arguments: str) -> Iterator[tuple[Launched, RmwNode]]:
    """`chefbot launch` of a file in this folder."""
    with running("launch", str(HERE / name), *arguments) as both:
        yield both
