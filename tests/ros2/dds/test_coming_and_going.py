"""Peers and robots that end and come back, and the bridge that does not begin."""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest
from tests.ros2.dds.other import Peer
from tests.support.waiting import wait_for

from chefbot.cli.tools.dds_bridge import run_dds
from chefbot.errors import UserError
from chefbot.msgs.std_msgs import String
from chefbot.ros2.dds.domain import DdsError
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

pytest.importorskip("cyclonedds", reason="needs Cyclone DDS: pip install 'chefbot[dds]'")

from chefbot.ros2.dds.bridge import DdsBridge
from chefbot.ros2.dds.domain import DdsParticipant


@pytest.mark.slow
def test_killed_peer_and_router_are_replaced(
    port: int, domain: int, monkeypatch: pytest.MonkeyPatch, peers: Callable[[], Peer]
) -> None:
    """The bridge's own session finds the wire again when the router's process is gone."""
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    first = RmwContext(port=port)
    with RmwContext(port=port) as wire:
        one = DdsBridge(wire, DdsParticipant(domain, "lo"), lambda _: True)
        doomed = Peer(domain)
        doomed.write("rt/last_text", "String")
        wait_for(lambda: "/last_text" in one.topics.inward, "a peer")
        doomed.close(kill=True)
        first.close()
        peer = peers()
        with RmwContext(port=port) as other, RmwNode(other, "base") as node:
            texts = node.publisher("/texts", String)
            peer.read("rt/texts", "String")
            wait_for(
                lambda: texts.has_subscribers and peer.sources("rt/texts"), "the bridge on the wire again"
            )
            texts.publish(String("here"))
            assert wait_for(lambda: peer.take("rt/texts"), "the text") == ["here"]
        one.close()


def test_peers_and_robots_reconnect(
    port: int, robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    peer = peers()
    with RmwContext(port=port, router=False) as other, RmwNode(other, "guest") as guest:
        texts = guest.publisher("/texts", String)
        peer.read("rt/texts", "String")
        wait_for(lambda: texts.has_subscribers, "the bridge")
    wait_for(lambda: "/texts" not in bridge.topics.outward, "its end")
    wait_for(lambda: not [one for one in peer.ends("writers") if one[0] == "rt/texts"], "its end on DDS")
    with RmwContext(port=port, router=False) as other, RmwNode(other, "guest") as guest:
        texts = guest.publisher("/texts", String)
        wait_for(lambda: texts.has_subscribers, "the bridge again")
        wait_for(lambda: peer.sources("rt/texts"), "the writer again")
        texts.publish(String("back"))
        assert wait_for(lambda: peer.take("rt/texts"), "the text") == ["back"]


def test_invalid_arguments_are_reported_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence each, before anything is opened."""
    for arguments, wanted in (
        ((300, [], "lo"), "domain 300"),
        ((None, ["/no topic"], "lo"), "/no topic"),
    ):
        with pytest.raises(UserError, match=wanted):
            run_dds(*arguments)
    monkeypatch.setitem(sys.modules, "chefbot.ros2.dds.bridge", None)
    monkeypatch.delitem(sys.modules, "chefbot.ros2.dds.bridge")
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    with pytest.raises(UserError, match="pip install 'chefbot\\[dds\\]'"):
        run_dds(None, [], "lo")


def test_an_unknown_interface_is_reported(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    with pytest.raises(DdsError, match="no_such_0"):
        DdsParticipant(domain, "no_such_0")
