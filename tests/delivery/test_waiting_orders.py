"""Orders that wait: the next one begins without the way home between them, wherever the robot is."""

from __future__ import annotations

import pytest
from tests.support.rounds import Waiter, errand

from chefbot.delivery.round_outcome import UNKNOWN_PLACE, OrderOutcome
from chefbot.msgs.chefbot_msgs import Order


def test_an_order_that_waits_begins_at_the_last_table() -> None:
    """The way home between two orders would cost the kitchen minutes at lunch."""
    waiter = Waiter().at("table_1", ("table_1",), ("table_2",))
    waiter.round.taken()
    assert waiter.now == ("driving", "kitchen", "") and waiter.round.status.order_id == "order 1"
    assert waiter.outcomes == [OrderOutcome("order 0", ("table_1",), 0, "")]
    waiter.at("table_2").round.taken()
    assert waiter.now == ("returning", "home", "")


def test_an_order_on_the_way_home_begins_at_once() -> None:
    waiter = Waiter().at("table_1", ("table_1",))
    waiter.round.taken()
    assert waiter.now == ("returning", "home", "")
    waiter.round.order(Order(("table_2",), "b"))
    assert waiter.now == ("driving", "kitchen", "") and waiter.round.status.order_id == "b"
    assert [outcome.order_id for outcome in waiter.outcomes] == ["order 0"]


def test_what_nobody_took_is_unloaded_before_the_next_order() -> None:
    waiter = Waiter().at("table_1", ("table_1",), ("table_2",))
    waiter.round.skip()
    assert waiter.now == ("returning", "kitchen", "")
    waiter.round.arrived()
    assert waiter.now == ("unloading", "kitchen", "")
    waiter.round.taken()
    assert waiter.now == ("driving", "kitchen", "") and waiter.round.status.order_id == "order 1"


def test_before_an_order_that_cannot_begin_it_drives_home() -> None:
    """It would stand at the table of others otherwise."""
    waiter = Waiter().at("table_1", ("table_1",), ("roof",))
    waiter.round.taken()
    assert waiter.now == ("returning", "home", "")
    waiter.round.arrived()
    assert waiter.round.status.state == "failed" and waiter.outcomes[-1].code == UNKNOWN_PLACE


def test_from_a_kitchen_out_of_reach_it_drives_home_first() -> None:
    """Each waiting order would try the same way to the kitchen again, and fail."""
    waiter = Waiter()
    for number, table in enumerate(("table_1", "table_2")):
        waiter.round.order(Order((table,), f"order {number}"))
    waiter.round.arrived("a box is in the way")
    assert waiter.now == ("returning", "home", "")


@pytest.mark.parametrize("released", [False, True])
def test_after_stop_at_the_last_table_the_next_order_is_offered(released: bool) -> None:
    """Nobody wants to choose a way home while others wait for their food."""
    waiter = Waiter().at("table_1", ("table_1",), ("table_2",))
    one = waiter.round
    one.stop(True)
    if released:
        one.stop(False)
    one.taken()
    if not released:
        assert waiter.now == ("idle", "", "stop") and one.leg is None
        one.stop(False)
    assert waiter.now == ("idle", "", "choice") and one.leg is None
    assert one.status.description.endswith("Choose: start with the next order, or cancel it.")
    assert "round waits" not in one.status.description and len(waiter.outcomes) == 1
    one.choose("go_on")
    assert waiter.now == ("driving", "kitchen", "") and one.status.order_id == "order 1"


def test_going_on_home_begins_the_order_that_came_since() -> None:
    waiter = Waiter().at("table_1", ("table_1",))
    one = waiter.round
    one.taken()
    one.stop(True)
    one.order(Order(("table_2",), "b"))
    one.stop(False)
    one.choose("go_on")
    assert waiter.now == ("driving", "kitchen", "") and one.status.order_id == "b"


def test_a_drive_follows_orders_that_cannot_begin() -> None:
    waiter = Waiter().at("table_1", ("table_1",), ("roof",))
    one = waiter.round
    one.stop(True)
    one.go(errand("after"))
    one.taken()
    one.stop(False)
    while waiter.now[2]:
        one.choose("go_on")
    if waiter.now[0] == "returning":
        one.arrived()
    assert waiter.now == ("errand", "reception", ""), "it does not wait for an order that comes some day"


def test_a_cancelled_order_takes_nothing_from_the_round_before() -> None:
    waiter = Waiter().at("table_1", ("table_1",), ("table_2",))
    one = waiter.round
    one.stop(True)
    one.taken()
    one.stop(False)
    one.choose("end")
    assert one.status.description == "The order for table 2 was cancelled." and one.status.delivered == ()
