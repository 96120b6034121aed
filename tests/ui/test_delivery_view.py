"""Tests the delivery layer of the web UI and the messages of its status."""

from __future__ import annotations

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.delivery import status_messages
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Errand, Order
from chefbot.msgs.std_msgs import String
from chefbot.ui import commands as do
from chefbot.ui.delivery_view import activity, delivery_view, is_errand, validate_command
from chefbot.ui.display.views import MappingView, WaitingOrderView

PLACES = ("home", "kitchen", "table_1", "table_2")
STATES = ("idle", "loading", "driving", "waiting", "returning", "unloading", "errand", "failed")


@given(st.sampled_from(STATES), st.sampled_from(["", "stop", "errand", "choice"]), st.booleans())
def test_the_view_follows_the_status(state: str, hold: str, loaded: bool) -> None:
    status = DeliveryStatus(
        state=state, place="table_1", queue=("table_2",), description="text", hold_reason=hold, loaded=loaded
    )
    view = delivery_view(status, "")
    assert (view.state, view.place, view.queue, view.step) == (state, "table_1", ("table_2",), "text")
    assert view.round_active == (state in status_messages.ROUND_STATES)
    assert (hold == "choice") == (view.waits_for == "choice") == ("end" in view.choices)
    brings_back = loaded and state in ("driving", "waiting") if hold == "choice" else state == "waiting"
    assert ("kitchen" in view.choices) == brings_back


@pytest.mark.parametrize(
    ("status", "sentence"),
    [
        (DeliveryStatus(state="waiting"), "Your food is here, table 1. Please take it."),
        (DeliveryStatus(state="loading"), "At table 1."),
        (DeliveryStatus(state="unloading"), "At table 1."),
        (DeliveryStatus(state="waiting", hold_reason="choice"), "The robot waits. Please call the staff."),
        (DeliveryStatus(state="driving"), "text"),
    ],
)
def test_a_guest_reads_of_no_button(status: DeliveryStatus, sentence: str) -> None:
    status = msgspec.structs.replace(status, place="table_1", description="text")
    assert delivery_view(status, "").guest_step == sentence
    assert delivery_view(status, "The order was not accepted.").guest_step == "The order was not accepted."


def test_an_unanswered_order_replaces_the_description() -> None:
    status = DeliveryStatus(description="text", pending_orders=(Order(("table_1", "table_2"), "a"),))
    view = delivery_view(status, "The order was not accepted.")
    assert view.step == "The order was not accepted."
    assert view.orders == (WaitingOrderView(id="a", places=("table_1", "table_2")),)


def test_the_round_comes_before_exploration_and_phase() -> None:
    idle = DeliveryStatus(state="idle", description="idle")
    driving = DeliveryStatus(state="driving", description="driving")
    exploring = MappingView(exploring=True, description="exploring")
    patrol = String("patrol")
    assert activity(patrol, driving, "", exploring) == "driving"
    assert activity(patrol, idle, "not accepted", exploring) == "not accepted"
    assert activity(patrol, idle, "", exploring) == "exploring"
    assert activity(patrol, idle, "", MappingView(description="explored")) == "patrol"
    assert activity(String(""), idle, "", MappingView()) == activity(None, idle, "", MappingView()) == "idle"
    assert activity(None, DeliveryStatus(), "", MappingView()) == ""


def test_only_the_round_that_was_seen_is_changed() -> None:
    status = DeliveryStatus(state="driving", place="table_1", queue=("table_2", "kitchen"), order_id="a")
    validate_command(do.ChangeQueue(["kitchen", "table_2"], "a"), PLACES, status)
    validate_command(do.ChangeQueue([], "a"), PLACES, status)
    for order_id, place in (("b", "table_2"), ("a", "table_1"), ("a", "moon")):
        command = do.ChangeQueue([place], order_id)
        with pytest.raises(UserError, match="has changed in the meantime"):
            validate_command(command, PLACES, status)


def test_a_change_of_a_queue_that_has_changed_is_refused() -> None:
    status = DeliveryStatus(state="driving", queue=("table_2", "kitchen"), order_id="a")
    validate_command(do.ChangeQueue(["kitchen"], "a", ["table_2", "kitchen"]), PLACES, status)
    with pytest.raises(UserError, match="has changed in the meantime"):
        validate_command(do.ChangeQueue(["kitchen"], "a", ["kitchen", "table_2"]), PLACES, status)


