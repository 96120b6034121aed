"""Deliveries in any order of events: people, STOP, errands, faults and restarts lose no order and no food."""

from __future__ import annotations

from collections import Counter

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from tests.support.rounds import TABLES, errand, resolve

from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.round_outcome import ENDED_BY_PERSON, OrderError, OrderOutcome
from chefbot.delivery.trays import stops_left
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Order


class AnyDay(RuleBasedStateMachine):
    """People, STOP, errands, faults and restarts in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.outcomes: list[OrderOutcome] = []
        self.round = DeliveryRound("kitchen", "home", resolve, self.outcomes.append)
        self.given: list[str] = []
        self.taken: Counter[str] = Counter()
        self.may_start = True

    @initialize(trays=st.integers(0, 3))
    def build(self, trays: int) -> None:
        self.round.trays = trays

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

    @rule(reason=st.sampled_from(["", "", "blocked"]))
    def arrive(self, reason: str) -> None:
        self.round.arrived(reason)

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
            self.round.change_queue(f"{before.order_id or '-'}{'' if seen == 'now' else 'x'}", places)
        except OrderError:
            assert self.state is before
        else:
            assert seen == "now" and Counter(self.state.queue) == Counter(places)
            assert before.on_trays or self.state.queue == tuple(places)
            assert self.state.delivered == before.delivered

    @precondition(lambda self: self.state.pending_orders)
    @rule(which=st.integers(0, 3), left=st.integers(0, 2))
    def a_waiting_order_is_shortened_or_cancelled(self, which: int, left: int) -> None:
        orders = self.state.pending_orders
        order = orders[which % len(orders)]
        outcomes, standing = len(self.outcomes), self.round.leg is None
        self.round.change_queue(order.id, order.places[:left])
        assert (len(self.outcomes) > outcomes) == (not order.places[:left])
        assert self.round.leg is None or not standing, "an order that is dropped moves nothing"

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
        received, stopped, trays = (
            DeliveryStatus.from_cdr(self.state.to_cdr()),
            self.round.stopped,
            self.round.trays,
        )
        self.round = DeliveryRound("kitchen", "home", resolve, self.outcomes.append)
        self.round.trays = trays
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
        standing = ("idle", "failed", "loading", "waiting", "unloading")
        waits = self.state.state in standing or self.state.hold_reason
        assert self.round.leg or (waits and self.state.description)
        assert not (
            self.round.in_progress and not self.round.leg and not self.state.hold_reason
        ) or self.state.state in (
            "loading",
            "waiting",
            "unloading",
        )

    @invariant()
    def food_is_served_from_its_tray(self) -> None:
        status = self.state
        assert len(status.on_trays) <= self.round.trays and (status.loaded or not status.on_trays)
        if status.on_trays and status.state == "waiting":
            assert status.place in status.on_trays
            assert f"tray {status.on_trays.index(status.place) + 1}" in status.description or (
                len(status.on_trays) == 1 or status.hold_reason
            )

    @invariant()
    def food_that_nobody_took_goes_back(self) -> None:
        status = self.state
        if status.state == "returning":
            assert status.place == ("kitchen" if status.untaken else "home")
        assert status.untaken or status.state != "unloading"
        assert not status.untaken or self.round.in_progress

    @invariant()
    def what_is_left_of_a_round_begins_with_its_drive(self) -> None:
        if self.state.state == "driving":
            left = stops_left(self.state, self.state.queue, self.round.trays, "kitchen")
            assert left[0] == self.state.place
            assert not Counter(self.state.queue) - Counter(left[1:]), "all tables of the queue"

    @invariant()
    def orders_do_not_wait_for_nothing(self) -> None:
        busy = self.round.in_progress or self.state.hold_reason or self.state.state == "errand"
        assert busy or not self.state.pending_orders


AnyDay.TestCase.settings = settings(
    max_examples=60, stateful_step_count=30, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
TestAnyDay = AnyDay.TestCase
