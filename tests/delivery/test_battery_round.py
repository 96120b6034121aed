"""The round and the battery: orders by energy, tables left out, home in time, parking, and nothing during STOP."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from chefbot.delivery import status_messages
from chefbot.delivery.battery_round import RETRY_TIME, BatteryRound
from chefbot.delivery.energy_forecast import MARGIN, EnergyForecast, PlannedRoute, Stop
from chefbot.delivery.round_outcome import BATTERY_TOO_LOW, OrderError, OrderOutcome
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import BatteryStatus, Errand, Order
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header

PLACES = {"home": 0.0, "kitchen": 5.0, "table_1": 10.0, "table_2": 20.0, "table_3": 30.0}
PARKING = 2.0
STOP_TIME = 10.0


def pose(x: float) -> PoseStamped:
    return PoseStamped(Header.of(0, "map"), Pose.of(SE2(x, 0.0, 0.0)))


def battery(metres: float, level: str = "ok", standing: float = 0.0) -> BatteryStatus:
    """Return a battery whose energy is enough for so many metres, at 10 J each."""
    return BatteryStatus(
        level=level, charge=0.5, energy=10.0 * metres, standing_power=standing, energy_per_metre=10.0
    )


class Corridor:
    """A robot on a line, with a round whose outcomes are noted."""

    def __init__(self, metres: float | None = None, level: str = "ok") -> None:
        self.x, self.time = 0.0, 0.0
        self.outcomes: list[OrderOutcome] = []
        self.forecast = EnergyForecast(self.length, STOP_TIME)
        self.parking: tuple[PoseStamped, float] | None = pose(0.0), PARKING
        self.round = BatteryRound(
            "kitchen", "home", lambda names: names, self.outcomes.append, self.forecast, lambda: self.parking
        )
        if metres is not None:
            self.show(metres, level)

    def length(self, stops: tuple[Stop, ...]) -> float:
        route = [self.x, *(PLACES[s] if isinstance(s, str) else s.pose.position.x for s in stops)]
        return sum(abs(b - a) for a, b in pairwise(route))

    def show(self, metres: float, level: str = "ok") -> None:
        self.time += 1.0
        self.round.on_battery(battery(metres, level), self.time)

    def drive(self) -> None:
        """Reach the place that the round drives to."""
        leg = self.round.leg
        assert leg is not None
        self.x = PLACES.get(leg.place, leg.pose.pose.position.x if leg.pose else 0.0)
        self.round.arrived()

    @property
    def now(self) -> tuple[str, str]:
        return self.round.status.state, self.round.status.place


def serving(metres: float) -> Corridor:
    """On the way to the first of three tables, with the food."""
    one = Corridor(metres)
    one.round.order(Order(("table_1", "table_2", "table_3"), "a"))
    one.drive()
    one.round.loaded()
    assert one.now == ("driving", "table_1")
    return one


def test_without_a_battery_monitor_every_order_is_accepted() -> None:
    one = Corridor()
    one.round.order(Order(("table_3",), "a"))
    assert one.now == ("driving", "kitchen")


@pytest.mark.parametrize(("metres", "accepted"), [(60.0 * MARGIN + 1.0, True), (60.0 * MARGIN - 1.0, False)])
def test_an_order_needs_energy_for_the_drive_there_and_home(metres: float, accepted: bool) -> None:
    one = Corridor(metres)
    one.round.order(Order(("table_3",), "a"))
    assert (one.round.leg is not None) == accepted
    if not accepted:
        (outcome,) = one.outcomes
        assert outcome.code == BATTERY_TOO_LOW and outcome.sentence == one.round.status.description
        expected = "Table 3 refused: the battery has energy for about 59 m, the round needs 60 m."
        assert outcome.sentence == expected


def test_people_at_the_stops_cost_energy_too() -> None:
    forecast = EnergyForecast(lambda _: 10.0, STOP_TIME)
    forecast.battery = battery(13.0 + 4.0, standing=1.0)
    assert forecast.suffices(PlannedRoute(("home",), 2)) and forecast.reach(0) > forecast.reach(1)
    assert not forecast.suffices(PlannedRoute(("home",), 10))


def test_an_unknown_route_is_not_refused() -> None:
    forecast = EnergyForecast(lambda _: math.nan, STOP_TIME)
    forecast.battery = battery(0.0)
    assert forecast.suffices(PlannedRoute(("home",), 0))


def test_an_order_behind_others_needs_energy_for_all() -> None:
    one = Corridor(60.0 * MARGIN + 20.0)
    one.round.order(Order(("table_3",), "a"))
    one.round.order(Order(("table_2",), "b"))
    assert not one.round.status.pending_orders and one.outcomes[0].order_id == "b"
    assert "Table 2 refused" in one.round.status.description and "b" in one.round.status.accepted
    one.round.order(Order(("table_2",), "b"))
    assert len(one.outcomes) == 1, "a repeated request is the same order"
    one.show(500.0)
    one.round.order(Order(("table_2",), "c"))
    assert [order.id for order in one.round.status.pending_orders] == ["c"]


def test_an_order_without_tables_fails_when_it_begins() -> None:
    one = Corridor(60.0 * MARGIN + 20.0)
    one.round.order(Order(("table_3",), "a"))
    one.forecast.battery = battery(1.0)
    one.round.order(Order((), "b"))
    assert [order.id for order in one.round.status.pending_orders] == ["b"] and not one.outcomes
    one.round.withdraw("a")
    assert [(outcome.order_id, outcome.sentence) for outcome in one.outcomes][-1] == (
        "b",
        status_messages.NO_PLACE,
    )


def test_the_way_home_between_two_orders_needs_no_energy() -> None:
    """To table 3 and back to the kitchen are 55 m, to table 2 and home 35 m; by way of home 10 m more."""
    one = Corridor(90.0 * MARGIN + 1.0)
    one.round.order(Order(("table_3",), "a"))
    one.round.order(Order(("table_2",), "b"))
    assert [order.id for order in one.round.status.pending_orders] == ["b"]


def test_a_low_robot_refuses_until_it_is_charged() -> None:
    one = Corridor(500.0, "return")
    one.round.order(Order(("table_1",), "a"))
    assert "has to be charged" in one.outcomes[0].sentence and one.round.leg is None
    one.show(500.0)
    one.round.order(Order(("table_1",), "b"))
    assert one.now == ("driving", "kitchen")


def test_an_errand_needs_energy_for_the_drive_home() -> None:
    one = Corridor(25.0)
    with pytest.raises(OrderError, match="energy for about 19 m, the round needs 20 m"):
        one.round.go(Errand("", pose(10.0), "now"))
    one.round.go(Errand("", pose(9.0), "now"))
    assert one.now[0] == "errand"


def test_a_low_robot_finishes_what_it_carries() -> None:
    one = serving(500.0)
    one.show(90.0, "return")
    assert one.now == ("driving", "table_1") and one.round.status.queue == ("table_2", "table_3")


def test_tables_beyond_the_energy_are_left_out_with_a_reason() -> None:
    one = serving(500.0)
    one.show(40.0, "return")
    assert one.round.status.queue == ("table_2",)
    assert one.round.status.skipped_reasons == ("table 3: not enough battery",)
    one.show(17.0, "return")
    assert one.round.status.queue == () and one.now == ("driving", "table_1")
    one.show(16.0, "return")
    assert one.now == ("returning", "home") and "battery is low" in one.round.status.description
    one.drive()
    assert one.outcomes[-1].code and one.round.status.state == "failed"


def test_a_low_robot_that_carries_nothing_goes_home() -> None:
    one = Corridor(500.0)
    one.round.order(Order(("table_1",), "a"))
    one.show(400.0, "return")
    assert one.now == ("returning", "home")


def test_a_robot_leaves_a_table_while_it_still_gets_home() -> None:
    one = serving(500.0)
    one.drive()
    assert one.now == ("waiting", "table_1")
    one.show(11.1, "return")
    assert one.now == ("waiting", "table_1")
    one.show(10.9, "return")
    assert one.now == ("returning", "home")


def test_where_home_is_too_far_it_parks() -> None:
    one = serving(500.0)
    one.drive()
    one.show(9.0, "park")
    assert one.now[0] == "errand" and one.round.status.description == status_messages.PARKING
    (outcome,) = one.outcomes
    assert (outcome.order_id, outcome.code) == ("a", BATTERY_TOO_LOW)
    one.drive()
    assert one.now == ("idle", "") and one.round.status.description == status_messages.PARKED
    one.show(1.0, "park")
    assert one.round.leg is None, "it stays where it has parked"


def test_home_is_the_parking_place_if_it_is_nearer() -> None:
    one = serving(500.0)
    one.x = 1.0
    one.show(0.0, "park")
    assert one.now == ("returning", "home")
    one.show(0.0, "park")
    assert one.round.number == 3, "the drive goes on"


def test_a_robot_without_an_order_goes_home_when_it_is_low() -> None:
    one = Corridor(100.0)
    one.x = 20.0
    one.show(90.0, "return")
    assert one.now == ("returning", "home")
    one.round.arrived("Something is in the way.")
    assert one.now[0] == "failed"
    one.show(90.0, "return")
    assert one.round.leg is None
    one.time += RETRY_TIME
    one.show(90.0, "return")
    assert one.now == ("returning", "home"), "it tries again after a while"


def test_nothing_moves_by_itself_during_stop_and_choice() -> None:
    one = serving(500.0)
    one.round.stop(True)
    one.show(1.0, "park")
    assert one.round.leg is None and one.round.status.hold_reason == "stop"
    one.round.stop(False)
    one.show(1.0, "park")
    assert one.round.leg is None and one.round.status.hold_reason == "choice"


class Served(RuleBasedStateMachine):
    """Orders, people, STOP and a battery that only falls: what was begun is finished, at home or parked."""

    def __init__(self) -> None:
        super().__init__()
        self.one = Corridor(300.0)
        self.metres = 300.0

    def use(self, metres: float) -> None:
        self.metres -= metres
        share = self.metres / 300.0
        self.one.show(max(0.0, self.metres), "ok" if share > 0.3 else "return" if share > 0.05 else "park")

    @rule(tables=st.lists(st.sampled_from(["table_1", "table_2", "table_3"]), min_size=1, max_size=3))
    def order(self, tables: list[str]) -> None:
        self.one.round.order(Order(tuple(tables)))

    @precondition(lambda self: self.one.round.leg is not None)
    @rule(share=st.floats(0.1, 1.0), worse=st.floats(1.0, 1.05))
    def drive(self, share: float, worse: float) -> None:
        leg = self.one.round.leg
        assert leg is not None
        target = PLACES.get(leg.place, leg.pose.pose.position.x if leg.pose else 0.0)
        step = (target - self.one.x) * share
        self.one.x += step
        if abs(target - self.one.x) < 0.5:
            self.one.drive()
        self.use(abs(step) * worse)

    @precondition(lambda self: self.one.round.status.state in ("loading", "waiting"))
    @rule(patience=st.floats(0.0, 1.0))
    def press(self, patience: float) -> None:
        self.use(patience)
        state = self.one.round.status.state
        if state == "loading":
            self.one.round.loaded()
        elif state == "waiting":
            self.one.round.taken()

    @invariant()
    def the_energy_is_enough_for_the_drive_home(self) -> None:
        assert self.metres > 0.0 or abs(self.one.x) <= PARKING + 0.5 or not self.one.round.in_progress


class TestServed(Served.TestCase):
    """Run by pytest."""

    settings = settings(
        max_examples=40, stateful_step_count=40, deadline=None, suppress_health_check=list(HealthCheck)
    )
