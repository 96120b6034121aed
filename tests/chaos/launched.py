"""A launch in processes of its own, and an outsider on its wire."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from chefbot.wire.node import WireNode
from chefbot.wire.session import Wire

PATIENCE = 60.0
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


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def children_of(pid: int) -> list[int]:
    found = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False)
    return [int(one) for one in found.stdout.split()]


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


class Launched:
    """`chefbot launch` of a file in this folder."""

    def __init__(self, name: str, port: int, *arguments: str) -> None:
        self.port = port
        environment = {**os.environ, "CHEFBOT_WIRE_PORT": str(port), "ROS_DOMAIN_ID": "0"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "chefbot", "launch", str(HERE / name), *arguments],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def stop(self) -> str:
        """Ctrl-C; what it said."""
        self.process.send_signal(signal.SIGINT)
        return self.process.communicate(timeout=PATIENCE)[0]


@contextmanager
def launched(name: str, *arguments: str) -> Iterator[tuple[Launched, WireNode]]:
    """Whatever happens in between, nothing of it is left."""
    one = Launched(name, free_port(), *arguments)
    children: list[int] = []
    try:
        with Wire(port=one.port, router=False) as wire, WireNode(wire, "outsider") as node:
            yield one, node
            children = children_of(one.process.pid)
    finally:
        for pid in [one.process.pid, *children]:
            if is_alive(pid):
                os.kill(pid, signal.SIGKILL)
        one.process.communicate()
