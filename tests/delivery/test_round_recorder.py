"""What the history notes of rounds that the delivery mission makes, also over a restart of the recording process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.status_messages import ORDER_CANCELLED
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Errand, Order
from chefbot.storage.delivery_history import DeliveryHistory, RecordedRound
from chefbot.storage.history_file import utc_now
from chefbot.ui.missions.round_recorder import CANCELLED, NOT_SERVED, TAKEN, RoundRecorder


class Recorded:
    """A round whose every status is recorded, as the web UI does that shows it."""

    def __init__(self, path: Path) -> None:
        self.history = DeliveryHistory(path)
        self.round = DeliveryRound("kitchen", "home", lambda places: places, lambda _: self.note())
        self.restart()

    def restart(self) -> None:
        """Record by a new process, to which the last status is sent."""
        self.recorder = RoundRecorder(self.history, lambda: {"table_9": "Window"}, simulated=False)
        self.note()

    def note(self) -> None:
        self.recorder.process(self.round.status, utc_now())

    def do(self, *steps: Callable[[], None]) -> None:
        for step in steps:
            step()
            self.note()

    def order(self, *places: str, number: str = "a") -> None:
        self.do(lambda: self.round.order(Order(places, number, "anna")))

    def serve(self) -> None:
        """Reach the next table, where the food is taken."""
        self.do(self.round.arrived, self.round.taken)

    @property
    def outcomes(self) -> list[tuple[str, str]]:
        return [(stop.place, stop.outcome) for one in self.rounds for stop in one.stops]

    @property
    def rounds(self) -> list[RecordedRound]:
        return self.history.rounds(10)


@pytest.fixture
def one(tmp_path: Path) -> Recorded:
    return Recorded(tmp_path / "one.sqlite")


@pytest.mark.parametrize("restarts", [False, True])
def test_every_table_of_a_round_has_its_outcome(one: Recorded, restarts: bool) -> None:
    one.order("table_1", "table_12", "table_1", "table_3")
    one.do(one.round.arrived, one.round.loaded)
    one.serve()
    if restarts:
        one.restart()
    one.do(lambda: one.round.arrived("a door is closed"))
    if restarts:
        one.restart()
    one.serve()
    one.do(one.round.arrived, one.round.skip)
    one.serve()  # the food that nobody took, in the kitchen
    one.do(one.round.arrived)
    assert [stop[0] for stop in one.outcomes] == ["table_1", "table_12", "table_1", "table_3"]
    first, second, third, fourth = (stop[1] for stop in one.outcomes)
    assert (first, third) == (TAKEN, TAKEN)
    assert (second, fourth) == ("was not reached: a door is closed", "nobody took the food")
    (recorded,) = one.rounds
    assert recorded.ordered_by == "anna" and recorded.loaded and recorded.ended
    assert recorded.outcome == "2 of 4 places served."


def test_a_cancelled_round_leaves_no_table_open(one: Recorded) -> None:
    one.order("table_1", "table_2")
    one.do(one.round.arrived, one.round.loaded)
    one.serve()
    one.do(one.round.cancel)
    assert one.outcomes == [("table_1", TAKEN), ("table_2", NOT_SERVED)]
    assert one.rounds[0].outcome == "The delivery was cancelled."


def test_an_outcome_contains_no_question(one: Recorded) -> None:
    one.order("table_1", number="a")
    one.order("table_2", number="b")
    one.do(lambda: one.round.stop(True), lambda: one.round.stop(False), lambda: one.round.choose("end"))
    assert "Choose" in one.round.status.description, "what to do with the order that waits"
    assert one.rounds[0].outcome == "The round was ended; not served: table 1."


def test_the_order_that_waited_is_a_round_of_its_own(one: Recorded) -> None:
    one.order("table_1", number="a")
    one.order("table_1", number="b")
    for _ in range(2):
        one.do(one.round.arrived, one.round.loaded)
        one.serve()
    one.do(one.round.arrived)
    assert one.outcomes == [("table_1", TAKEN)] * 2
    assert [bool(recorded.ended) for recorded in one.rounds] == [True, True]


def test_a_round_that_another_one_follows_at_once_has_an_outcome(one: Recorded) -> None:
    one.order("table_1", number="a")
    one.round.order(Order(("table_2",), "b", "ben"))
    one.restart()  # orders that wait keep their person
    one.round.withdraw("a")
    one.note()
    assert [recorded.outcome for recorded in one.rounds] == ["The delivery was cancelled.", ""]
    assert [recorded.ordered_by for recorded in one.rounds] == ["anna", "ben"]


@pytest.mark.parametrize(
    ("reason", "outcome"), [("", "All places were served."), ("no path", "0 of 1 place served.")]
)
def test_a_round_that_an_errand_follows_has_an_outcome(one: Recorded, reason: str, outcome: str) -> None:
    one.order("table_1")
    one.do(one.round.arrived, one.round.loaded, lambda: one.round.go(Errand("room_1", when="after")))
    one.do(
        lambda: one.round.arrived(reason),
        one.round.taken,
        one.round.arrived,
        one.round.taken,
        one.round.arrived,
    )
    assert one.rounds[0].outcome == outcome
    assert one.outcomes == [("table_1", TAKEN if not reason else f"was not reached: {reason}")]


def test_orders_that_wait_are_recorded_with_what_became_of_them(one: Recorded) -> None:
    for number, places in (("a", ("table_1",)), ("b", ("table_2", "table_3")), ("c", ("table_4",))):
        one.order(*places, number=number)
    assert [bool(recorded.ended) for recorded in one.rounds] == [False] * 3
    one.restart()
    one.do(lambda: one.round.change_queue("b", ("table_3",)), lambda: one.round.withdraw("c"))
    assert [stop.place for stop in one.rounds[1].stops] == ["table_3"]
    assert one.rounds[2].outcome == ORDER_CANCELLED and one.outcomes[-1] == ("table_4", CANCELLED)
    one.do(lambda: one.round.withdraw("a"))
    assert len(one.rounds) == 3 and not one.rounds[1].ended, "the second one has begun"
    one.do(one.round.cancel)
    assert one.rounds[1].outcome == "The delivery was cancelled."


def test_a_place_keeps_the_label_that_it_had(one: Recorded) -> None:
    one.order("table_1", "table_9")
    assert [stop.label for stop in one.rounds[0].stops] == ["", "Window"]


def test_a_refused_order_has_its_reason(one: Recorded) -> None:
    one.order("table_1", number="a")
    one.order("cellar", number="b")

    def resolve(places: tuple[str, ...]) -> tuple[str, ...]:
        raise UserError("there is no place called cellar")

    one.round._resolve = resolve  # the map has changed in the meantime
    one.do(lambda: one.round.withdraw("a"))
    assert one.rounds[1].outcome == "On this map there is no place called cellar."


def test_a_drive_home_to_be_charged_is_not_a_round(one: Recorded) -> None:
    one.recorder.process(DeliveryStatus(state="returning", place="home"), utc_now())
    assert one.rounds == []


def test_food_that_went_back_to_the_kitchen_is_loaded_once(one: Recorded) -> None:
    one.order("table_1")
    one.do(one.round.arrived, one.round.loaded)
    loaded = one.rounds[0].loaded
    one.do(lambda: one.round.stop(True), lambda: one.round.stop(False), lambda: one.round.choose("kitchen"))
    one.do(one.round.arrived, one.round.loaded)
    one.serve()
    assert one.outcomes == [("table_1", TAKEN)] and one.rounds[0].loaded == loaded


def test_nothing_new_is_not_reported_as_a_change(one: Recorded) -> None:
    assert not one.recorder.process(one.round.status, utc_now())
    one.round.order(Order(("table_1",), "a"))
    assert one.recorder.process(one.round.status, utc_now())
    assert not one.recorder.process(one.round.status, utc_now())
