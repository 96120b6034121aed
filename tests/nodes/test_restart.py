"""Tests that restarted nodes continue from their restored messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.support.nodes import ROOM, WITHOUT_SENSORS, FakeNavigator, NodeRunner

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import (
    Deliver,
    Deliver_Goal,
    DeliveryStatus,
    EmergencyStopStatus,
    ExplorationStatus,
    Order,
)
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.safety.stop_latch import ESTOP_STATE_UNKNOWN


def start_delivery(restored: dict[str, Message]) -> NodeRunner:
    kinds = {
        "delivery": "chefbot.nodes.delivery:DeliveryNode",
        "driver": "tests.support.nodes:FakeNavigator",
        "people": "tests.support.nodes:FakeStaff",
    }
    return NodeRunner(kinds, restored)


@pytest.fixture
def delivery() -> Iterator[Callable[..., NodeRunner]]:
    def begin(*, fails: int = 0, **restored: Message) -> NodeRunner:
        FakeNavigator.fails = fails
        return start_delivery(restored)

    yield begin
    FakeNavigator.fails = 0


def reached_places(runner: NodeRunner) -> list[str]:
    names = {x: name for name, x in ROOM.items()}
    node: Any = runner.system.nodes["driver"]
    return [names[x] for x in node.goals]


def status(state: str, place: str, queue: tuple[str, ...] = (), done: tuple[str, ...] = ()) -> DeliveryStatus:
    loaded = place != "kitchen"
    return DeliveryStatus(Header(), state, place, queue, done, "", loaded=loaded)


@pytest.mark.parametrize(
    ("restored", "places", "done"),
    [
        (status("driving", "kitchen", ("table_1",)), ["kitchen", "table_1", "home"], ("table_1",)),
        (status("loading", "kitchen", ("table_1",)), ["kitchen", "table_1", "home"], ("table_1",)),
        (status("driving", "table_1", ("table_2",)), ["table_1", "table_2", "home"], ("table_1", "table_2")),
        (status("waiting", "table_2", (), ("table_1",)), ["table_2", "home"], ("table_1", "table_2")),
        (status("returning", "home", (), ("table_1",)), ["home"], ("table_1",)),
        (status("idle", "", (), ("table_1",)), [], ("table_1",)),
    ],
)
def test_a_restarted_waiter_resumes_its_current_order(
    delivery: Callable[..., NodeRunner], restored: DeliveryStatus, places: list[str], done: tuple[str, ...]
) -> None:
    runner = delivery(delivery_status=restored)
    runner.run(60.0)
    assert reached_places(runner) == places
    last = runner.messages("delivery_status")[-1]
    assert (last.state, tuple(last.delivered)) == ("idle", done)


def orders(*tables: str) -> tuple[Order, ...]:
    return tuple(Order((table,), table) for table in tables)


def test_pending_and_missed_orders_survive_a_waiter_restart(delivery: Callable[..., NodeRunner]) -> None:
    restored = DeliveryStatus(
        Header(),
        "returning",
        "home",
        (),
        ("table_1",),
        "",
        ("table 7 was not reached",),
        orders("table_2"),
    )
    runner = delivery(delivery_status=restored)
    runner.run(0.5)
    assert [status.skipped_reasons for status in runner.messages("delivery_status")] == [
        restored.skipped_reasons
    ]
    runner.run(60.0)
    assert reached_places(runner) == ["home", "kitchen", "table_2", "home"]
    statuses: list[DeliveryStatus] = runner.messages("delivery_status")
    assert any(
        status.state == "failed" and status.skipped_reasons == restored.skipped_reasons for status in statuses
    )
    last = statuses[-1]
    assert last.delivered == ("table_2",) and not last.pending_orders and not last.skipped_reasons


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from(["order", "repeat", "restart", "wait"]), max_size=12))
@pytest.mark.slow
def test_accepted_orders_are_served_once_in_order_over_restarts(steps: list[str]) -> None:
    runner, count, served, restored = start_delivery({}), 0, list[str](), dict[str, Message]()
    names = [f"order {number}" for number in range(len(steps))]

    def order(number: int) -> None:
        runner.loop.publish("order", Order((f"table_{1 + number % 2}",), names[number]), "web_ui")
        runner.run(0.01)
        assert names[number] in runner.messages("delivery_status")[-1].accepted, (
            "the order is reported as accepted"
        )

    for step in (*steps, "restart"):
        if step == "order":
            order(count)
            count += 1
        elif step == "repeat" and count:
            order(count - 1)
        elif step == "wait":
            runner.run(3.0)
        elif step == "restart":
            served += reached_places(runner)
            statuses = runner.messages("delivery_status")
            restored = {"delivery_status": statuses[-1]} if statuses else restored
            runner = start_delivery(restored)
    runner.run(30.0 * (count + 1))
    served += reached_places(runner)
    tables = [
        place for place, after in pairwise([*served, ""]) if place.startswith("table") and place != after
    ]
    assert tables == [f"table_{1 + number % 2}" for number in range(count)]


@pytest.mark.parametrize("released", [False, True])
def test_a_waiter_restarted_during_emergency_stop_stays_held(
    delivery: Callable[..., NodeRunner], released: bool
) -> None:
    stop = EmergencyStopStatus(Header(), not released, False, Time.of(5))
    runner = delivery(delivery_status=status("driving", "table_1", ("table_2",)), stop_status=stop)
    runner.loop.publish("emergency_stop", Bool(not released), "base")
    runner.run(60.0)
    last = runner.messages("delivery_status")[-1]
    assert not reached_places(runner) and (last.state, last.place, last.queue) == (
        "driving",
        "table_1",
        ("table_2",),
    )
    assert last.hold_reason == ("choice" if released else "stop")
    runner.loop.publish("order", Order(("table_1",)), "web_ui")
    runner.loop.publish("round_choice", String("go_on"), "web_ui")
    runner.run(60.0)
    assert reached_places(runner) == (
        ["table_1", "table_2", "kitchen", "table_1", "home"] if released else []
    )


def test_emergency_stop_holds_a_resumed_order_before_it_starts(delivery: Callable[..., NodeRunner]) -> None:
    runner = delivery(delivery_status=status("driving", "table_1"))
    runner.loop.publish("emergency_stop", Bool(True), "base")
    runner.run(60.0)
    assert not reached_places(runner) and runner.messages("delivery_status")[-1].hold_reason == "stop"


def test_a_goal_of_another_client_is_queued_behind_the_orders(delivery: Callable[..., NodeRunner]) -> None:
    runner = delivery()
    runner.run(0.1)
    for table in ("table_1", "table_2"):
        runner.loop.publish("order", Order((table,)), "web_ui")
    runner.run(3.0)
    goal = Deliver.send_goal(UUID(np.arange(16, dtype=np.uint8)), Deliver_Goal(("table_1",)))
    runner.loop.publish("deliver/_action/send_goal", goal, "tool")
    runner.run(120.0)
    assert reached_places(runner) == [
        "kitchen",
        "table_1",
        "kitchen",
        "table_2",
        "kitchen",
        "table_1",
        "home",
    ]
    (outcome,) = runner.messages("deliver/_action/get_result")
    assert outcome.result.delivered == ("table_1",)


def test_robot_is_never_idle_between_orders(delivery: Callable[..., NodeRunner]) -> None:
    """A client would take the state idle for the end of the delivery."""
    runner = delivery(delivery_status=status("driving", "table_1"))
    runner.run(3.0)
    assert [status.state for status in runner.messages("delivery_status")] == ["driving", "waiting"]


def test_a_first_start_waits_for_an_order(delivery: Callable[..., NodeRunner]) -> None:
    runner = delivery()
    runner.run(1.0)
    assert [status.state for status in runner.messages("delivery_status")] == ["idle"]
    runner.loop.publish("order", Order(("table_1",)), "web_ui")
    runner.run(60.0)
    assert reached_places(runner) == ["kitchen", "table_1", "home"]


@pytest.mark.parametrize(("fails", "arrives"), [(3, True), (1000, False)])
def test_a_restarting_navigator_is_retried_for_a_limited_time(
    delivery: Callable[..., NodeRunner], fails: int, arrives: bool
) -> None:
    runner = delivery(fails=fails, delivery_status=status("driving", "table_1"))
    runner.run(120.0)
    assert ("table_1" in runner.messages("delivery_status")[-1].delivered) == arrives
    assert (runner.messages("delivery_status")[-1].state == "idle") == arrives


@pytest.mark.parametrize(
    ("kind", "topic", "message"),
    [
        ("chefbot.nodes.global_localizer:GlobalLocalizerNode", "localized", Bool(True)),
        ("chefbot.nodes.explorer:ExplorerNode", "exploration_status", ExplorationStatus(Header(), True)),
    ],
)
def test_a_restored_result_needs_no_new_search(kind: str, topic: str, message: Message) -> None:
    for restored, searches in (({topic: message}, False), ({}, True)):
        runner = NodeRunner({"node": kind}, restored)
        runner.run(1.0)
        assert bool(runner.messages("spin/_action/send_goal")) == searches
        assert [item.to_cdr() for item in runner.messages(topic)] == ([] if searches else [message.to_cdr()])


def test_robot_stands_until_all_processes_run() -> None:
    runner = NodeRunner({"base": "chefbot.nodes.drive_base:DriveBaseNode"}, {}, {"base": WITHOUT_SENSORS})

    def drive(topic: str) -> float:
        """Publish a velocity for a second and return the angular velocity of the left wheel, rad/s."""
        for _ in range(20):
            runner.loop.publish(topic, Twist.of(0.2, 0.0), "client")
            runner.run(0.05)
        return float(runner.messages("wheel_speeds")[-1].left)

    assert drive("cmd_vel_nav") > 2.0
    for name in ("slam", "web_ui"):
        runner.loop.publish("process_lost", String(name), "wire")
    runner.run(0.0)
    assert runner.messages("wheel_speeds")[-1].left == 0.0
    assert drive("cmd_vel_nav") == 0.0
    runner.loop.publish("process_back", String("slam"), "wire")
    assert drive("cmd_vel_nav") == 0.0
    assert drive("cmd_vel_teleop") > 2.0
    runner.loop.publish("process_back", String("web_ui"), "wire")
    runner.run(2.0)
    assert drive("cmd_vel_nav") > 2.0


class Base(NodeRunner):
    """A drive base whose emergency stop the test requests and observes."""

    def __init__(self, **restored: Message) -> None:
        super().__init__(
            {"base": "chefbot.nodes.drive_base:DriveBaseNode"}, restored, {"base": WITHOUT_SENSORS}
        )
        self.run(0.001)

    def request(self, topic: str, stop: bool) -> None:
        self.loop.publish(topic, Bool(stop), "client")
        self.run(0.001)

    @property
    def stopped(self) -> bool:
        return bool(self.messages("emergency_stop")[-1].data)

    @property
    def status(self) -> EmergencyStopStatus:
        found = self.messages("stop_status")[-1]
        assert isinstance(found, EmergencyStopStatus)
        return found

    def drives(self) -> bool:
        """Publish a velocity and return whether the wheels turn."""
        self.run(0.5)
        for _ in range(10):
            self.loop.publish("cmd_vel_teleop", Twist.of(0.2, 0.0), "client")
            self.run(0.05)
        return float(self.messages("wheel_speeds")[-1].left) > 0.0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["stop_request", "emergency_stop"]), st.booleans()), max_size=8))
def test_emergency_stop_has_one_state_that_the_wheels_obey(
    messages: list[tuple[str, bool]],
) -> None:
    """Any client may set it on either topic; only a request releases it."""
    runner, stopped = Base(), False
    for topic, value in messages:
        runner.request(topic, value)
        stopped = value if topic == "stop_request" else stopped or value
        assert runner.stopped == runner.status.active == stopped
    assert runner.drives() != stopped
    restarted = Base(stop_status=runner.status, restarted=Empty())
    assert restarted.stopped == restarted.status.active == stopped
    assert restarted.status.pressed_at == runner.status.pressed_at
    assert restarted.drives() != stopped
    restarted.request("stop_request", False)
    assert restarted.drives()


def test_a_base_with_unknown_stop_state_is_stopped_with_a_reason() -> None:
    runner = Base(restarted=Empty())
    assert runner.stopped and not runner.drives()
    assert runner.messages("base/notice")[-1].data == runner.status.description == ESTOP_STATE_UNKNOWN
    runner.request("stop_request", False)
    assert runner.drives()
    first = Base()
    assert not first.stopped and first.drives() and not first.messages("base/notice")


def test_tables_may_be_named_informally(delivery: Callable[..., NodeRunner]) -> None:
    runner = delivery()
    runner.loop.publish("order", Order(("2", "Table 1"), "x"), "client")
    runner.run(60.0)
    assert reached_places(runner) == ["kitchen", "table_2", "table_1", "home"]


def test_an_unknown_table_is_rejected_with_the_nearest_name(delivery: Callable[..., NodeRunner]) -> None:
    runner = delivery()
    runner.loop.publish("order", Order(("1", "tabel_2"), "x"), "client")
    runner.run(1.0)
    last = runner.messages("delivery_status")[-1]
    assert last.description == "On this map there is no place called 'tabel_2' (did you mean 'table_2'?)."
    assert reached_places(runner) == [] and last.state == "failed"
