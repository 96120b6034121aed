"""The bridge to DDS between a wire and a domain of the test's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest
from tests.ros2.dds.other import Peer

from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

if TYPE_CHECKING:
    from chefbot.ros2.dds.bridge import DdsBridge


@pytest.fixture
def domain(port: int) -> int:
    """A DDS domain of this test's own: its ports are counted from it."""
    return 1 + port % 200


@pytest.fixture
def peers(domain: int) -> Iterator[Callable[[], Peer]]:
    """`peers()` starts one more."""
    started: list[Peer] = []

    def start() -> Peer:
        started.append(Peer(domain))
        return started[-1]

    yield start
    for one in started:
        one.close()


@pytest.fixture
def robot(port: int) -> Iterator[RmwNode]:
    """A node that is not in the bridge's session."""
    with RmwContext(port=port) as wire, RmwNode(wire, "base", "/robot1") as node:
        yield node


@pytest.fixture
def bridge(port: int, domain: int, robot: RmwNode, monkeypatch: pytest.MonkeyPatch) -> Iterator[DdsBridge]:
    """Between that node's wire and the domain."""
    from chefbot.ros2.dds.bridge import DdsBridge
    from chefbot.ros2.dds.domain import DdsParticipant

    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    with RmwContext(port=port) as wire:
        one = DdsBridge(wire, DdsParticipant(domain, "lo"), lambda _: True)
        yield one
        one.close()
