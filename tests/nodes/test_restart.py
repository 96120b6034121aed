"""Nodes in a second life: they are told what the first one said last, before anything else happens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.support.nodes import ROOM, Driver, Life

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


def waiter_of(words: dict[str, Message]) -> Life:
    kinds = {
        "delivery": "chefbot.nodes.delivery:DeliveryNode",
        "driver": "tests.support.nodes:Driver",
        "people": "tests.support.nodes:People",
    }
    return Life(kinds, words)


@pytest.fixture
def waiter() -> Iterator[Callable[..., Life]]:
    def begin(*, fails: int = 0, **words: Message) -> Life:
        Driver.fails = fails
        return waiter_of(words)

    yield begin
    Driver.fails = 0


def driven(life: Life) -> list[str]:
    names = {x: name for name, x in ROOM.items()}
    node: Any = life.system.nodes["driver"]
    return [names[x] for x in node.driven]


def status(state: str, place: str, queue: tuple[str, ...] = (), done: tuple[str, ...] = ()) -> DeliveryStatus:
    loaded = place != "kitchen"
    return DeliveryStatus(Header(), state, place, queue, done, "", loaded=loaded)


@pytest.mark.parametrize(
    ("told", "then", "done"),
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
    waiter: Callable[..., Life], told: DeliveryStatus, then: list[str], done: tuple[str, ...]
) -> None:
    life = waiter(delivery_status=told)
    life.run(60.0)
    assert driven(life) == then
    last = life.heard("delivery_status")[-1]
    assert (last.state, tuple(last.delivered)) == ("idle", done)


def orders(*tables: str) -> tuple[Order, ...]:
    return tuple(Order((table,), table) for table in tables)


def test_pending_and_missed_orders_survive_a_waiter_restart(waiter: Callable[..., Life]) -> None:
    told = DeliveryStatus(
        Header(),
        "returning",
        "home",
        (),
        ("table_1",),
        "",
        ("table 7 was not reached",),
        orders("table_2"),
    )
    life = waiter(delivery_status=told)
    life.run(0.5)
    assert [one.skipped_reasons for one in life.heard("delivery_status")] == [told.skipped_reasons]
    life.run(60.0)
    assert driven(life) == ["home", "kitchen", "table_2", "home"]
    said: list[DeliveryStatus] = life.heard("delivery_status")
    assert any(one.state == "failed" and one.skipped_reasons == told.skipped_reasons for one in said)
    assert said[-1].delivered == ("table_2",) and not said[-1].pending_orders and not said[-1].skipped_reasons


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from(["order", "again", "die", "wait"]), max_size=12))
def test_accepted_orders_are_served_once_in_order_over_restarts(steps: list[str]) -> None:
    life, count, served, told = waiter_of({}), 0, list[str](), dict[str, Message]()
    names = [f"order {number}" for number in range(len(steps))]

    def order(number: int) -> None:
        life.loop.publish("order", Order((f"table_{1 + number % 2}",), names[number]), "page")
        life.run(0.01)
        assert names[number] in life.heard("delivery_status")[-1].accepted, "it is told that it was accepted"

    for step in (*steps, "die"):
        if step == "order":
            order(count)
            count += 1
        elif step == "again" and count:
            order(count - 1)
        elif step == "wait":
            life.run(3.0)
        elif step == "die":
            served += driven(life)
            said = life.heard("delivery_status")
            told = {"delivery_status": said[-1]} if said else told
            life = waiter_of(told)
    life.run(30.0 * (count + 1))
    served += driven(life)
    tables = [one for one, after in pairwise([*served, ""]) if one.startswith("table") and one != after]
    assert tables == [f"table_{1 + number % 2}" for number in range(count)]


@pytest.mark.parametrize("released", [False, True])
def test_a_waiter_restarted_during_emergency_stop_stays_held(
    waiter: Callable[..., Life], released: bool
) -> None:
    stop = EmergencyStopStatus(Header(), not released, Time.of(5))
    life = waiter(delivery_status=status("driving", "table_1", ("table_2",)), stop_status=stop)
    life.loop.publish("emergency_stop", Bool(not released), "base")
    life.run(60.0)
    last = life.heard("delivery_status")[-1]
    assert not driven(life) and (last.state, last.place, last.queue) == ("driving", "table_1", ("table_2",))
    assert last.hold_reason == ("choice" if released else "stop")
    life.loop.publish("order", Order(("table_1",)), "page")
    life.loop.publish("round_choice", String("go_on"), "page")
    life.run(60.0)
    assert driven(life) == (["table_1", "table_2", "home", "kitchen", "table_1", "home"] if released else [])


def test_emergency_stop_holds_a_resumed_order_before_it_starts(waiter: Callable[..., Life]) -> None:
    life = waiter(delivery_status=status("driving", "table_1"))
    life.loop.publish("emergency_stop", Bool(True), "base")
    life.run(60.0)
    assert not driven(life) and life.heard("delivery_status")[-1].hold_reason == "stop"


def test_a_goal_of_another_client_is_queued_behind_the_orders(waiter: Callable[..., Life]) -> None:
    life = waiter()
    life.run(0.1)
    for table in ("table_1", "table_2"):
        life.loop.publish("order", Order((table,)), "page")
    life.run(3.0)
    goal = Deliver.send_goal(UUID(np.arange(16, dtype=np.uint8)), Deliver_Goal(("table_1",)))
    life.loop.publish("deliver/_action/send_goal", goal, "tool")
    life.run(120.0)
    assert driven(life) == [
        "kitchen",
        "table_1",
        "home",
        "kitchen",
        "table_2",
        "home",
        "kitchen",
        "table_1",
        "home",
    ]
    (outcome,) = life.heard("deliver/_action/get_result")
    assert outcome.result.delivered == ("table_1",)


def test_robot_is_never_idle_between_orders(waiter: Callable[..., Life]) -> None:
    """Whoever waits for the end of the delivery would take that for it."""
    life = waiter(delivery_status=status("driving", "table_1"))
    life.run(3.0)
    assert [said.state for said in life.heard("delivery_status")] == ["driving", "waiting"]


def test_a_first_start_waits_for_an_order(waiter: Callable[..., Life]) -> None:
    life = waiter()
    life.run(1.0)
    assert [said.state for said in life.heard("delivery_status")] == ["idle"]
    life.loop.publish("order", Order(("table_1",)), "page")
    life.run(60.0)
    assert driven(life) == ["kitchen", "table_1", "home"]


@pytest.mark.parametrize(("fails", "arrives"), [(3, True), (1000, False)])
def test_a_restarting_navigator_is_retried_for_a_limited_time(
    waiter: Callable[..., Life], fails: int, arrives: bool
) -> None:
    life = waiter(fails=fails, delivery_status=status("driving", "table_1"))
    life.run(120.0)
    assert ("table_1" in life.heard("delivery_status")[-1].delivered) == arrives
    assert (life.heard("delivery_status")[-1].state == "idle") == arrives


@pytest.mark.parametrize(
    ("kind", "topic", "word"),
    [
        ("chefbot.nodes.global_localizer:GlobalLocalizerNode", "localized", Bool(True)),
        ("chefbot.nodes.explorer:ExplorerNode", "exploration_status", ExplorationStatus(Header(), True)),
    ],
)
def test_a_restored_result_needs_no_new_search(kind: str, topic: str, word: Message) -> None:
    for words, turns in (({topic: word}, False), ({}, True)):
        life = Life({"node": kind}, words)
        life.run(1.0)
        assert bool(life.heard("spin/_action/send_goal")) == turns
        assert [said.to_cdr() for said in life.heard(topic)] == ([] if turns else [word.to_cdr()])


def test_robot_stands_until_all_processes_run() -> None:
    life = Life({"base": "chefbot.nodes.drive_base:DriveBaseNode"}, {})

    def drive(topic: str) -> float:
        """Angular velocity of the left wheel, rad/s, after a second of such commands."""
        for _ in range(20):
            life.loop.publish(topic, Twist.of(0.2, 0.0), "somebody")
            life.run(0.05)
        return float(life.heard("wheel_speeds")[-1].left)

    assert drive("cmd_vel_nav") > 2.0
    for name in ("slam", "page"):
        life.loop.publish("process_lost", String(name), "wire")
    life.run(0.0)
    assert life.heard("wheel_speeds")[-1].left == 0.0
    assert drive("cmd_vel_nav") == 0.0
    life.loop.publish("process_back", String("slam"), "wire")
    assert drive("cmd_vel_nav") == 0.0
    assert drive("cmd_vel_teleop") > 2.0
    life.loop.publish("process_back", String("page"), "wire")
    life.run(2.0)
    assert drive("cmd_vel_nav") > 2.0


class Stops(Life):
    """A base, and what it says of STOP."""

    def __init__(self, **words: Message) -> None:
        super().__init__({"base": "chefbot.nodes.drive_base:DriveBaseNode"}, words)
        self.run(0.001)

    def ask(self, topic: str, word: bool) -> None:
        self.loop.publish(topic, Bool(word), "somebody")
        self.run(0.001)

    @property
    def told(self) -> bool:
        return bool(self.heard("emergency_stop")[-1].data)

    @property
    def status(self) -> EmergencyStopStatus:
        found = self.heard("stop_status")[-1]
        assert isinstance(found, EmergencyStopStatus)
        return found

    def drives(self) -> bool:
        """When somebody takes the stick."""
        self.run(0.5)
        for _ in range(10):
            self.loop.publish("cmd_vel_teleop", Twist.of(0.2, 0.0), "somebody")
            self.run(0.05)
        return float(self.heard("wheel_speeds")[-1].left) > 0.0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["stop_request", "emergency_stop"]), st.booleans()), max_size=8))
def test_emergency_stop_has_one_state_that_the_wheels_obey(
    words: list[tuple[str, bool]],
) -> None:
    """Pressed by anybody anywhere; released only by request."""
    life, stopped = Stops(), False
    for topic, word in words:
        life.ask(topic, word)
        stopped = word if topic == "stop_request" else stopped or word
        assert life.told == life.status.active == stopped
    assert life.drives() != stopped
    again = Stops(stop_status=life.status, restarted=Empty())
    assert again.told == again.status.active == stopped
    assert again.status.pressed_at == life.status.pressed_at
    assert again.drives() != stopped
    again.ask("stop_request", False)
    assert again.drives()


def test_a_base_with_unknown_stop_state_is_stopped_with_a_reason() -> None:
    life = Stops(restarted=Empty())
    assert life.told and not life.drives()
    assert life.heard("base/remark")[-1].data == life.status.description == ESTOP_STATE_UNKNOWN
    life.ask("stop_request", False)
    assert life.drives()
    first = Stops()
    assert not first.told and first.drives() and not first.heard("base/remark")


def test_tables_may_be_named_informally(waiter: Callable[..., Life]) -> None:
    life = waiter()
    life.loop.publish("order", Order(("2", "Table 1", "kitchen"), "x"), "person")
    life.run(60.0)
    assert driven(life) == ["kitchen", "table_2", "table_1", "kitchen", "home"]


def test_an_unknown_table_is_refused_with_the_nearest_name(waiter: Callable[..., Life]) -> None:
    life = waiter()
    life.loop.publish("order", Order(("1", "tabel_2"), "x"), "person")
    life.run(1.0)
    last = life.heard("delivery_status")[-1]
    assert last.description == "On this map there is no place called 'tabel_2' (did you mean 'table_2'?)."
    assert driven(life) == [] and last.state == "failed"
