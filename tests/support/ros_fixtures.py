"""A wire on a port of its own, and other processes on it."""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
import zenoh

from chefbot.fleet.keyring import Keyring
from chefbot.ros2.rmw.session import RmwContext
from tests.support.network import Network, admit
from tests.support.waiting import PATIENCE

OTHER = Path(__file__).parent / "ros_peer.py"


@pytest.fixture
def port() -> int:
    """A port that nobody has."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@pytest.fixture
def wire(port: int) -> Iterator[RmwContext]:
    """This process on the wire; it becomes the router unless another one is it already."""
    with RmwContext(port=port) as one:
        yield one


@pytest.fixture
def other(port: int) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """`other("router")` starts the other process and waits until it is on the wire."""
    running: list[subprocess.Popen[str]] = []

    def start(role: str) -> subprocess.Popen[str]:
        command = [sys.executable, str(OTHER), str(port), role]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        running.append(process)
        assert process.stdout is not None
        assert process.stdout.readline().strip() in ("router", "peer")
        return process

    yield start
    for process in running:
        process.communicate(timeout=PATIENCE)


@pytest.fixture
def network(tmp_path: Path) -> Iterator[Network]:
    try:
        one = Network(tmp_path)
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no network namespaces here: {error.stderr.strip()}")
    yield one
    one.close()


@pytest.fixture
def fleet(tmp_path: Path) -> Keyring:
    """Two robots and an operator, who all know each other."""
    office = Keyring(tmp_path / "site")
    office.create_fleet("hotel", datetime.now(UTC))
    members = {"robot1": "robot", "robot2": "robot", "alice": "operator"}
    for name, role in members.items():
        admit(tmp_path, office, name, role)
    for name in members:
        Keyring(tmp_path / name).accept(office.card())
    return office


@pytest.fixture
def peer(port: int, wire: RmwContext) -> Iterator[zenoh.Session]:
    """A session as rmw_zenoh configures it, with nothing of ours."""
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{port}"]')
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        yield session
