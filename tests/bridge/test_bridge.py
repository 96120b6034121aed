"""A running system as others on the wire see it, and what they can and cannot do to it."""

from __future__ import annotations

import re
import time
from pathlib import Path

import msgspec
import pytest
from tests.support.bridged_loop import launch_of, ready_client, running
from tests.support.waiting import PATIENCE, in_time, wait_for

from chefbot.bridge.attach import open_wire
from chefbot.bridge.bridged_actions import ABORTED_WITHOUT_REASON
from chefbot.bridge.inbox import WIRE_PUBLISHER
from chefbot.errors import UserError
from chefbot.fleet.secure_router import ExternalEndpoints
from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_CANCELED, STATUS_SUCCEEDED
from chefbot.msgs.chefbot_msgs import Deliver, Deliver_Goal, Deliver_Result
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.rcl_interfaces import (
    DOUBLE,
    DescribeParameters,
    DescribeParameters_Request,
    GetParameters,
    GetParameters_Request,
    ListParameters,
    ListParameters_Request,
    Log,
    Parameter,
    ParameterEvent,
    ParameterValue,
    SetParameters,
    SetParameters_Request,
)
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.std_msgs import Float64, String
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.names import InterfaceType, topic_key
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK, ROSOUT, TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.node_restart import RECOVER_TOPIC
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.replay import Replay


def test_node_topics_are_bridged_in_both_directions(port: int) -> None:
    with running(port, "doubler") as one:
        double = one.subscribe("/double", Float64)
        count = one.outsider.publisher("/count", Float64)
        one.wait_until_joined(count, "doubler", "double")
        count.publish(Float64(21.0))
        assert double.get(timeout=PATIENCE).data == 42.0


def test_nodes_appear_in_the_graph_with_their_endpoints(port: int) -> None:
    with running(port, "counter", "doubler", "cook", "guest") as one:
        graph = one.outside.graph
        wanted = {"/counter", "/doubler", "/cook", "/guest", "/metronome"}
        wanted |= {"/chefbot", "/chefbot_tf", "/outsider"}
        assert graph.wait_for(lambda graph: {node.full_name for node in graph.nodes()} == wanted, PATIENCE)
        assert graph.wait_for(lambda graph: "/tf_static" in graph.topics(), PATIENCE)
        assert [end.node.name for end in graph.topics()["/count"].providers] == ["counter"]
        assert [end.node.name for end in graph.topics()["/count"].consumers] == ["doubler"]
        action = graph.actions()["/deliver"]
        assert [end.node.name for end in action.providers] == ["cook"]
        assert [end.node.name for end in action.consumers] == ["guest"]
        assert action.types[0].name == "chefbot_msgs/action/Deliver"
        assert graph.mismatches() == []


def test_the_simulation_clock_is_published(port: int) -> None:
    with running(port, "counter") as one:
        clock = one.subscribe("/clock", Clock, CLOCK)
        first, second = (clock.get(timeout=PATIENCE).clock.ns for _ in range(2))
        assert second - first == 100_000_000


@pytest.mark.slow
def test_latched_messages_reach_late_subscribers(port: int) -> None:
    with running(port, "cook", "guest") as one:
        wait_for(lambda: one.system.nodes["guest"].results)
        dishes = one.subscribe("/dishes", String, TRANSIENT_LOCAL_QOS)
        wait_for(lambda: dishes.get(timeout=PATIENCE).data == "salad")  # "soup" may still be on its way