def test_a_waiting_order_is_changed_by_its_id() -> None:
    orders = (Order(("table_1", "table_2"), "b"), Order(("table_2",), ""))
    status = DeliveryStatus(state="driving", queue=("table_2",), order_id="a", pending_orders=orders)
    for tables in ([], ["table_2"]):
        validate_command(do.ChangeQueue(tables, "b"), PLACES, status)
    for command in (do.ChangeQueue(["kitchen"], "b"), do.ChangeQueue([], ""), do.ShortestOrder("b")):
        with pytest.raises(UserError, match="has changed in the meantime"):
            validate_command(command, PLACES, status)


def test_an_order_that_another_person_cancelled_has_ended() -> None:
    status = DeliveryStatus(state="driving", queue=("table_2",), order_id="a")
    with pytest.raises(UserError, match="already ended or was cancelled"):
        validate_command(do.ChangeQueue([], "b"), PLACES, status)


@pytest.mark.parametrize("state", STATES)
def test_tables_that_were_given_up_can_be_ordered_again(state: str) -> None:
    places = ("table_1", "table_2", "table_3")
    status = DeliveryStatus(state=state, places=places, delivered=("table_2",))
    is_over = state not in ("loading", "driving", "waiting")
    assert delivery_view(status, "").unserved == (("table_1", "table_3") if is_over else ())
    ordered = DeliveryStatus(
        state=state, places=places, delivered=("table_2",), pending_orders=(Order(("table_3",)),)
    )
    assert delivery_view(ordered, "").unserved == (("table_1",) if is_over else ())


@pytest.mark.parametrize(
    ("command", "states"),
    [
        (do.Loaded(), ("loading",)),
        (do.Taken("table_1"), ("waiting", "unloading")),
        (do.NotTaken(), ("waiting",)),
    ],
)
def test_a_confirmation_is_valid_in_its_state_and_place_only(
    command: do.OperatorCommand, states: tuple[str, ...]
) -> None:
    for other in STATES:
        status = DeliveryStatus(state=other, place="table_1", description="Idle.")
        if other in states:
            validate_command(command, PLACES, status)
        else:
            waits = other in ("loading", "waiting", "unloading")
            problem = (
                "waits for another confirmation: Idle" if waits else "No confirmation is expected now: Idle"
            )
            with pytest.raises(UserError, match=problem):
                validate_command(command, PLACES, status)
    late = type(command)("table_2")  # type: ignore[call-arg]
    with pytest.raises(UserError, match="has left table 2"):
        validate_command(late, PLACES, DeliveryStatus(state=states[0], place="table_1"))


def test_unknown_places_are_rejected() -> None:
    for command in (do.GoPlace("cellar"), do.Deliver(["table_1", "cellar"])):
        with pytest.raises(UserError, match="no place called cellar"):
            validate_command(command, PLACES, DeliveryStatus(state="idle"))
    validate_command(do.Deliver(["table_1"]), PLACES, DeliveryStatus(state="idle"))


def test_an_order_needs_a_launch_with_deliveries() -> None:
    with pytest.raises(UserError, match="takes no orders"):
        validate_command(do.Deliver(["table_1"]), PLACES, DeliveryStatus())


def test_a_held_round_goes_nowhere_during_an_emergency_stop() -> None:
    held = DeliveryStatus(state="driving", place="table_1", hold_reason="stop")
    for command in (do.GoPlace("kitchen", "now"), do.Goal(1.0, 2.0, 0.0, "instead"), do.Choose("go_on")):
        with pytest.raises(UserError, match="Release STOP first"):
            validate_command(command, PLACES, held)
    validate_command(do.GoPlace("kitchen", "after"), PLACES, held)


def test_a_place_that_a_delivery_needs_is_not_deleted() -> None:
    status = DeliveryStatus(state="driving", place="table_1", queue=("table_1", "table_2"))
    for name in ("table_1", "table_2"):
        with pytest.raises(UserError, match=f"is to serve {name.replace('_', ' ')}; leave it out"):
            validate_command(do.DeletePlace(name), PLACES, status)
        validate_command(do.DeletePlace(name), PLACES, DeliveryStatus(state="idle"))
    waits = DeliveryStatus(
        state="idle", pending_orders=(Order(("table_2",), "a"),), errands=(Errand("table_1", when="after"),)
    )
    for name, sentence in (
        ("table_1", "is to serve table 1; leave it out"),
        ("table_2", "for table 2 waits; cancel"),
    ):
        with pytest.raises(UserError, match=sentence):
            validate_command(do.DeletePlace(name), PLACES, waits)
    for name in ("kitchen", "home"):
        with pytest.raises(UserError, match=f"Deliveries need {name}; move it instead"):
            validate_command(do.DeletePlace(name), PLACES, DeliveryStatus(state="idle"))


