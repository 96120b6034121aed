"""The round: food counts as delivered by a press only, STOP and errands lose nothing, nothing starts by itself."""

from __future__ import annotations

import pytest
from tests.support.rounds import Waiter, errand

from chefbot.delivery import status_messages
from chefbot.delivery.round_outcome import ENDED_BY_PERSON, UNKNOWN_PLACE, OrderError, OrderOutcome
from chefbot.msgs.chefbot_msgs import Order


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
    assert waiter.now == ("returning", "kitchen", "")
    one.arrived()
    one.taken()
    assert waiter.now == ("returning", "home", "")
    one.arrived()
    assert one.status.state == "failed" and "table 2 was not reached" in one.status.description
    assert waiter.outcomes == [
        OrderOutcome("a", ("table_1",), 2, "table 2 was not reached: a box is in the way")
    ]


def test_food_that_is_not_picked_up_is_not_delivered() -> None:
    waiter = Waiter().at("table_1", ("table_1", "table_2"))
    one = waiter.round
    one.skip()
    assert waiter.now == ("driving", "table_2", "")
    assert one.status.delivered == () and "nobody took" in one.status.skipped_reasons[0]
    one.arrived()
    one.taken()
    assert waiter.now == ("returning", "kitchen", ""), "the food of table 1 goes back"
    one.arrived()
    assert waiter.now == ("unloading", "kitchen", "") and "for table 1" in one.status.description
    one.skip()
    one.loaded()
    assert waiter.now == ("unloading", "kitchen", "")
    one.taken()
    assert waiter.now == ("returning", "home", "") and one.status.delivered == ("table_2",)


def test_a_stop_on_the_way_back_with_food_offers_to_go_on() -> None:
    waiter = Waiter().at("table_1", ("table_1",))
    one = waiter.round
    one.skip()
    one.stop(True)
    one.stop(False)
    assert "go on to kitchen, or end the round" in one.status.description
    one.choose("go_on")
    assert waiter.now == ("returning", "kitchen", "")
    one.arrived()
    one.on_diverted()
    one.choose("go_on")
    assert waiter.now == ("returning", "kitchen", ""), "somebody sent it away before it was unloaded"
    one.arrived("the door is closed")
    assert waiter.now == ("returning", "home", ""), "it does not try again and again"


def test_food_of_an_earlier_trip_is_unloaded_before_the_next() -> None:
    waiter = Waiter()
    one = waiter.round
    one.trays = 1
    one.order(Order(("table_1", "table_2"), "a"))
    one.arrived()
    one.loaded()
    one.arrived()
    one.skip()
    assert waiter.now == ("driving", "kitchen", "")
    one.arrived()
    assert "Unload the food for table 1 that nobody took. Load the food for table 2" in one.status.description
    one.loaded()
    assert one.status.untaken == ()


def test_a_waiting_order_is_shortened_and_cancelled() -> None:
    waiter = Waiter().at("table_1", ("table_1",), ("table_2", "table_3"), ("table_3",))
    one = waiter.round
    one.change_queue("order 1", ("table_3",))
    with pytest.raises(OrderError, match="has changed in the meantime"):
        one.change_queue("order 1", ("table_2",))
    one.change_queue("order 2", ())
    assert [(order.id, order.places) for order in one.status.pending_orders] == [("order 1", ("table_3",))]
    assert waiter.outcomes == [OrderOutcome("order 2", (), ENDED_BY_PERSON, "The delivery was cancelled.")]
    assert waiter.now == ("waiting", "table_1", ""), "the round goes on"


def test_a_cancelled_round_names_the_food_that_is_on_the_robot() -> None:
    waiter = Waiter().at("table_1", ("table_1", "table_2"))
    assert waiter.round.status.loaded
    waiter.round.cancel()
    assert waiter.round.status.description == f"{status_messages.CANCELLED} {status_messages.FOOD_LEFT}"
    unloaded, served = Waiter(), Waiter().at("table_1", ("table_1",))
    unloaded.round.order(Order(("table_1",), "a"))
    served.round.taken()
    for one in (unloaded, served):
        one.round.cancel()
        assert one.round.status.description == status_messages.CANCELLED


def test_a_robot_held_for_a_cancelled_order_is_free_again() -> None:
    waiter = Waiter()
    one = waiter.round
    one.stop(True)
    one.order(Order(("table_1",), "a"))
    one.stop(False)
    assert waiter.now == ("idle", "", "choice")
    one.change_queue("a", ())
    assert waiter.now == ("idle", "", "") and one.leg is None and waiter.outcomes[0].order_id == "a"


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
    with pytest.raises(OrderError, match="Release STOP first"):
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


def test_loading_after_an_emergency_stop_is_the_choice_to_go_on() -> None:
    waiter = Waiter()
    one = waiter.round
    one.order(Order(("table_1", "table_2"), "a"))
    one.arrived()
    one.stop(True)
    one.stop(False)
    assert waiter.now == ("loading", "kitchen", "choice")
    assert "press 'Loaded', drive to kitchen again, or end the round" in one.status.description
    one.loaded()
    assert waiter.now == ("driving", "table_1", "") and one.leg


def test_loading_during_an_emergency_stop_starts_nothing() -> None:
    waiter = Waiter()
    one = waiter.round
    one.order(Order(("table_1",), "a"))
    one.arrived()
    one.stop(True)
    one.loaded()
    assert waiter.now == ("driving", "table_1", "stop") and one.leg is None
    one.stop(False)
    assert waiter.now == ("driving", "table_1", "choice") and one.leg is None


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
    assert "The robot was sent elsewhere" in waiter.round.status.description
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
        with pytest.raises(OrderError, match="has changed in the meantime"):
            one.change_queue(order_id, places)
    one.change_queue("a", ())
    one.arrived()
    one.taken()
    assert waiter.now == ("returning", "kitchen", "") and one.status.untaken == ("table_2", "table_1")
    one.arrived()
    one.taken()
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
