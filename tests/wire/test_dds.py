"""The bridge to DDS against a process that has never heard of chefbot: Cyclone's own API with types of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chefbot.commands.dds import run_dds
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav_msgs import MapMetaData, OccupancyGrid
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.wire.names import WireType
from chefbot.wire.node import WireNode
from chefbot.wire.qos import LATCHED, SENSOR, TRANSIENT_LOCAL, QoS
from chefbot.wire.session import Wire

pytest.importorskip("cyclonedds", reason="needs Cyclone DDS: pip install 'chefbot[dds]'")

from chefbot.wire.dds.bridge import DdsBridge
from chefbot.wire.dds.domain import Place

PEER = Path(__file__).parent / "dds_peer.py"
LOOPBACK = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>119</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>
</Discovery></Domain></CycloneDDS>"""
PATIENCE = 20.0


class Peer:
    """The other process: `peer.read("rt/scan", "LaserScan")` and the like."""

    def __init__(self, domain: int) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(PEER), str(domain)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "CYCLONEDDS_URI": LOOPBACK},
        )
        assert self._answer() == "ready"

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*values: Any) -> Any:
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps([name, *values]) + "\n")
            self._process.stdin.flush()
            return self._answer()

        return call

    def close(self, *, kill: bool = False) -> None:
        """By the end of its input, or by force."""
        if kill:
            self._process.kill()
        self._process.communicate(timeout=20)

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        assert line, "the other process has died"
        return json.loads(line)


def until(condition: Callable[[], Any], what: str) -> Any:
    """What `condition` returns as soon as it is true."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError(f"{what} did not come in {PATIENCE:g} s")


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
def robot(port: int) -> Iterator[WireNode]:
    """A node that is not in the bridge's session."""
    with Wire(port=port) as wire, WireNode(wire, "base", "/robot1") as node:
        yield node


@pytest.fixture
def bridge(port: int, domain: int, robot: WireNode, monkeypatch: pytest.MonkeyPatch) -> Iterator[DdsBridge]:
    """Between that node's wire and the domain."""
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    with Wire(port=port) as wire:
        one = DdsBridge(wire, Place(domain, "lo"), lambda _: True)
        yield one
        one.close()


