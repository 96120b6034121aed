"""The bridge between DDS and Zenoh: QoS, types and routes, without a network."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.ros_graph import graph_of, token

from chefbot.errors import ChefbotError
from chefbot.msgs.rmw_dds_common import ParticipantEntitiesInfo
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.errors import ErrorCounter
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import DEFAULT, SENSOR_DATA, TRANSIENT_LOCAL_QOS, QoS, QosDuration

pytest.importorskip("cyclonedds")

from cyclonedds.core import InstanceState, Policy

from chefbot.ros2.dds import discovery_info
from chefbot.ros2.dds.dds_to_zenoh import HEADER, DdsToZenohRoute, _reader_qos
from chefbot.ros2.dds.discovery import Discovery, RemoteEndpoint
from chefbot.ros2.dds.qos import from_dds, to_dds, to_dds_writer, type_hash_of
from chefbot.ros2.dds.topic_endpoints import TopicEndpoints, choose_type, endpoints_by_topic, same_type
from chefbot.ros2.dds.topic_endpoints import unmatched_publishers as unmatched
from chefbot.ros2.dds.zenoh_to_dds import ZenohToDdsRoute

PROFILES = st.builds(
    lambda reliability, durability, history, depth: QoS(reliability, durability, history, depth),
    *(st.sampled_from([1, 2]) for _ in range(3)),
    st.integers(1, 1000),
)
SCAN, TEXT = InterfaceType.of(LaserScan), InterfaceType.of(String)


def remote(handle: int, writes: bool, kind: InterfaceType, qos: QoS = DEFAULT) -> RemoteEndpoint:
    return RemoteEndpoint(handle, writes, "/scan", kind, qos)


@given(PROFILES)
def test_qos_round_trips_through_dds(qos: QoS) -> None:
    back = from_dds(to_dds(qos))
    assert (back.reliable, back.latched, back.history) == (qos.reliable, qos.latched, qos.history)
    assert back.depth == (qos.depth if qos.history == 1 else 1)


@given(st.text("0123456789abcdef", min_size=64, max_size=64))
def test_the_type_hash_travels_in_the_user_data(digits: str) -> None:
    assert type_hash_of(to_dds(DEFAULT, f"RIHS01_{digits}")) == f"RIHS01_{digits}"
    assert type_hash_of(to_dds(DEFAULT)) == ""


def test_a_latched_writer_keeps_its_history_for_late_readers() -> None:
    writer = to_dds_writer(TRANSIENT_LOCAL_QOS._replace(depth=7, lifespan=QosDuration(2, 5)))
    service = writer[Policy.DurabilityService]
    assert service is not None and service.history.depth == 7
    assert writer[Policy.Lifespan].lifespan == 2_000_000_005
    assert to_dds_writer(DEFAULT)[Policy.DurabilityService] is None


@pytest.mark.parametrize("offers", [[], [DEFAULT], [SENSOR_DATA], [DEFAULT, SENSOR_DATA]])
def test_a_reader_requests_no_more_than_all_writers_offer(offers: list[QoS]) -> None:
    qos = _reader_qos([TRANSIENT_LOCAL_QOS], offers)
    assert qos.reliable == all(one.reliable for one in offers)
    assert qos.latched == all(one.latched for one in offers)


def sample(topic: str, type_name: str, alive: bool = True, own: bool = False) -> Any:
    state = InstanceState.Alive if alive else InstanceState.NotAliveDisposed
    info = SimpleNamespace(instance_handle=5, instance_state=state)
    key = "own" if own else "other"
    return SimpleNamespace(
        sample_info=info, topic_name=topic, type_name=type_name, participant_key=key, qos=to_dds(DEFAULT)
    )


def found(*samples: Any) -> Discovery:
    one = Discovery.__new__(Discovery)
    one._own, one._remotes = "own", {}
    for each in samples:
        one._update(each, True)
    return one


def test_ros_topics_of_others_are_discovered_until_they_end() -> None:
    ros = sample("rt/scan", "sensor_msgs::msg::dds_::LaserScan_")
    (one,) = found(ros).remotes(writing=True)
    assert (one.topic, one.type.name) == ("/scan", SCAN.name)
    assert found(ros).remotes(writing=False) == []
    assert found(ros, sample("rt/scan", "", alive=False)).remotes(writing=True) == []


@pytest.mark.parametrize(
    "other",
    [
        sample("rq/service", "a::srv::dds_::B_"),
        sample("plain", "a::msg::dds_::B_"),
        sample("rt/x", "NoRosType"),
        sample("rt/scan", "sensor_msgs::msg::dds_::LaserScan_", own=True),
    ],
    ids=["service", "plain", "type", "own"],
)
def test_other_endpoints_are_ignored(other: Any) -> None:
    assert found(other).remotes(writing=True) == []


def test_a_missing_hash_matches_by_name() -> None:
    humble = InterfaceType(SCAN.name, "")
    assert same_type(SCAN, humble) and same_type(humble, SCAN) and same_type(SCAN, SCAN)
    assert not same_type(SCAN, TEXT) and not same_type(SCAN, InterfaceType(SCAN.name, "RIHS01_other"))


def test_the_known_type_is_bridged_and_the_others_are_named() -> None:
    other = InterfaceType("their_msgs/msg/Thing", "RIHS01_1")
    both = TopicEndpoints(writers=(remote(1, True, other), remote(2, True, SCAN)))
    kind, reason = choose_type(both)
    assert kind is LaserScan and "their_msgs/msg/Thing" in reason
    assert choose_type(TopicEndpoints(writers=(remote(1, True, SCAN),))) == (LaserScan, "")
    kind, reason = choose_type(TopicEndpoints(writers=(remote(1, True, other),)))
    assert kind is None and "no definition" in reason
    assert both.of_type(SCAN).writers == both.writers[1:]


def test_endpoints_of_both_sides_are_joined_by_topic() -> None:
    graph, *_ = graph_of(token("a", "MP", "/scan", SCAN), token("a", "MP", "/spin/_action/status", TEXT))
    wire: Any = SimpleNamespace(graph=graph, zid="ff")
    one = found(sample("rt/scan", "sensor_msgs::msg::dds_::LaserScan_"))
    topics = endpoints_by_topic(wire, one)
    assert list(topics) == ["/scan"], "topics of actions are hidden"
    assert len(topics["/scan"].publishers) == len(topics["/scan"].writers) == 1
    wire.zid = "1a"
    assert endpoints_by_topic(wire, one)["/scan"].publishers == (), "the bridge's own endpoints"


def test_publishers_that_a_dds_reader_cannot_match_are_named() -> None:
    graph, *_ = graph_of(token("a", "MP", "/scan", SCAN, SENSOR_DATA))
    publishers = graph.topics()["/scan"].providers
    text = unmatched(TopicEndpoints(publishers, readers=(remote(1, False, SCAN, DEFAULT),)))
    assert "/a does not match" in text and "best effort" in text
    assert unmatched(TopicEndpoints(publishers, readers=(remote(1, False, SCAN, SENSOR_DATA),))) == ""


def test_nodes_are_announced_only_when_they_change(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[Any] = []
    writer = SimpleNamespace(write=written.append)
    monkeypatch.setattr(discovery_info, "Topic", lambda *_: None)
    monkeypatch.setattr(discovery_info, "DataWriter", lambda *_: writer)
    monkeypatch.setattr(discovery_info, "sample", lambda _, data: ParticipantEntitiesInfo.from_cdr(data))
    guid = SimpleNamespace(bytes=bytes(range(16)))
    announcer = discovery_info.NodeAnnouncer(SimpleNamespace(guid=guid))
    graph, *_ = graph_of(token("b", "MP", "/scan", SCAN), token("a", "MP", "/scan", SCAN))
    nodes = [one.node for one in graph.tokens()]
    for _ in range(2):
        announcer.publish(nodes, {}, {"/a": [b"x" * 16]})
    (info,) = written
    assert [one.node_name for one in info.node_entities_info_seq] == ["a", "b"]
    assert [len(one.writer_gid_seq) for one in info.node_entities_info_seq] == [1, 0]
    announcer.publish(nodes[:1], {}, {})
    assert len(written) == 2


def test_early_messages_wait_and_truncated_ones_are_refused() -> None:
    route = ZenohToDdsRoute(None, None, SimpleNamespace(destroy=lambda _: None), "/text", String)  # type: ignore[arg-type]
    cdr, attachment = String("hello").to_cdr(), Attachment(1, 2, b"g" * 16)
    route._receive(cdr, attachment)
    assert len(route._early) == 1 and route.gids() == []
    route._writers[attachment.gid] = SimpleNamespace(data_type=None, write=None)
    with pytest.raises(ChefbotError):
        route._receive(cdr[:-3], attachment)


def test_samples_are_copied_with_a_plain_header_or_counted() -> None:
    sent: list[bytes] = []
    counter = ErrorCounter()
    node: Any = SimpleNamespace(
        raw_publisher=lambda *_: SimpleNamespace(publish_cdr=sent.append), destroy=lambda _: None
    )
    route = DdsToZenohRoute((None, None, None), node, "/text", TEXT, counter)
    data = String("hello").to_cdr()

    def arrives(cdr: bytes, writer: int = 1) -> None:
        route._publish_sample(
            SimpleNamespace(cdr=cdr, sample_info=SimpleNamespace(publication_handle=writer))
        )

    arrives(data)
    assert sent == [], "its publisher does not exist yet"
    route.update([remote(1, True, TEXT)], [])
    assert sent == [data]
    arrives(data[:3] + b"\3" + data[4:])
    assert sent[-1] == data and sent[-1][:4] == HEADER
    arrives(b"\0\0\0\0" + data[4:])
    assert sum(counter.counts().values()) == 1 and not route.copy() and route.gid is None
    arrives(data, writer=9)
    route.update([remote(1, True, TEXT)], [])
    assert sum(counter.counts().values()) == 2, "its writer is gone"
    route.close()
    assert route.unmatched_reason() == ""
