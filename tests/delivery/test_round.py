"""The round: food counts as delivered by a press only, STOP and errands lose nothing, nothing starts by itself."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.round_outcome import ENDED_BY_PERSON, UNKNOWN_PLACE, OrderError, OrderOutcome
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Errand, Order
from chefbot.msgs.geometry_msgs import PoseStamped

TABLES = ("table_1", "table_2", "table_3", "kitchen")


def errand(when: str) -> Errand:
    return Errand("reception", PoseStamped(), when)


def resolve(places: tuple[str, ...]) -> tuple[str, ...]:
    for place in places:
        if place not in TABLES:
            raise UserError(f"there is no place called {place!r}")
    return places


class Waiter:
    """A round whose outcomes are noted."""

    def __init__(self) -> None:
        self.outcomes: list[OrderOutcome] = []
        self.round = DeliveryRound("kitchen", "home", resolve, self.outcomes.append)

    def at(self, table: str, *orders: tuple[str, ...]) -> Waiter:
        """Waiting there, with further orders behind."""
        for number, tables in enumerate(orders):
            self.round.order(Order(tables, f"order {number}"))
        while (self.round.status.state, self.round.status.place) != ("waiting", table):
            {"driving": self.round.arrived, "loading": self.round.loaded, "waiting": self.round.taken}[
                self.round.status.state
            ]()
        return self

    @property
    def now(self) -> tuple[str, str, str]:
        status = self.round.status
        return status.state, status.place, status.hold_reason


def test_round_leaves_kitchen_and_table_after_confirmation() -> None:
    waiter = Waiter()
    one = waiter.round
    one.order(Order(("table_1", "table_2"), "a"))
    assert waiter.now == ("driving", "kitchen", "") and one.leg
    one.arrived()
    assert waiter.now == ("loading", "kitchen", "") and one.leg is None
    assert "table 1 and table 2" in one.status.description
    one.taken()
    assert waiter.now == ("loading", "kitchen", ""), "nothing was taken in the kitchen"
    one.loaded()
    one.loaded()
    assert waiter.now == ("driving", "table_1", "")
    one.taken()
    assert one.status.delivered == () and waiter.now == ("driving", "table_1", ""), "it is not there yet"
    one.arrived()
    one.loaded()
    assert waiter.now == ("waiting", "table_1", "")
    one.taken()
    assert waiter.now == ("driving", "table_2", "") and one.status.delivered == ("table_1",)
    one.arrived("a box is in the way")
    assert waiter.now == ("returning", "home", "")
    one.arrived()
    assert one.status.state == "failed" and "table 2 was not reached" in one.status.description
    assert waiter.outcomes == [
        OrderOutcome("a", ("table_1",), 2, "table 2 was not reached: a box is in the way")
    ]


def test_food_that_is_not_picked_up_is_not_delivered() -> None:
    waiter = Waiter().at("table_1", ("table_1", "table_2"))
    waiter.round.skip()
    assert waiter.now == ("driving", "table_2", "")
    assert waiter.round.status.delivered == () and "nobody took" in waiter.round.status.skipped_reasons[0]


@pytest.mark.parametrize("choice", ["go_on", "kitchen", "end"])
def test_emergency_stop_keeps_the_round_until_a_choice_is_made(choice: str) -> None:
    waiter = Waiter().at("table_2", ("table_1", "table_2", "table_3"), ("table_1",))
    one = waiter.round
    one.stop(True)
    one.order(Order(("table_2",), "while stopped"))
    assert (
        waiter.now == ("waiting", "table_2", "stop")
        and one.leg is None
        and len(one.status.pending_orders) == 2
    )
    with pytest.raises(OrderError, match="Resume"):
        one.choose(choice)
    one.stop(False)
    assert waiter.now == ("waiting", "table_2", "choice") and one.leg is None
    assert "go on to table 2" in one.status.description and "kitchen" in one.status.description
    one.choose(choice)
    assert one.status.delivered == ("table_1",)
    if choice == "go_on":
        assert waiter.now == ("driving", "table_2", "") and one.status.queue == ("table_3",)
    elif choice == "kitchen":
        assert waiter.now == ("driving", "kitchen", "") and one.status.queue == ("table_2", "table_3")
    else:
        assert waiter.outcomes[0].code == ENDED_BY_PERSON and waiter.outcomes[0].delivered == ("table_1",)
        assert waiter.now == ("idle", "", "choice") and one.leg is None, (
            "the next order does not start by itself"
        )
        assert len(one.status.skipped_reasons) == 2
        one.choose("go_on")
        assert waiter.now == ("driving", "kitchen", "")


def test_an_order_during_emergency_stop_waits_for_a_choice() -> None:
    waiter = Waiter()
    one = waiter.round
    one.stop(True)
    one.order(Order(("table_1",), "a"))
    one.stop(False)
    assert waiter.now == ("idle", "", "choice") and len(one.status.pending_orders) == 1
    one.choose("go_on")
    assert waiter.now == ("driving", "kitchen", "")


def test_pickup_during_emergency_stop_counts() -> None:
    waiter = Waiter().at("table_1", ("table_1", "table_2"))
    waiter.round.stop(True)
    waiter.round.taken()
    assert waiter.round.status.delivered == ("table_1",) and waiter.round.leg is None
    waiter.round.stop(False)
    assert "go on to table 2" in waiter.round.status.description
    waiter.round.choose("go_on")
    assert waiter.now == ("driving", "table_2", "")


@pytest.mark.parametrize("state", ["driving", "loading", "waiting", "returning"])
def test_a_go_to_during_a_round_needs_a_time(state: str) -> None:
    waiter = Waiter()
    one = waiter.round
    one.order(Order(("table_1",), "a"))
    for event, reached in (
        (one.arrived, "driving"),
        (one.loaded, "loading"),
        (one.arrived, ""),
        (one.taken, "waiting"),
    ):
        if state == reached:
            break
        event()
    assert one.status.state == state
    before = one.status
    with pytest.raises(OrderError, match="now, after it, or instead"):
        one.go(errand(""))
    assert one.status is before


def test_go_to_now_keeps_the_round_and_delivers_nothing() -> None:
    waiter = Waiter().at("table_1", ("table_1", "table_2"), ("table_3",))
    one = waiter.round
    one.go(errand("now"))
    assert one.leg and one.leg.place == "reception" and one.status.hold_reason == "errand"
    one.taken()
    assert one.status.delivered == (), "it has left the table with the food"
    one.arrived()
    assert one.leg is None and one.status.hold_reason == "choice"
    one.choose("go_on")
    assert waiter.now == ("driving", "table_1", "") and one.status.queue == ("table_2",)
    assert len(one.status.pending_orders) == 1 and not one.status.errands and not waiter.outcomes


def test_resuming_the_round_drops_an_unfinished_errand() -> None:
    waiter = Waiter().at("table_1", ("table_1",))
    waiter.round.go(errand("now"))
    waiter.round.choose("go_on")
    assert waiter.now == ("driving", "table_1", "") and not waiter.round.status.errands


def test_go_to_after_the_round_replaces_the_return_home() -> None:
    waiter = Waiter().at("table_1", ("table_1",), ("table_2",))
    one = waiter.round
    one.go(errand("after"))
    assert waiter.now == ("waiting", "table_1", "")
    one.taken()
    assert [done.delivered for done in waiter.outcomes] == [("table_1",)]
    assert one.leg and one.leg.place == "reception"
    one.arrived()
    assert waiter.now == ("driving", "kitchen", "")


def test_go_to_instead_ends_the_round_with_the_missing_tables() -> None:
    waiter = Waiter().at("table_1", ("table_1", "table_2"))
    waiter.round.go(errand("instead"))
    assert waiter.round.leg and waiter.round.leg.place == "reception"
    (outcome,) = waiter.outcomes
    assert (outcome.code, outcome.delivered) == (ENDED_BY_PERSON, ())
    assert "table 1 and table 2" in outcome.sentence
    waiter.round.arrived()
    assert waiter.now == ("idle", "", "")


def test_external_motion_commands_hold_the_round() -> None:
    waiter = Waiter().at("table_1", ("table_1",))
    waiter.round.on_diverted()
    waiter.round.taken()
    assert waiter.round.leg is None and waiter.round.status.delivered == ()
    assert "Somebody sent the robot elsewhere" in waiter.round.status.description
    waiter.round.choose("go_on")
    assert waiter.now == ("driving", "table_1", "")


@pytest.mark.parametrize("places", [(), ("moon",)])
def test_an_impossible_order_fails_and_the_next_one_starts(places: tuple[str, ...]) -> None:
    waiter = Waiter()
    waiter.round.stop(True)
    waiter.round.order(Order(places, "a"))
    waiter.round.order(Order(("table_1",), "b"))
    waiter.round.stop(False)
    waiter.round.choose("go_on")
    assert [(one.order_id, one.code) for one in waiter.outcomes] == [("a", UNKNOWN_PLACE)]
    assert waiter.now == ("driving", "kitchen", "")


def test_tables_are_served_in_another_order_and_left_out() -> None:
    waiter = Waiter()
    one = waiter.round
    one.order(Order(("table_1", "table_2", "table_3", "table_2"), "a"))
    one.arrived()
    one.change_queue("a", ("table_3", "table_2", "table_1"))
    assert one.status.queue == ("table_3", "table_2", "table_1")
    assert "table 3, table 2 and table 1" in one.status.description, "what is loaded is known in the kitchen"
    assert one.status.skipped_reasons == ("table 2: it was taken out of the round",)
    one.loaded()
    assert waiter.now == ("driving", "table_3", "")
    for order_id, places in (("a", ("table_3",)), ("b", ("table_1",)), ("a", ("table_1", "table_1"))):
        with pytest.raises(OrderError, match="has changed meanwhile"):
            one.change_queue(order_id, places)
    one.change_queue("a", ())
    one.arrived()
    one.taken()
    assert waiter.now == ("returning", "home", "")
    one.arrived()
    assert waiter.outcomes[0].delivered == ("table_3",) and len(one.status.skipped_reasons) == 3


@pytest.mark.parametrize("in_the_kitchen", [False, True])
def test_a_round_without_tables_ends_before_it_is_loaded(in_the_kitchen: bool) -> None:
    waiter = Waiter()
    waiter.round.order(Order(("table_1",), "a"))
    waiter.round.order(Order(("table_2",), "b"))
    if in_the_kitchen:
        waiter.round.arrived()
    waiter.round.change_queue("a", ())
    assert [one.order_id for one in waiter.outcomes] == ["a"]
    assert waiter.now == ("driving", "kitchen", "") and waiter.round.status.queue == ("table_2",)


class AnyDay(RuleBasedStateMachine):
    """People, STOP, errands, faults and restarts in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.outcomes: list[OrderOutcome] = []
        self.round = DeliveryRound("kitchen", "home", resolve, self.outcomes.append)
        self.given: list[str] = []
        self.taken: Counter[str] = Counter()
        self.may_start = True

    @property
    def state(self) -> DeliveryStatus:
        return self.round.status

    @rule(tables=st.lists(st.sampled_from((*TABLES, "moon")), max_size=3).map(tuple), again=st.booleans())
    def order(self, tables: tuple[str, ...], again: bool) -> None:
        name = f"order {len(self.given)}"
        self.given.append(name)
        self.round.order(Order(tables, name))
        if again:
            self.round.order(Order(tables, name))

    @precondition(lambda self: len(self.given) > 1)
    @rule()
    def an_older_order_is_repeated(self) -> None:
        self.round.order(Order(("table_1",), self.given[-2]))

    @rule()
    def load(self) -> None:
        self.round.loaded()

    @rule()
    def take(self) -> None:
        if self.state.state == "waiting":
            self.taken[self.state.order_id] += 1
        self.round.taken()

    @rule()
    def skip(self) -> None:
        self.round.skip()

    @rule(fault=st.sampled_from(["", "", "blocked"]))
    def arrive(self, fault: str) -> None:
        self.round.arrived(fault)

    @rule(pressed=st.booleans())
    def stop(self, pressed: bool) -> None:
        standing = self.round.leg is None
        self.round.stop(pressed)
        assert self.round.leg is None or not standing, "neither STOP nor its release sets the robot in motion"

    @rule(when=st.sampled_from(["", "now", "after", "instead"]))
    def go(self, when: str) -> None:
        before = self.state
        try:
            self.round.go(errand(when))
        except OrderError:
            assert self.state is before

    @rule(choice=st.sampled_from(["go_on", "kitchen", "end", "nonsense"]))
    def choose(self, choice: str) -> None:
        before = self.state
        try:
            self.round.choose(choice)
        except OrderError:
            assert self.state is before

    @rule(
        turns=st.permutations(range(3)),
        kept=st.integers(0, 3),
        seen=st.sampled_from(["now", "before", "moon"]),
    )
    def change_queue(self, turns: list[int], kept: int, seen: str) -> None:
        """The operator saw the round as it is, an earlier one, or a table that it does not have."""
        before, queue = self.state, self.state.queue
        places = [queue[i] for i in turns if i < len(queue)][:kept] + (["moon"] if seen == "moon" else [])
        try:
            self.round.change_queue(before.order_id + ("" if seen == "now" else "x"), places)
        except OrderError:
            assert self.state is before
        else:
            assert seen == "now" and self.state.queue == tuple(places)
            assert self.state.delivered == before.delivered

    @rule()
    def somebody_else_sends_it_away(self) -> None:
        self.round.on_diverted()

    @rule(which=st.integers(0, 3))
    def an_action_goal_is_cancelled(self, which: int) -> None:
        waiting = [self.state.order_id, *(one.id for one in self.state.pending_orders)]
        if which < len(waiting) and waiting[which]:
            before = len(self.outcomes)
            self.round.withdraw(waiting[which])
            if len(self.outcomes) == before:  # it waited: whoever cancelled it knows
                self.outcomes.append(OrderOutcome(waiting[which], (), ENDED_BY_PERSON, ""))

    @rule()
    def cancel(self) -> None:
        self.round.cancel()
        assert self.round.leg is None and not self.state.pending_orders and not self.round.in_progress

    @rule()
    def the_process_dies(self) -> None:
        """All that is known comes over the wire again."""
        received, stopped = DeliveryStatus.from_cdr(self.state.to_cdr()), self.round.stopped
        self.round = DeliveryRound("kitchen", "home", resolve, self.outcomes.append)
        self.round.resume(received)
        if stopped or received.hold_reason == "stop":
            self.round.stop(True)
            self.round.stop(stopped)

    @invariant()
    def nothing_drives_while_stop_is_pressed(self) -> None:
        assert not (self.round.stopped and self.round.leg)

    @invariant()
    def a_round_that_is_held_does_not_drive_to_a_table(self) -> None:
        leg = self.round.leg
        assert not (self.state.hold_reason and leg) or (leg is not None and leg.place == "reception")

    @invariant()
    def every_order_is_in_one_place(self) -> None:
        in_hand = [self.state.order_id] if self.round.in_progress else []
        waiting = [one.id for one in self.state.pending_orders]
        assert Counter([*in_hand, *waiting, *(one.order_id for one in self.outcomes)]) == Counter(self.given)

    @invariant()
    def delivered_is_what_was_taken(self) -> None:
        for one in self.outcomes:
            assert len(one.delivered) == self.taken[one.order_id]
        if self.round.in_progress:
            assert len(self.state.delivered) == self.taken[self.state.order_id]

    @invariant()
    def a_robot_that_stands_reports_what_it_waits_for(self) -> None:
        waits = self.state.state in ("idle", "failed", "loading", "waiting") or self.state.hold_reason
        assert self.round.leg or (waits and self.state.description)
        assert not (
            self.round.in_progress and not self.round.leg and not self.state.hold_reason
        ) or self.state.state in (
            "loading",
            "waiting",
        )

    @invariant()
    def orders_do_not_wait_for_nothing(self) -> None:
        busy = self.round.in_progress or self.state.hold_reason or self.state.state == "errand"
        assert busy or not self.state.pending_orders


AnyDay.TestCase.settings = settings(
    max_examples=60, stateful_step_count=30, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
TestAnyDay = AnyDay.TestCase
