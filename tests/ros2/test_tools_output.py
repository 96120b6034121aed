"""What the ROS graph tools print, from a graph without a network."""

from __future__ import annotations

import json
import threading
from concurrent.futures import CancelledError
from concurrent.futures import TimeoutError as NoTimeLeftError
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.support.ros_graph import graph_of, node, token

from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_SUCCEEDED
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.liveliness import Token
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import DEFAULT, SENSOR_DATA, TRANSIENT_LOCAL_QOS, QosDuration
from chefbot.ros2.tools import action, service, subscribe, topic_pub
from chefbot.ros2.tools.bag import info_lines as bag_lines
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.graph import describe
from chefbot.ros2.tools.health import graph_problems
from chefbot.ros2.tools.subscribe import SampleStream, no_message_reasons
from chefbot.ros2.tools.topic_info import info_lines, list_lines, qos_text

SCAN, TEXT = InterfaceType.of(LaserScan), InterfaceType.of(String)


def graph() -> Graph:
    one, *_ = graph_of(
        Token(node("base"), None),
        Token(node("slam"), None),
        token("base", "MP", "/scan", SCAN, SENSOR_DATA),
        token("slam", "MS", "/scan", SCAN, SENSOR_DATA),
        token("slam", "MP", "/map", TEXT, TRANSIENT_LOCAL_QOS),
        token("_tool", "MS", "/map", TEXT),
        token("base", "MS", "/missing", TEXT),
        token("slam", "MP", "/_hidden", TEXT),
    )
    return one


def test_topics_are_listed_with_endpoints_but_without_tools() -> None:
    assert list_lines(graph(), False, False) == ["/map", "/missing", "/scan"]
    assert "/_hidden" in list_lines(graph(), False, True)
    rows = [line.split() for line in list_lines(graph(), True, False)]
    assert ["/map", "std_msgs/msg/String", "1", "0"] in rows
    assert ["/scan", "sensor_msgs/msg/LaserScan", "1", "1"] in rows


def test_topic_info_names_endpoints_and_qos() -> None:
    lines = info_lines(graph(), graph().topics()["/map"])
    assert lines[0] == "/map" and "subscribed to by: none" in lines
    assert any("/slam" in line and "transient local" in line for line in lines)


def test_qos_is_readable() -> None:
    assert qos_text(DEFAULT) == "reliable, volatile, keep last 10"
    assert qos_text(SENSOR_DATA).startswith("best effort, volatile")
    assert qos_text(DEFAULT._replace(deadline=QosDuration(0, 500_000_000))).endswith("deadline 0.5 s")


def test_reasons_for_a_silent_topic() -> None:
    assert no_message_reasons(graph(), "/missing") == ["there is no publisher of /missing"]
    assert no_message_reasons(graph(), "/scan") == ["/scan has no messages, although /base publish it"]


def test_the_graph_as_json_has_nodes_topics_and_rates() -> None:
    data = json.loads(json.dumps(describe(graph(), {"/scan": {"hz": 10.0}})))
    assert data["nodes"] == ["/base", "/slam"]
    (scan,) = [one for one in data["topics"] if one["name"] == "/scan"]
    assert (scan["publishers"], scan["subscriptions"], scan["hz"]) == (["/base"], ["/slam"], 10.0)
    assert {one["name"]: one["latched"] for one in data["topics"]}["/map"] is True
    assert data["mismatches"] == []


def test_duplicate_names_and_mismatches_are_problems() -> None:
    one, *_ = graph_of(
        Token(node("base", 1), None),
        Token(node("base", 2), None),
        token("base", "MP", "/scan", SCAN, SENSOR_DATA),
        token("slam", "MS", "/scan", SCAN),
    )
    problems = graph_problems(one)
    assert problems[0] == "! 2 nodes are called /base"
    assert len(problems) == 2 and "best effort" in problems[1]
    assert graph_problems(graph()) == []


