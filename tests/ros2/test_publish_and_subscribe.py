"""Two real processes over a real router."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest
from tests.support.waiting import PATIENCE, in_time

from chefbot.msgs.action_msgs import CANCEL_NONE, STATUS_CANCELED, STATUS_SUCCEEDED, GoalStatusArray
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.std_srvs import SetBool, SetBool_Request, Trigger, Trigger_Request
from chefbot.ros2.rmw.action_client import ActionClient, GoalRejectedError
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.names import InterfaceType, topic_key
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import SENSOR_DATA, TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.service import NoResponseError
from chefbot.ros2.rmw.session import RmwContext


@pytest.fixture
def node(wire: RmwContext, other: Callable) -> RmwNode:
    other("peer")
    assert wire.graph.wait_for(lambda graph: "/far/navigate_to_pose" in graph.actions(), PATIENCE)
    return RmwNode(wire, "tester", "/far")


def wait_for_subscriber(publisher) -> None:
    until = time.monotonic() + PATIENCE
    while not publisher.has_subscribers:
        assert time.monotonic() < until
        time.sleep(0.005)


def test_a_twist_makes_the_round_trip(node: RmwNode) -> None:
    got: queue.Queue[Twist] = queue.Queue()
    node.subscription("echo", Twist, got.put)
    publisher = node.publisher("twist", Twist)
    wait_for_subscriber(publisher)
    for count in range(1, 21):
        publisher.publish(Twist.of(0.1 * count, -0.5))
        assert got.get(timeout=PATIENCE).to_cdr() == Twist.of(0.1 * count, -0.5).to_cdr()


def test_a_receiving_thread_keeps_its_python_state(node: RmwNode) -> None:
    """A new state for each message would cost a fifth more; what hangs on it would be gone, too."""
    calls = threading.local()
    counts: queue.Queue[tuple[int, int]] = queue.Queue()

    def take(_: Twist) -> None:
        calls.count = getattr(calls, "count", 0) + 1
        counts.put((threading.get_native_id(), calls.count))

    node.subscription("echo", Twist, take)
    publisher = node.publisher("twist", Twist)
    wait_for_subscriber(publisher)
    for _ in range(9):
        publisher.publish(Twist())
    counted = [counts.get(timeout=PATIENCE) for _ in range(9)]
    for thread in {thread for thread, _ in counted}:  # Zenoh may take another one
        mine = [count for one, count in counted if one == thread]
        assert mine == list(range(1, len(mine) + 1))


def test_a_picture_makes_the_round_trip(node: RmwNode) -> None:
    got: queue.Queue[Image] = queue.Queue()
    node.subscription("image_back", Image, got.put)
    publisher = node.publisher("image", Image)
    wait_for_subscriber(publisher)
    picture = np.random.default_rng(1).integers(0, 255, (480, 640, 3), np.uint8)
    until = time.monotonic() + PATIENCE
    while got.empty() and time.monotonic() < until:  # the peer's publisher may not know this subscription yet
        publisher.publish(Image.of(Header.of(1, "camera"), "rgb8", picture))
        time.sleep(0.05)
    assert np.array_equal(got.get(timeout=PATIENCE).pixels, picture)


def test_a_late_subscriber_gets_the_latched_message(node: RmwNode) -> None:
    got: queue.Queue[String] = queue.Queue()
    node.subscription("latched", String, got.put, TRANSIENT_LOCAL_QOS)
    assert got.get(timeout=PATIENCE).data == "early"


def test_a_latched_subscriber_receives_a_volatile_publisher(node: RmwNode) -> None:
    got: queue.Queue[Twist] = queue.Queue()
    node.subscription("echo", Twist, got.put, TRANSIENT_LOCAL_QOS)
    publisher = node.publisher("twist", Twist)
    wait_for_subscriber(publisher)
    until = time.monotonic() + PATIENCE
    while got.empty() and time.monotonic() < until:
        publisher.publish(Twist.of(1.0, 0.0))
        time.sleep(0.02)
    assert got.get(timeout=PATIENCE).linear.x == 1.0


def test_a_service_call_is_answered(node: RmwNode) -> None:
    client = node.client("switch", SetBool)
    for value in (True, False, True):
        response = client.call(SetBool_Request(value), PATIENCE)
        assert (response.success, response.message) == (value, "from the other process")


def test_a_call_to_a_missing_service_fails(node: RmwNode) -> None:
    with pytest.raises(NoResponseError, match="/far/nothing"):
        node.client("nothing", Trigger).call(Trigger_Request(), PATIENCE)


def test_an_action_gives_feedback_and_a_result(node: RmwNode) -> None:
    status: queue.Queue[GoalStatusArray] = queue.Queue()
    node.subscription("navigate_to_pose/_action/status", GoalStatusArray, status.put, TRANSIENT_LOCAL_QOS)
    client = ActionClient(node, "navigate_to_pose", NavigateToPose)
    distances: list[float] = []
    handle = client.send_goal_async(
        NavigateToPose_Goal(), lambda feedback: distances.append(feedback.distance_remaining)
    )
    ended, result = handle.result.result(PATIENCE)
    assert (ended, result.error_msg) == (STATUS_SUCCEEDED, "there")
    assert distances == [3.0, 2.0, 1.0]
    states = []
    while STATUS_SUCCEEDED not in states:
        states = [one.status for one in status.get(timeout=PATIENCE).status_list]


def test_an_action_is_cancelled(node: RmwNode) -> None:
    client = ActionClient(node, "navigate_to_pose", NavigateToPose)
    begun: queue.Queue[object] = queue.Queue()
    handle = client.send_goal_async(NavigateToPose_Goal(behavior_tree="slow"), begun.put)
    begun.get(timeout=PATIENCE)
    response = handle.cancel().result(PATIENCE)
    assert response.return_code == CANCEL_NONE
    assert [one.goal_id.key for one in response.goals_canceling] == [handle.goal_id.key]
    assert handle.result.result(PATIENCE)[0] == STATUS_CANCELED


def test_an_unwanted_goal_is_rejected(node: RmwNode) -> None:
    client = ActionClient(node, "navigate_to_pose", NavigateToPose)
    with pytest.raises(GoalRejectedError):
        client.send_goal_async(NavigateToPose_Goal(behavior_tree="unwanted")).result.result(PATIENCE)


def test_the_graph_lists_the_endpoints_of_another_process(node: RmwNode) -> None:
    graph = node.wire.graph
    names = {"/far/other", "/far/tester"}
    assert graph.wait_for(lambda graph: names == {one.full_name for one in graph.nodes()}, PATIENCE)
    topics = graph.topics()
    assert topics["/far/echo"].types == (InterfaceType.of(Twist),)
    assert [one.node.full_name for one in topics["/far/echo"].providers] == ["/far/other"]
    assert [one.node.full_name for one in graph.services()["/far/switch"].providers] == ["/far/other"]
    assert graph.actions()["/far/navigate_to_pose"].types[0].name == "nav2_msgs/action/NavigateToPose"
    assert graph.mismatches() == []


def test_incompatible_endpoints_are_reported(node: RmwNode) -> None:
    graph = node.wire.graph
    node.subscription("echo", LaserScan, lambda _: None)
    node.publisher("twist", Twist, SENSOR_DATA)
    old = InterfaceType("geometry_msgs/msg/Twist", "RIHS01_" + "0" * 64)
    node.raw_subscription("echo", old, lambda *_: None)
    assert graph.wait_for(lambda one: len(one.mismatches()) == 3, PATIENCE), graph.mismatches()
    text = "\n".join(graph.mismatches())
    assert "/far/echo: /far/other and /far/tester cannot communicate" in text
    assert "geometry_msgs/msg/Twist in two versions" in text
    assert "/far/twist: /far/tester and /far/other: best effort is offered" in text


def test_invalid_messages_are_counted_and_refused(node: RmwNode) -> None:
    got: queue.Queue[Twist] = queue.Queue()
    wire = node.wire
    node.subscription("strange", Twist, got.put)
    key = topic_key(0, "/far/strange", InterfaceType.of(Twist))
    good = Attachment(1, 1, b"\0" * 16).pack()
    wire.session.put(key, Twist().to_cdr())
    wire.session.put(key, Twist().to_cdr(), attachment=b"short")
    wire.session.put(key, Twist().to_cdr()[:20], attachment=good)
    wire.session.put(key, b"", attachment=good)
    wire.session.put(key, Twist.of(1.0, 2.0).to_cdr(), attachment=good)
    assert got.get(timeout=PATIENCE).linear.x == 1.0
    assert sum(wire.rejected.counts().values()) == 4
    assert all(reason.startswith("/far/strange: ") for reason in wire.rejected.counts())


def test_an_unknown_liveliness_token_is_counted_and_refused(wire: RmwContext) -> None:
    token = wire.session.liveliness().declare_token("@ros2_lv/0/abc/0/0/XX/%/%/ghost")
    assert wire.graph.wait_for(lambda _: sum(wire.rejected.counts().values()) == 1, PATIENCE)
    assert "ghost" in next(iter(wire.rejected.counts()))
    token.undeclare()


def test_a_closed_node_leaves_the_graph(wire: RmwContext, other: Callable) -> None:
    process = other("peer")
    assert wire.graph.wait_for(lambda graph: "/far/echo" in graph.topics(), PATIENCE)
    process.kill()
    assert wire.graph.wait_for(lambda graph: not graph.tokens(), PATIENCE)


@pytest.mark.slow
def test_a_killed_router_is_replaced_and_all_nodes_reconnect(port: int, other: Callable) -> None:
    router = other("router")
    with RmwContext(port=port) as wire, RmwNode(wire, "tester", "/far") as node:
        other("peer")
        assert not wire.is_router
        others = lambda graph: len([one for one in graph.nodes() if one.name == "other"])  # noqa: E731
        assert wire.graph.wait_for(lambda graph: others(graph) == 2, PATIENCE)
        router.kill()
        assert wire.graph.wait_for(lambda graph: others(graph) == 1, PATIENCE)
        assert wire.graph.wait_for(lambda _: wire.is_router and wire.connected, PATIENCE)
        assert node.client("switch", SetBool).call(SetBool_Request(True), PATIENCE).success
        other("peer")  # one that comes later finds them through the new router
        assert wire.graph.wait_for(lambda graph: others(graph) == 2, PATIENCE)


@pytest.mark.timed
def test_opening_and_closing_a_context_is_quick(port: int) -> None:
    times = []
    for _ in range(5):
        began = time.perf_counter()
        with RmwContext(port=port) as wire:
            times.append(time.perf_counter() - began)
            assert wire.is_router
    assert in_time(min(times), 0.020)


@pytest.mark.slow
def test_a_node_started_before_the_router_connects_later(port: int) -> None:
    with RmwContext(port=port, router=False) as early, RmwNode(early, "early"):
        time.sleep(0.3)
        assert not early.connected
        with RmwContext(port=port) as late:
            assert early.graph.wait_for(lambda _: early.connected, PATIENCE)
            assert late.graph.wait_for(
                lambda graph: [one.name for one in graph.nodes()] == ["early"], PATIENCE
            )