def test_the_place_on_the_way_to_which_the_robot_is_stays() -> None:
    status = DeliveryStatus(state="driving", place="table_1", queue=("table_1", "table_2"))
    move = do.PutPlace(1.0, 2.0, 0.0, "table_1")
    with pytest.raises(UserError, match="on its way to table 1; move it once the robot is there"):
        validate_command(move, PLACES, status)
    for allowed, now in (
        (move, msgspec.structs.replace(status, state="waiting")),
        (do.PutPlace(1.0, 2.0, 0.0, "table_2"), status),
        (do.PutPlace(1.0, 2.0, 0.0, "table_1", moved=False, label="Window"), status),
    ):
        validate_command(allowed, PLACES, now)


def test_a_goal_during_a_round_needs_a_time() -> None:
    for state in STATES:
        status = DeliveryStatus(state=state)
        validate_command(do.Goal(1.0, 2.0, 0.0, "after"), PLACES, status)
        if state in status_messages.ROUND_STATES:
            with pytest.raises(UserError, match="choose when"):
                validate_command(do.Goal(1.0, 2.0, 0.0), PLACES, status)
        assert is_errand("after", status) == (state in status_messages.ROUND_STATES)
        assert not is_errand("", status)


@given(st.lists(st.from_regex(r"[a-z]{1,5}(_[0-9])?", fullmatch=True), min_size=1, max_size=5))
def test_a_list_of_names_reads_as_a_sentence(names: list[str]) -> None:
    text = status_messages.join_names(names)
    assert "_" not in text and text.count(" and ") == (len(names) > 1)
    assert text.replace(" and ", ", ").split(", ") == [status_messages.display_name(name) for name in names]


@pytest.mark.parametrize("state", ["idle", "returning", "driving"])
def test_the_choices_depend_on_the_state(state: str) -> None:
    for loaded in (True, False):
        status = DeliveryStatus(state=state, place="table_1", loaded=loaded)
        text = status_messages.choose(status, "Released.")
        waits = "An order" if state == "idle" else "The round"
        assert text.startswith(f"Released. {waits} waits.") and text.endswith(".")
        assert ("kitchen" in text) == (state == "driving" and loaded)


@pytest.mark.parametrize(
    ("reason", "is_failed"),
    [
        ("table 1: nobody took the food", False),
        ("table 1 was not reached: no path leads to the goal", True),
        (None, True),
    ],
)
def test_what_people_did_is_no_failure_of_the_robot(reason: str | None, is_failed: bool) -> None:
    status = DeliveryStatus(state="failed", skipped_reasons=(reason,) if reason else ())
    assert delivery_view(status, "").failed == is_failed
    assert not delivery_view(msgspec.structs.replace(status, state="idle"), "").failed


def test_unserved_tables_are_listed() -> None:
    assert status_messages.ended([]) == "The round was ended."
    assert "table 1 and table 2" in status_messages.ended(["table_1", "table_2"])
    assert "the place on the map" in status_messages.on_the_way("") and "table 1" in status_messages.at(
        "table_1"
    )


@pytest.mark.parametrize("command", [do.Patrol(["kitchen"]), do.Follow(7), do.MapBuilding()])
def test_other_missions_wait_for_the_end_of_a_round(command: do.OperatorCommand) -> None:
    validate_command(command, PLACES, DeliveryStatus(state="idle"))
    with pytest.raises(UserError, match="end it first"):
        validate_command(command, PLACES, DeliveryStatus(state="driving"))
    with pytest.raises(UserError, match="end it first"):
        validate_command(command, PLACES, DeliveryStatus(state="returning", untaken=("table_1",)))


def test_the_drive_home_excludes_no_other_drive() -> None:
    going_home = DeliveryStatus(state="returning", place="home")
    validate_command(do.Patrol(["kitchen"]), PLACES, going_home)
    validate_command(do.Follow(7), PLACES, going_home)


def test_a_patrol_to_an_unknown_place_is_refused() -> None:
    with pytest.raises(UserError, match="no place called bar"):
        validate_command(do.Patrol(["kitchen", "bar"]), PLACES, DeliveryStatus(state="idle"))


def test_food_is_not_ordered_to_the_kitchen() -> None:
    for state in ("idle", "driving"):
        with pytest.raises(UserError, match="food comes from kitchen; order it to another place"):
            validate_command(do.Deliver(["table_1", "kitchen"]), PLACES, DeliveryStatus(state=state))
