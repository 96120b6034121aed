"""Fixtures with a Zenoh session on a port of its own, other processes, and several machines."""

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
from chefbot.fleet.membership import Role
from chefbot.ros2.rmw.session import RmwContext
from tests.support.network import Network, admit
from tests.support.waiting import PATIENCE

PEER_PROGRAM = Path(__file__).parent / "ros_peer.py"


@pytest.fixture
def port() -> int:
    """Return a free port."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@pytest.fixture
def wire(port: int) -> Iterator[RmwContext]:
    """A session of this process, which also is the router if there is none on the port."""
    with RmwContext(port=port) as session:
        yield session


@pytest.fixture
def other(port: int) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Return a function: `other("router")` starts another process and waits until it is connected."""
    running: list[subprocess.Popen[str]] = []

    def start(role: str) -> subprocess.Popen[str]:
        command = [sys.executable, str(PEER_PROGRAM), str(port), role]
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
        machines = Network(tmp_path)
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no network namespaces here: {error.stderr.strip()}")
    yield machines
    machines.close()


@pytest.fixture
def fleet(tmp_path: Path) -> Keyring:
    """The keys of a fleet of two robots and an operator."""
    office = Keyring(tmp_path / "site")
    office.create_fleet("hotel", datetime.now(UTC))
    members: dict[str, Role] = {"robot1": "robot", "robot2": "robot", "alice": "operator"}
    for name, role in members.items():
        admit(tmp_path, office, name, role)
    for name in members:
        Keyring(tmp_path / name).accept(office.card())
    return office


@pytest.fixture
def peer(port: int, wire: RmwContext) -> Iterator[zenoh.Session]:
    """A Zenoh session with the configuration of rmw_zenoh, independent of chefbot."""
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{port}"]')
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        yield session