@pytest.mark.slow
def test_invalid_messages_are_reported_and_not_delivered(port: int) -> None:
    with running(port, "doubler") as one:
        double, diagnostics = (
            one.subscribe("/double", Float64),
            one.subscribe("/diagnostics", DiagnosticArray),
        )
        logs = one.subscribe("/rosout", Log, ROSOUT)
        count = one.outsider.publisher("/count", Float64)
        key = topic_key(0, "/count", InterfaceType.of(Float64))
        one.wait_until_joined(count, "doubler", "double")
        count.publish(Float64(float("nan")))
        one.outside.session.put(key, b"\0\1\0\0abc", attachment=Attachment(1, 1, b"\0" * 16).pack())
        one.outside.session.put(key, Float64(1.0).to_cdr())
        count.publish(Float64(2.0))
        assert double.get(timeout=PATIENCE).data == 4.0
        counts: dict[str, str] = {}
        while len(counts) < 3:
            counts |= {v.key: v.value for v in diagnostics.get(timeout=PATIENCE).status[0].values}
        assert "/count: data is nan" in counts and "/count: no attachment" in counts
        assert logs.get(timeout=PATIENCE).msg.startswith("/count: ")


def test_notices_are_published_on_rosout(port: int) -> None:
    with running(port, "doubler") as one:
        logs = one.subscribe("/rosout", Log, ROSOUT)
        one.system.loop.post(lambda: one.system.loop.publish("x/notice", String("mind the step"), "doubler"))
        log = logs.get(timeout=PATIENCE)
        assert (log.name, log.msg) == ("doubler", "mind the step")


@pytest.mark.slow
def test_a_cmd_vel_publisher_is_named_the_right_topic_once(port: int) -> None:
    with running(port, "base") as one:
        logs = one.subscribe("/rosout", Log, ROSOUT)
        notices: list[str] = []
        one.system.loop.add_observer(
            lambda one: notices.append(one.message.data) if one.topic == "wire/notice" else None
        )
        one.outsider.publisher("/cmd_vel", Twist)
        sentence = "/outsider publishes on cmd_vel, which the drive base ignores: drive by cmd_vel_teleop"
        wait_for(lambda: any(log.msg == sentence for log in list(logs.queue)))
        one.outsider.publisher("/another", Twist)  # the crowd changes, and is looked at again
        looked = len(one.wire.graph.topics())
        wait_for(lambda: notices)
        wait_for(lambda: len(one.wire.graph.topics()) >= looked)
        assert notices == [f"Warning: {sentence}."]


def test_a_late_node_receives_latched_external_messages(port: int) -> None:
    with RmwContext(port=port) as wire, RmwNode(wire, "elsewhere") as node:
        node.publisher("/count", Float64, TRANSIENT_LOCAL_QOS).publish(Float64(3.0))
        with running(port, "doubler") as one:
            count = one.system.nodes["doubler"].count
            wait_for(lambda: count.last is not None)
            assert count.last.data == 3.0


@pytest.mark.slow
def test_a_publisher_that_comes_later_is_queried_for_its_history(port: int) -> None:
    with running(port, "doubler") as one:
        count = one.system.nodes["doubler"].count
        with RmwContext(port=port, router=False) as wire, RmwNode(wire, "elsewhere") as node:
            node.publisher("/count", Float64, TRANSIENT_LOCAL_QOS).publish(Float64(5.0))
            wait_for(lambda: count.last is not None and count.last.data == 5.0)
            before = one.bridge._proxies._subscriptions["count"]
            wait_for(lambda: one.bridge._proxies._subscriptions["count"] is not before or before.latched)
            takers = lambda: one.outside.graph.topics()["/count"].consumers  # noqa: E731
            wait_for(lambda: [end.info.qos.latched for end in takers()] == [True])