def test_robot_is_heard(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    scan = LaserScan(Header.of(1, "laser"), ranges=np.full(640, 2.5, np.float32))
    picture = Image(height=480, width=640, encoding="rgb8", step=1920, data=np.full(921_600, 3, np.uint8))
    scans, pictures = robot.publisher("scan", LaserScan), robot.publisher("image", Image, SENSOR)
    peer = peers()
    peer.read("rt/robot1/scan", "LaserScan")
    peer.read("rt/robot1/image", "Image", "best_effort")
    until(lambda: scans.heard and pictures.heard, "a listener")

    def said(publisher: Any, message: Any, topic: str) -> Any:
        publisher.publish(message)
        return peer.take(topic)

    got = until(lambda: said(scans, scan, "rt/robot1/scan"), "a scan")
    assert got[0] == ["laser", 640, 1600.0]
    got = until(lambda: said(pictures, picture, "rt/robot1/image"), "a picture")
    assert got[0] == [480, 640, "rgb8", 921_600, 3 * 921_600]


def test_robot_is_commanded(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    heard: list[Twist] = []
    robot.subscription("cmd_vel_teleop", Twist, heard.append)
    peer = peers()
    peer.write("rt/robot1/cmd_vel_teleop", "Twist")
    until(lambda: peer.matched("rt/robot1/cmd_vel_teleop") == 1, "the robot's reader on DDS")
    peer.say("rt/robot1/cmd_vel_teleop", 0.25, -0.5)  # once: whoever is matched is heard
    until(lambda: heard, "the command")
    assert (heard[0].linear.x, heard[0].angular.z) == (0.25, -0.5)
    assert len(heard) == 1


def test_latched_messages_wait_for_latecomers(
    robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    info = MapMetaData(resolution=0.05, width=300, height=200)
    grid = OccupancyGrid(Header.of(1, "map"), info, np.ones(60_000, np.int8))
    maps = robot.publisher("/map", OccupancyGrid, LATCHED)
    maps.publish(grid)
    one, two = robot.publisher("/two", String, LATCHED), robot.publisher("/two", String, LATCHED)
    two.publish(String("of the second"))
    one.publish(String("old"))
    one.publish(String("of the first"))
    until(lambda: {"/map", "/two"} <= set(bridge.topics.outward), "the topics")
    peer = peers()
    peer.read("rt/map", "OccupancyGrid", "latched")
    peer.read("rt/two", "String", "latched all")
    assert until(lambda: peer.take("rt/map"), "the map") == [["map", 300, 200, 60_000, 60_000]]
    got: list[str] = []
    until(lambda: got.extend(peer.take("rt/two")) or len(got) >= 2, "both publishers' last words")
    assert sorted(got) == ["of the first", "of the second"]


def test_latched_messages_come_in_late(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    peer = peers()
    peer.write("rt/note", "String", "latched")
    peer.say("rt/note", "said early")
    until(lambda: "/note" in bridge.topics.inward, "the topic")
    heard: list[str] = []
    robot.subscription("/note", String, lambda one: heard.append(one.data), QoS(durability=TRANSIENT_LOCAL))
    until(lambda: heard, "what was said early")
    later: list[str] = []
    robot.subscription("/note", String, lambda one: later.append(one.data), QoS(durability=TRANSIENT_LOCAL))
    until(lambda: later, "the same for a second listener")
    assert (heard, later) == (["said early"], ["said early"])


def test_nothing_comes_back(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """A topic on which both sides speak and listen, as /tf: each word once on either side."""
    heard: list[str] = []
    robot.subscription("/both", String, lambda one: heard.append(one.data))
    ours = robot.publisher("/both", String)
    peer = peers()
    peer.read("rt/both", "String")
    peer.write("rt/both", "String")
    until(lambda: peer.matched("rt/both") == peer.sources("rt/both") == 2, "itself and the bridge")
    until(lambda: len(robot.wire.graph.topics()["/both"].takers) == 2, "the bridge's listener on Zenoh")
    peer.take("rt/both")
    heard.clear()
    for number in range(50):
        ours.publish(String(f"zenoh {number}"))
        peer.say("rt/both", f"dds {number}")
    told = {f"zenoh {n}" for n in range(50)} | {f"dds {n}" for n in range(50)}
    got: list[str] = []
    until(lambda: got.extend(peer.take("rt/both")) or len(got) >= 100, "all on DDS")
    until(lambda: len(heard) >= 100, "all on Zenoh")
    time.sleep(0.3)  # what goes round in a circle would come now
    got.extend(peer.take("rt/both"))
    assert len(got) == len(heard) == 100
    assert set(got) == set(heard) == told


def test_graph_is_told_as_ros_tells_it(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """User data, and which node has which GIDs."""
    robot.publisher("scan", LaserScan)
    robot.subscription("cmd_vel", Twist, lambda _: None)
    peer = peers()
    readers = until(lambda: peer.ends("readers"), "a reader")
    assert ["rt/robot1/cmd_vel", "geometry_msgs::msg::dds_::Twist_"] in [one[:2] for one in readers]
    writer = until(
        lambda: [one for one in peer.ends("writers") if one[0] == "rt/robot1/scan"], "the scan's writer"
    )[0]
    assert writer[1:3] == [
        "sensor_msgs::msg::dds_::LaserScan_",
        f"typehash={WireType.of(LaserScan).hash};",
    ]
    reader = next(one for one in readers if one[0] == "rt/robot1/cmd_vel")
    graph = until(
        lambda: [one for one in peer.graph() if one == ["/robot1/base", [reader[3]], [writer[3]]]],
        "the node with both",
    )
    assert len(graph) == 1
    assert "/chefbot_dds" in [one[0] for one in peer.graph()]
    assert peer.participants() == ["enclave=/;"]


def test_zenoh_sees_what_dds_has(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    peer = peers()
    peer.write("rt/far", "Twist", "best_effort")
    graph = robot.wire.graph
    until(lambda: "/far" in graph.topics() and graph.topics()["/far"].givers, "a publisher")
    end = graph.topics()["/far"].givers[0].end
    assert end.type == WireType.of(Twist)
    assert not end.qos.reliable
    peer.forget("rt/far")
    until(lambda: "/far" not in graph.topics(), "its end")


def test_best_effort_writer_is_heard(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """On DDS alone a reliable listener would not match it."""
    heard: list[Twist] = []
    robot.subscription("/soft", Twist, heard.append)
    peer = peers()
    peer.write("rt/soft", "Twist", "best_effort")

    def said() -> bool:
        peer.say("rt/soft", 1.0, 2.0)
        return bool(heard)

    until(said, "the message")


def test_unknown_and_other_types_are_named(
    robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    heard: list[Twist] = []
    robot.subscription("/clash", Twist, heard.append)
    robot.raw_publisher("/foreign", WireType("elsewhere_msgs/msg/Other", "RIHS01_" + "0" * 64))
    peer = peers()
    peer.write("rt/strange", "Unheard")
    peer.write("rt/clash", "String")
    peer.write("rt/version", "String", "", "RIHS01_" + "1" * 64)
    left_out = until(
        lambda: len(bridge.topics.left_out) >= 4 and bridge.topics.left_out, "four topics left out"
    )
    assert "elsewhere_msgs/msg/Unheard" in left_out["/strange"]
    assert "elsewhere_msgs/msg/Other" in left_out["/foreign"]
    assert "std_msgs/msg/String" in left_out["/clash"]
    assert "std_msgs/msg/String" in left_out["/version"]
    peer.say("rt/clash", "no twist")
    ours = robot.publisher("/alive", String)
    peer.read("rt/alive", "String")
    until(lambda: ours.heard, "the bridge that goes on")
    assert not heard


def test_ends_that_do_not_fit_are_named(
    robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    """DDS itself is silent about both."""
    robot.subscription("/cut", Twist, lambda _: None)
    robot.publisher("/soft", LaserScan, SENSOR)
    peer = peers()
    peer.write("rt/cut", "Shorter")
    peer.read("rt/soft", "LaserScan")
    left_out = until(
        lambda: {"/cut", "/soft"} <= bridge.topics.left_out.keys() and bridge.topics.left_out, "two sentences"
    )
    assert "other fields" in left_out["/cut"]
    assert "/robot1/base is not heard" in left_out["/soft"]
    assert "best effort is offered" in left_out["/soft"]


@pytest.mark.parametrize("cut", [1, 4, 40])
def test_truncated_from_zenoh_is_counted(
    robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer], cut: int
) -> None:
    ours = robot.publisher("/speed", Twist)
    peer = peers()
    peer.read("rt/speed", "Twist")
    until(lambda: ours.heard and peer.sources("rt/speed"), "a listener")
    ours.publish_cdr(Twist.of(0.5, 0.0).to_cdr()[:-cut])
    reasons = until(bridge.tally.counts, "the refusal")
    assert [one for one in reasons if one.startswith("/speed: ")]
    ours.publish(Twist.of(0.25, 0.0))
    assert until(lambda: peer.take("rt/speed"), "the next one") == [[0.25, 0.0]]


def test_flood_from_dds_is_survived(robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """What goes too fast may be lost; the rest goes on and so do other topics."""
    heard: list[Twist] = []
    calm: list[str] = []
    robot.subscription("/speed", Twist, heard.append)
    robot.subscription("/calm", String, lambda one: calm.append(one.data))
    peer = peers()
    peer.write("rt/speed", "Twist")
    peer.write("rt/calm", "String")
    until(lambda: peer.matched("rt/speed") and peer.matched("rt/calm"), "two readers")
    peer.flood("rt/speed", 20_000, 0.1, 0.0)
    peer.say("rt/calm", "still here")
    until(lambda: calm, "the other topic")
    assert heard


def test_killed_peer_and_router_are_replaced(
    port: int, domain: int, monkeypatch: pytest.MonkeyPatch, peers: Callable[[], Peer]
) -> None:
    """The bridge's own session finds the wire again when the router's process is gone."""
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    first = Wire(port=port)
    with Wire(port=port) as wire:
        one = DdsBridge(wire, Place(domain, "lo"), lambda _: True)
        doomed = Peer(domain)
        doomed.write("rt/last_words", "String")
        until(lambda: "/last_words" in one.topics.inward, "a peer")
        doomed.close(kill=True)
        first.close()
        peer = peers()
        with Wire(port=port) as other, WireNode(other, "base") as node:
            words = node.publisher("/words", String)
            peer.read("rt/words", "String")
            until(lambda: words.heard and peer.sources("rt/words"), "the bridge on the wire again")
            words.publish(String("here"))
            assert until(lambda: peer.take("rt/words"), "the word") == ["here"]
        one.close()


def test_cyclones_own_tool_reads_the_types(robot: WireNode, bridge: DdsBridge, domain: int) -> None:
    """`cyclonedds typeof` prints as IDL what it was told of a type."""
    tool = Path(sys.executable).with_name("cyclonedds")
    robot.publisher("/scan", LaserScan)
    until(lambda: "/scan" in bridge.topics.outward, "the topic")
    command = [str(tool), "typeof", "rt/scan", "-i", str(domain), "--color", "none"]

    def told() -> str:
        environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
        found = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment)
        return found.stdout if "LaserScan_" in found.stdout else ""

    told_type = until(told, "the type")
    fields = [line.split()[-1].rstrip(";") for line in told_type.splitlines() if line.strip().endswith(";")]
    names = [one for one in fields if one.isidentifier()]
    assert names[-10:] == ["header", *LaserScan.__struct_fields__[1:]]


def test_bad_words_on_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence each, before anything is opened."""
    for words, wanted in (
        ((300, [], "lo"), "domain 300"),
        ((None, ["/no topic"], "lo"), "/no topic"),
    ):
        with pytest.raises(UserError, match=wanted):
            run_dds(*words)
    monkeypatch.setitem(sys.modules, "chefbot.wire.dds.bridge", None)
    monkeypatch.delitem(sys.modules, "chefbot.wire.dds.bridge")
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    with pytest.raises(UserError, match="pip install 'chefbot\\[dds\\]'"):
        run_dds(None, [], "lo")


def test_no_such_interface_is_said(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    with pytest.raises(UserError, match="no_such_0"):
        Place(domain, "no_such_0")


def test_peers_and_robots_come_back(
    port: int, robot: WireNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    peer = peers()
    with Wire(port=port, router=False) as other, WireNode(other, "guest") as guest:
        words = guest.publisher("/words", String)
        peer.read("rt/words", "String")
        until(lambda: words.heard, "the bridge")
    until(lambda: "/words" not in bridge.topics.outward, "its end")
    until(lambda: not [one for one in peer.ends("writers") if one[0] == "rt/words"], "its end on DDS")
    with Wire(port=port, router=False) as other, WireNode(other, "guest") as guest:
        words = guest.publisher("/words", String)
        until(lambda: words.heard, "the bridge again")
        until(lambda: peer.sources("rt/words"), "the writer again")
        words.publish(String("back"))
        assert until(lambda: peer.take("rt/words"), "the word") == ["back"]
