"""A robot with several trays: each table's food on its own tray, and as many trips as it takes."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.round_outcome import OrderError, OrderOutcome
from chefbot.delivery.trays import stops_left, with_kitchen
from chefbot.msgs.chefbot_msgs import Order

PLACES = [f"table_{number}" for number in range(1, 8)]


class Service:
    """A round with trays, and every place that it drives to."""

    def __init__(self, trays: int, *tables: str) -> None:
        self.outcomes: list[OrderOutcome] = []
        self.round = DeliveryRound("kitchen", "home", tuple, self.outcomes.append)
        self.round.trays = trays
        self.visited: list[str] = []
        self.round.order(Order(tables, "a"))

    def step(self, *, take: bool = True) -> None:
        """Arrive, load, or take the food or leave it."""
        one = self.round
        if one.status.state in ("driving", "returning"):
            self.visited.append(one.status.place)
            one.arrived()
        elif one.status.state == "loading":
            one.loaded()
        elif take or one.status.state == "unloading":
            one.taken()
        else:
            one.skip()

    def until(self, state: str, place: str = "") -> DeliveryRound:
        while self.round.status.state != state or (place and self.round.status.place != place):
            self.step()
        return self.round


@given(tables=st.lists(st.sampled_from(PLACES), min_size=1, max_size=7), trays=st.integers(0, 4))
def test_every_table_is_served_in_the_fewest_trips(tables: list[str], trays: int) -> None:
    service = Service(trays, *tables)
    planned = with_kitchen(tables, trays, "kitchen")
    service.until("idle")
    assert service.visited == [*planned, "home"]
    assert service.visited.count("kitchen") == (math.ceil(len(tables) / trays) if trays else 1)
    assert service.outcomes == [OrderOutcome("a", tuple(tables), 0, "")]


@given(
    tables=st.lists(st.sampled_from(PLACES), min_size=1, max_size=7),
    trays=st.integers(0, 4),
    taken=st.lists(st.booleans(), min_size=30, max_size=30),
)
def test_what_is_left_is_what_it_will_visit(tables: list[str], trays: int, taken: list[bool]) -> None:
    """At every step, also where nobody takes the food; of the last trip it goes back once that is known."""
    service = Service(trays, *tables)
    promises: list[tuple[int, tuple[str, ...]]] = []
    for take in taken:
        status = service.round.status
        if service.round.in_progress and status.state not in ("returning", "unloading"):
            left = stops_left(status, status.queue, trays, "kitchen")
            promises.append((len(service.visited), (*left, "home")))
        if service.round.in_progress:
            service.step(take=take)
    service.until("failed" if service.round.status.skipped_reasons else "idle")
    for begin, left in promises:
        visited = tuple(service.visited[begin:])
        assert visited in (left, (*left[:-1], "kitchen", "home"))


def test_food_that_goes_back_is_among_the_stops() -> None:
    service = Service(0, "table_1", "table_2")
    one = service.until("waiting", "table_1")
    one.skip()
    assert stops_left(one.status, one.status.queue, 0, "kitchen") == ("table_2", "kitchen")


def test_the_kitchen_reads_which_food_goes_on_which_tray() -> None:
    service = Service(2, "table_7", "table_4", "table_2")
    one = service.until("loading")
    assert "Load tray 1: table 7; tray 2: table 4. Then press 'Loaded'." in one.status.description
    service.step()
    assert one.status.on_trays == ("table_7", "table_4")
    one = service.until("waiting", "table_4")
    assert one.status.on_trays == ("", "table_4")
    assert one.status.description == "Your food is here on tray 2, table 4. Please take it and press 'Taken'."
    service.step()
    assert (one.status.state, one.status.place, one.status.loaded) == ("driving", "kitchen", False)
    one = service.until("loading")
    assert "Load tray 1: table 2." in one.status.description


def test_one_tray_needs_no_number() -> None:
    service = Service(1, "table_7", "table_4")
    assert "Load the food for table 7, then press" in service.until("loading").status.description
    assert service.until("waiting").status.description.startswith("Your food is here, table 7.")


def test_tables_on_the_trays_come_before_those_in_the_kitchen() -> None:
    service = Service(2, "table_1", "table_2", "table_3", "table_4")
    one = service.until("driving", "table_1")
    one.change_queue("a", ["table_4", "table_3", "table_2"])
    assert one.status.queue == ("table_2", "table_4", "table_3")
    service.until("idle")
    assert service.visited[-7:] == ["kitchen", "table_1", "table_2", "kitchen", "table_4", "table_3", "home"]


def test_before_loading_the_order_decides_what_is_loaded() -> None:
    service = Service(2, "table_1", "table_2", "table_3")
    one = service.until("driving", "kitchen")
    one.change_queue("a", ["table_3", "table_2", "table_1"])
    service.until("loading")
    assert "tray 1: table 3; tray 2: table 2." in one.status.description
    service.step()
    assert one.status.on_trays == ("table_3", "table_2")


@pytest.mark.parametrize("queue", [("table_2", "table_1", "table_3"), ("table_2", "table_3"), ("table_1",)])
def test_trays_that_are_being_loaded_keep_their_tables(queue: tuple[str, ...]) -> None:
    service = Service(2, "table_1", "table_2", "table_3")
    one = service.until("loading")
    before = one.status
    with pytest.raises(OrderError, match="being loaded"):
        one.change_queue("a", queue)
    assert one.status == before
    one.change_queue("a", ("table_1", "table_2"))
    service.step()
    assert one.status.on_trays == ("table_1", "table_2") and one.status.skipped_reasons


def test_a_table_is_not_moved_before_those_with_food_on_a_tray() -> None:
    service = Service(2, "table_1", "table_2", "table_3", "table_4")
    one = service.until("driving", "table_1")
    with pytest.raises(OrderError, match="served first"):
        one.change_queue("a", ("table_3", "table_2", "table_4"))
    one.change_queue("a", ("table_2", "table_4", "table_3"))
    assert one.status.queue == ("table_2", "table_4", "table_3")


def test_food_that_nobody_took_is_brought_back_to_the_kitchen() -> None:
    service = Service(2, "table_1", "table_2", "table_3")
    one = service.until("waiting", "table_1")
    one.skip()
    assert one.status.on_trays == ("", "table_2")
    one = service.until("loading")
    assert one.status.on_trays == () and one.status.queue == ("table_3",)
    service.until("failed")
    assert one.status.delivered == ("table_2", "table_3")


@pytest.mark.parametrize("trays", [0, 2])
def test_back_to_the_kitchen_everything_is_loaded_again(trays: int) -> None:
    service = Service(trays, "table_1", "table_2", "table_3")
    one = service.until("driving", "table_2")
    one.stop(True)
    one.stop(False)
    one.choose("kitchen")
    assert one.status.on_trays == () and one.status.queue == ("table_2", "table_3")
    service.until("idle")
    assert service.visited[-4:] == ["kitchen", "table_2", "table_3", "home"]