@pytest.mark.timed
@pytest.mark.slow
def test_a_flood_is_dropped_and_the_loop_stays_on_time(port: int) -> None:
    with running(port, "counter", "doubler") as one:
        late: list[float] = []
        last = [time.monotonic()]

        def look(publication) -> None:
            if publication.publisher == "counter":
                now = time.monotonic()
                late.append(now - last[0] - 0.1)
                last[0] = now

        one.system.loop.add_observer(look)
        count = one.outsider.publisher("/count", Float64)
        wait_for(lambda: count.has_subscribers and len(late) > 1)
        late.clear()
        until = time.monotonic() + 1.5
        while time.monotonic() < until:
            for _ in range(100):
                count.publish(Float64(1.0))
            time.sleep(0.005)
        counts = one.wire.rejected.counts()
        assert counts["/count: receive queue is full, the oldest message is dropped"] > 1000
        assert late and in_time(sorted(late)[len(late) // 2], 0.05), late


@pytest.mark.slow
def test_an_action_of_the_loop_serves_external_clients(port: int) -> None:
    with running(port, "cook") as one:
        client = ActionClient(one.outsider, "/deliver", Deliver)
        wait_for(lambda: client.served)
        status, result = client.send_goal_async(Deliver_Goal(("tea",))).result.result(PATIENCE)
        assert (status, result.delivered) == (STATUS_SUCCEEDED, ("tea",))
        slow = client.send_goal_async(
            Deliver_Goal(("a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"))
        )
        wait_for(lambda: one.system.nodes["cook"].deliver.busy)
        slow.cancel().result(PATIENCE)
        assert slow.result.result(PATIENCE)[0] == STATUS_CANCELED


def test_a_node_calls_an_external_action_server(port: int) -> None:
    with RmwContext(port=port) as wire, RmwNode(wire, "far_cook") as node:

        def accept(goal_id, goal) -> bool:
            server.execute(goal_id)
            server.finish(goal_id, STATUS_SUCCEEDED, Deliver_Result(goal.places))
            return True

        server = ActionServer(node, "/deliver", Deliver, accept, lambda _: False)
        with running(port, "guest") as one:
            wait_for(lambda: one.system.nodes["guest"].results)
            assert one.system.nodes["guest"].results[0].delivered == ("soup", "salad")
            again = one.system.nodes["guest"]
            one.system.loop.post(lambda: again.spawn(again.order(("pie",))))
            wait_for(lambda: len(again.results) == 2)
            assert again.results[1].delivered == ("pie",)


def test_an_abort_without_an_error_code_is_a_failure(port: int) -> None:
    """Nav2 ends a goal so when another one takes its place: aborted, and a result that names no fault."""
    with RmwContext(port=port) as wire, RmwNode(wire, "far_cook") as node:

        def accept(goal_id, goal) -> bool:
            server.execute(goal_id)
            server.finish(goal_id, STATUS_ABORTED, Deliver_Result())
            return True

        server = ActionServer(node, "/deliver", Deliver, accept, lambda _: False)
        with running(port, "guest") as one:
            wait_for(lambda: one.system.nodes["guest"].results)
            result = one.system.nodes["guest"].results[0]
            assert result.error_code == ABORTED_WITHOUT_REASON
            assert result.error_msg.startswith("deliver aborted the goal")


@pytest.mark.slow
def test_a_call_without_a_server_fails_with_a_reason(port: int) -> None:
    with running(port, "guest") as one:
        wait_for(lambda: one.system.nodes["guest"].results)
        result = one.system.nodes["guest"].results[0]
        assert result.error_code != 0 and "/deliver" in result.error_msg


def test_parameters_are_listed_read_and_refused_with_a_reason(port: int) -> None:
    with running(port, "counter") as one:

        def call(name, service, request):
            return ready_client(one.outsider, f"/counter/{name}", service).call(request, PATIENCE)

        listed = call("list_parameters", ListParameters, ListParameters_Request()).result
        assert listed.names == ("step", "use_sim_time")
        got = call("get_parameters", GetParameters, GetParameters_Request(("step", "nothing"))).values
        assert (got[0].type, got[0].double_value, got[1].type) == (DOUBLE, 1.0, 0)
        described = call("describe_parameters", DescribeParameters, DescribeParameters_Request(("step",)))
        bounds = described.descriptors[0].floating_point_range[0]
        assert (described.descriptors[0].description, bounds.to_value) == ("m", 10.0)
        requested = [("step", 2.0), ("step", 11.0), ("stepp", 1.0), ("use_sim_time", 1.0)]
        values = (Parameter(n, ParameterValue(DOUBLE, double_value=v)) for n, v in requested)
        answers = call("set_parameters", SetParameters, SetParameters_Request(tuple(values))).results
        reasons = ["when it starts", "11.0 must be at most 10", "did you mean 'step'", "cannot be changed"]
        for answer, reason in zip(answers, reasons, strict=True):
            assert not answer.successful and reason in answer.reason


def test_parameters_are_set_where_the_node_allows_it(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.runtime.toys import Counter

    monkeypatch.setattr(Counter, "live_params", ("step",))
    with running(port, "counter") as one:
        events = one.subscribe("/parameter_events", ParameterEvent)
        client = ready_client(one.outsider, "/counter/set_parameters", SetParameters)
        value = ParameterValue(DOUBLE, double_value=5.0)
        answer = client.call(SetParameters_Request((Parameter("step", value),)), PATIENCE)
        assert answer.results[0].successful
        assert one.system.nodes["counter"].params.step == 5.0
        assert events.get(timeout=PATIENCE).changed_parameters[0].name == "step"


def test_parameters_are_those_of_a_node_created_again(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.runtime.toys import Counter

    monkeypatch.setattr(Counter, "live_params", ("step",))
    with running(port, "counter") as one:
        setter = ready_client(one.outsider, "/counter/set_parameters", SetParameters)
        getter = ready_client(one.outsider, "/counter/get_parameters", GetParameters)
        first, loop = one.system.nodes["counter"], one.system.loop
        loop.post(lambda: loop.publish(RECOVER_TOPIC, String("counter"), "test", from_device=True))
        wait_for(lambda: one.system.nodes["counter"] is not first)
        value = ParameterValue(DOUBLE, double_value=5.0)
        answer = setter.call(SetParameters_Request((Parameter("step", value),)), PATIENCE)
        assert answer.results[0].successful
        assert getter.call(GetParameters_Request(("step",)), PATIENCE).values[0].double_value == 5.0


@pytest.mark.slow
def test_a_run_with_external_nodes_replays_bit_identically(port: int, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with running(port, "doubler", "cook", record=path) as one:
        count = one.outsider.publisher("/count", Float64)
        wait_for(lambda: count.has_subscribers)
        for number in range(30):
            count.publish(Float64(float(number)))
            time.sleep(0.01)
        client = ActionClient(one.outsider, "/deliver", Deliver)
        wait_for(lambda: client.served)
        assert client.send_goal_async(Deliver_Goal(("tea",))).result.result(PATIENCE)[0] == STATUS_SUCCEEDED
    log = read_log(path)
    assert sum(one.publisher == WIRE_PUBLISHER for one in log.messages) > 10
    replay = Replay(log)
    replay.run()
    assert replay.differences == []
    assert replay.compared > 10


TAKEN = "another launch with a node /(cook|metronome) runs on this machine"
"""Whichever of its nodes is discovered first."""


def test_a_second_launch_with_equal_names_stays_off_the_network(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", str(port))
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    reported: list[str] = []
    with running(port, "cook"):
        args = {"wire": "auto", "speed": 1.0, "namespace": ""}
        launch = msgspec.structs.replace(launch_of(("cook",)), args=args)
        with open_wire(launch, ExternalEndpoints(), reported.append) as wire:
            assert wire is None
        assert re.search(TAKEN, reported[0])
        insists = msgspec.structs.replace(launch, args={**args, "wire": "on"})
        with (
            pytest.raises(UserError, match=TAKEN),
            open_wire(insists, ExternalEndpoints(), reported.append),
        ):
            pass
    odd = msgspec.structs.replace(launch, args={**args, "wire": "of"})
    with (
        pytest.raises(UserError, match="wire:=of must be one of"),
        open_wire(odd, ExternalEndpoints(), reported.append),
    ):
        pass
