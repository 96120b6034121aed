"""Queues, QoS matching, environment and graph of the ROS middleware, without a network."""

from __future__ import annotations

import threading
from collections import defaultdict
from types import SimpleNamespace

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st
from tests.support.ros_graph import graph_of, node, token

from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw import thread_state
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.environment import domain_from_environment, port_from_environment
from chefbot.ros2.rmw.errors import ErrorCounter, SessionError
from chefbot.ros2.rmw.graph import EndpointGroup
from chefbot.ros2.rmw.liveliness import Token
from chefbot.ros2.rmw.message_queues import MessageQueues
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import DEFAULT, SENSOR_DATA, QoS, incompatible
from chefbot.ros2.rmw.qos_matching import best_matching_qos, offered_types
from chefbot.ros2.rmw.subscription import MAX_PUBLISHERS, is_new

OFFERS = st.builds(
    lambda reliability, durability, depth: QoS(reliability, durability, depth=depth),
    st.sampled_from([1, 2]),
    st.sampled_from([1, 2]),
    st.integers(1, 100),
)


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(1, 4)), max_size=40))
def test_queues_keep_the_newest_per_key_in_order_of_arrival(puts: list[tuple[str, int]]) -> None:
    dropped = ErrorCounter()
    queues: MessageQueues[tuple[str, int]] = MessageQueues(dropped, "too slow")
    depth = {"a": 1, "b": 2, "c": 3}
    kept: dict[str, list[int]] = defaultdict(list)
    for number, (key, _) in enumerate(puts):
        queues.put(key, (key, number), depth[key])
        kept[key] = [*kept[key], number][-depth[key] :]
    taken = [item for _ in range(len(puts) + 1) if (item := queues.take(0.0)) is not None]
    assert sorted(number for _, number in taken) == sorted(
        number for numbers in kept.values() for number in numbers
    )
    for key in "abc":
        assert [number for name, number in taken if name == key] == kept[key]
    assert sum(dropped.counts().values()) == len(puts) - len(taken)


def test_a_waiting_reader_is_woken_by_a_message() -> None:
    dropped, found = ErrorCounter(), list[int | None]()
    queues: MessageQueues[int] = MessageQueues(dropped, "too slow")
    reader = threading.Thread(target=lambda: found.append(queues.take(60.0)))
    reader.start()
    queues.put("a", 1, 1)
    reader.join()
    queues.put("a", 2, 1, count_drops=False)
    queues.put("a", 3, 1, count_drops=False)
    assert found == [1] and queues.take(0.0) == 3 and queues.take(0.0) is None
    assert sum(dropped.counts().values()) == 0


@given(st.lists(OFFERS, max_size=5))
def test_the_best_qos_matches_every_offer(offers: list[QoS]) -> None:
    chosen = best_matching_qos(offers)
    assert all(incompatible(offer, chosen) == [] for offer in offers)
    if not offers:
        assert chosen == DEFAULT
    else:
        assert chosen.reliable == all(one.reliable for one in offers)
        assert chosen.latched == all(one.latched for one in offers)
        assert chosen.depth >= max(one.depth for one in offers)


@pytest.mark.parametrize("text", ["", " ", "0", "7", "232"])
def test_a_valid_domain_is_read_from_the_environment(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    assert domain_from_environment() == int(text.strip() or 0)


@pytest.mark.parametrize("text", ["-1", "seven", "70000", "1.0", "\u0663"])
def test_invalid_numbers_in_the_environment_are_refused(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", text)
    for read in (domain_from_environment, port_from_environment):
        with pytest.raises(SessionError, match="must be a number between"):
            read()


SCAN, TEXT = InterfaceType.of(LaserScan), InterfaceType.of(String)


def test_endpoints_are_grouped_by_name() -> None:
    graph, *_ = graph_of(
        Token(node("a", 0), None),
        token("a", "MP", "/scan", SCAN),
        token("b", "MS", "/scan", SCAN),
        token("b", "MS", "/text", TEXT),
    )
    assert [one.name for one in graph.nodes()] == ["a"]
    topics = graph.topics()
    assert list(topics) == ["/scan", "/text"] and graph.services() == {}
    assert [one.node.name for one in topics["/scan"].providers] == ["a"]
    assert [one.info.topic for one in graph.endpoints_of("/b")] == ["/scan", "/text"]
    assert offered_types(topics["/text"]) == [TEXT], "types of subscribers count without a publisher"


def test_incompatible_qos_and_types_are_mismatches() -> None:
    graph, *_ = graph_of(
        token("a", "MP", "/scan", SCAN, SENSOR_DATA),
        token("b", "MS", "/scan", SCAN),
        token("a", "MP", "/text", TEXT),
        token("b", "MS", "/text", SCAN),
    )
    reasons = graph.mismatches()
    assert len(reasons) == 2
    assert any("/scan" in one and "best effort" in one for one in reasons)
    assert any("/text" in one for one in reasons)


def test_deleted_and_invalid_tokens_are_not_in_the_graph() -> None:
    one = token("a", "MP", "/scan", SCAN)
    graph, session, refused = graph_of(one)
    changes: list[int] = []
    graph.on_change(lambda: changes.append(len(graph.tokens())))
    session.send(str(one), zenoh.SampleKind.DELETE)
    session.send("nonsense")
    assert changes == [0, 0] and graph.topics() == {}
    assert sum(refused.counts().values()) == 1
    assert not graph.wait_for(lambda found: found.topics(), 0.0)
    assert graph.wait_for(lambda found: not found.topics(), 0.0)


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(1, 6)), max_size=30))
def test_a_sample_counts_once_per_publisher(samples: list[tuple[int, int]]) -> None:
    seen: dict[int, int] = {}
    last: dict[bytes, int] = {}
    for publisher, sequence in samples:
        new = is_new(Attachment(sequence, 0, bytes([publisher]) * 16), last)
        assert new == (sequence > seen.get(publisher, 0))
        seen[publisher] = max(seen.get(publisher, 0), sequence)
    assert len(last) <= MAX_PUBLISHERS


def test_the_thread_state_is_kept_once_per_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    api = SimpleNamespace(PyGILState_Ensure=lambda: calls.append(1))
    monkeypatch.setattr(thread_state.ctypes, "pythonapi", api)
    monkeypatch.setattr(thread_state, "_known", set())
    for _ in range(3):
        thread_state.keep_thread_state()
    assert calls == [1]


def test_an_empty_group_offers_no_type() -> None:
    assert offered_types(EndpointGroup("/x", (), (), ())) == []