def test_samples_of_all_types_are_streamed_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subscribe, "MAX_QUEUED", 2)
    callbacks: dict[InterfaceType, Any] = {}

    def raw_subscription(_: str, kind: InterfaceType, callback: Any, *__: Any, **___: Any) -> None:
        callbacks[kind] = callback

    one, *_ = graph_of(token("a", "MP", "/x", SCAN), token("b", "MP", "/x", TEXT))
    where: Any = SimpleNamespace(wire=SimpleNamespace(graph=one), raw_subscription=raw_subscription)
    stream, stop = SampleStream(where, one.topics()["/x"]), threading.Event()
    for kind, data in ((SCAN, b"1"), (TEXT, b"2"), (TEXT, b"3")):
        callbacks[kind](data, None)
    samples = stream.samples(None, stop)
    assert [next(samples), next(samples)] == [(SCAN, b"1"), (TEXT, b"2")] and stream.missed == 1
    stop.set()
    assert list(samples) == []


class Handle:
    """A goal that is running for some polls and then ends with `outcome`."""

    def __init__(self, outcome: Any, polls: int = 0) -> None:
        self.outcome, self.polls, self.cancelled = outcome, polls, 0

    def cancel(self) -> None:
        self.cancelled += 1

    def result(self, timeout: float) -> Any:
        assert timeout > 0.0
        self.polls -= 1
        if self.polls >= 0:
            raise NoTimeLeftError
        if isinstance(self.outcome, Exception):
            raise self.outcome
        return self.outcome


def awaited(handle: Handle, stop: threading.Event | None = None) -> int:
    goal: Any = SimpleNamespace(result=handle, cancel=handle.cancel)
    return action._await(goal, "/spin", stop or threading.Event())


def test_the_exit_code_is_that_of_the_goal(capsys: pytest.CaptureFixture[str]) -> None:
    assert awaited(Handle((STATUS_SUCCEEDED, String("done")), 3)) == 0
    assert awaited(Handle((STATUS_ABORTED, String("no")))) == 1
    shown = capsys.readouterr().out
    assert "status: succeeded" in shown and "status: aborted" in shown
    with pytest.raises(ToolError, match="/spin"):
        awaited(Handle(CancelledError("closed")))


def test_a_stopped_goal_is_cancelled_once() -> None:
    stop = threading.Event()
    stop.set()
    handle = Handle((STATUS_SUCCEEDED, String("done")), 5)
    assert awaited(handle, stop) == 0 and handle.cancelled == 1


def test_a_service_without_a_server_is_reported_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def call(*_: Any) -> None:
        raise NoTimeLeftError

    client, destroyed = SimpleNamespace(server_is_ready=True, call=call), list[Any]()
    where: Any = SimpleNamespace(client=lambda *_: client, destroy=destroyed.append)
    kind: Any = None
    with pytest.raises(ToolError, match="gave no answer in 2 s"):
        service.call(where, "/x", kind, String(), 2.0)
    assert destroyed == [client]


def test_published_values_are_checked_and_complete() -> None:
    clock: Any = SimpleNamespace(now=lambda: Time.of(1))
    make = topic_pub._maker(Twist, {"linear": {"x": 0.25}}, "/cmd_vel", clock)
    message = make()
    assert isinstance(message, Twist) and message.linear.x == 0.25 and message.angular.z == 0.0
    with pytest.raises(InvalidMessageError, match="/cmd_vel"):
        topic_pub._maker(Twist, {"linaer": {}}, "/cmd_vel", clock)()


def test_bag_info_lists_topics_with_rates() -> None:
    topics = [
        SimpleNamespace(name="/scan", kind=SCAN, messages=11),
        SimpleNamespace(name="/map", kind=TEXT, messages=1),
    ]
    bag: Any = SimpleNamespace(
        path=Path("bag"), files=[Path("a.mcap")], size=1000, distro="jazzy", start_ns=0, end_ns=1_000_000_000,
        total=12, topics=topics, truncated=["a.mcap is cut off"],
    )  # fmt: skip
    lines = bag_lines(bag)
    rows = [line.split() for line in lines]
    assert ["/scan", "sensor_msgs/msg/LaserScan", "11", "10.00"] in rows
    assert ["/map", "std_msgs/msg/String", "1"] in rows
    assert lines[-1] == "! a.mcap is cut off" and "made for jazzy" in lines[0]
