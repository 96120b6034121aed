"""The commands of `chefbot drive` and `chefbot map save` against a served web UI."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from tests.support.fake_robot import fake_robot
from tests.support.waiting import PATIENCE

from chefbot.cli import running_robot
from chefbot.cli.drive.goals import (
    cancel_goal,
    cancel_order,
    press_stop,
    release_stop,
    send_follow,
    send_goal,
    send_patrol,
)
from chefbot.cli.drive.orders import confirm_step, order_delivery
from chefbot.errors import UserError
from chefbot.ui.commands import (
    Cancel,
    ChangeQueue,
    Deliver,
    Follow,
    Goal,
    GoPlace,
    Loaded,
    Patrol,
    ReleaseStop,
    Stop,
)
from chefbot.ui.display.views import DeliveryView, StatusView, StopView, WaitingOrderView


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running_robot, "RESPONSE_TIMEOUT", 0.5)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """For what raises as soon as it is known: on a busy computer a refusal takes its time."""
    monkeypatch.setattr(running_robot, "REFUSAL_TIMEOUT", PATIENCE)


@pytest.mark.parametrize(
    ("fate", "code", "expected"),
    [
        ("home", 0, "At home, waiting for an order."),
        ("failed", 1, "table_1 was not reached."),
        ("cancelled", 1, "not delivered: table_2"),
        (
            "behind",
            0,
            "Behind other orders: the robot is on the way to table 9.\nBehind other orders: table_9 was not reached.",
        ),
        ("followed", 1, "not delivered: table_2"),
    ],
)
@pytest.mark.slow
def test_deliver_waits_and_reports_the_outcome(
    fate: str, code: int, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with fake_robot(fate) as robot:
        robot.show_places()
        robot.show_waiting_for_order()
        assert order_delivery(["1", "table 2"], robot.url, wait=True) == code
        assert robot.commands.get(timeout=PATIENCE) == Deliver(["table_1", "table_2"])
    assert expected in capsys.readouterr().out


@pytest.mark.slow
def test_deliver_returns_at_once_without_wait(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.show_places()
        robot.show_waiting_for_order()
        assert order_delivery(["2"], robot.url, wait=False) == 0
        assert robot.commands.get(timeout=PATIENCE) == Deliver(["table_2"])
    assert capsys.readouterr().out == "ordered: 窗边 2\n"


def test_a_refused_order_is_reported() -> None:
    with fake_robot("refused") as robot:
        robot.show_places()
        robot.show_waiting_for_order()
        for wait in (True, False):
            with pytest.raises(UserError, match="not today"):
                order_delivery(["2"], robot.url, wait)


def test_an_order_for_which_the_battery_is_too_low_is_reported() -> None:
    with fake_robot("flat") as robot:
        robot.show_places()
        robot.show_waiting_for_order()
        with pytest.raises(UserError, match=r"not ordered: Table_2 refused: the battery is at 4 %"):
            order_delivery(["2"], robot.url, wait=False)


@pytest.mark.slow
def test_an_order_behind_another_one_is_accepted(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot("behind") as robot:
        robot.show_places()
        robot.show_waiting_for_order()
        assert order_delivery(["2"], robot.url, wait=False) == 0
    assert capsys.readouterr().out == "ordered: 窗边 2\n"


def test_an_unknown_table_is_refused_with_the_nearest_name() -> None:
    with fake_robot() as robot:
        robot.show_places()
        robot.show_waiting_for_order()
        with pytest.raises(UserError, match=r"'kitchn'.*did you mean 'kitchen'"):
            order_delivery(["1", "kitchn"], robot.url, wait=True)
        assert robot.commands.empty()


@pytest.mark.slow
def test_confirm_shows_and_confirms_the_pending_step(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with fake_robot() as robot:
        robot.show_waiting_for_food()
        assert confirm_step("", robot.url) == 0
        assert (
            f"In the kitchen.\n  chefbot drive confirm loaded --page '{robot.url}'" in capsys.readouterr().out
        )
        with pytest.raises(UserError, match="does not wait for"):
            confirm_step("go-on", robot.url)
        assert confirm_step("loaded", robot.url) == 0
        assert robot.commands.get(timeout=PATIENCE) == Loaded()
    assert capsys.readouterr().out == "On the way to table_1.\n"


@pytest.mark.slow
def test_confirm_and_deliver_print_why_the_robot_stands(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.show_places()
        robot.show_stop("The lidar sends no data.")
        robot.show_waiting_for_food()
        assert confirm_step("", robot.url) == 0
        assert "In the kitchen.\n  The lidar sends no data.\n" in capsys.readouterr().out
        assert order_delivery(["1"], robot.url, wait=True) == 0
    out = capsys.readouterr().out
    assert out.count("  The lidar sends no data.\n") == 1 and "Something was near" not in out


@pytest.mark.slow
def test_a_press_that_changes_nothing_fails() -> None:
    with fake_robot() as robot:
        robot.show_waiting_for_food()
        assert confirm_step("taken", robot.url) == 1


@pytest.mark.slow
def test_robot_without_delivery_names_the_launch_that_has_it() -> None:
    with fake_robot() as robot:
        with pytest.raises(UserError, match="amcl_demo"):
            order_delivery(["1"], robot.url, wait=True)
        robot.show_places()
        with pytest.raises(UserError, match="amcl_demo"):
            order_delivery(["1"], robot.url, wait=True)


@pytest.mark.parametrize(
    ("target", "command"),
    [
        (["kitchen"], GoPlace("kitchen")),
        (["table", "2"], GoPlace("table_2")),
        (["2"], GoPlace("table_2")),
        (["1.5", "-2"], Goal(1.5, -2.0, 0.0)),
        (["1", "2", "90"], Goal(1.0, 2.0, pytest.approx(np.pi / 2))),
    ],
)
@pytest.mark.slow
def test_goto_sends_a_place_or_a_pose(target: list[str], command: Goal | GoPlace) -> None:
    with fake_robot() as robot:
        robot.show_places()
        send_goal(target, robot.url)
        assert robot.commands.get(timeout=PATIENCE) == command


@pytest.mark.parametrize(
    ("target", "sentence"),
    [
        (["kitchn"], "did you mean 'kitchen'"),
        (["1", "2", "3", "4"], "X Y"),
        (["nan", "3"], "finite numbers"),
        (["1", "2", "inf"], "finite"),
    ],
)
def test_an_invalid_target_is_reported_in_one_sentence(target: list[str], sentence: str) -> None:
    with fake_robot() as robot:
        robot.show_places()
        with pytest.raises(UserError, match=sentence):
            send_goal(target, robot.url)
        assert robot.commands.empty()


@pytest.mark.slow
def test_a_goal_during_a_delivery_has_its_time(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.show_waiting_for_food()
        send_goal(["1", "2"], robot.url, "after")
        assert robot.commands.get(timeout=PATIENCE) == Goal(1.0, 2.0, 0.0, "after")
    assert capsys.readouterr().out == "The robot drives to 1 2 after the round.\n"


@pytest.mark.slow
def test_a_goal_after_the_round_is_driven_to_without_one(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.show_waiting_for_order()
        send_goal(["1", "2"], robot.url, "after")
    assert capsys.readouterr().out.startswith("Driving to 1 2;")


def test_an_unknown_table_number_is_answered_with_the_places() -> None:
    with fake_robot() as robot:
        robot.show_places()
        with pytest.raises(UserError, match=r"no place called '77' \(known: .*kitchen.*table_1"):
            send_goal(["77"], robot.url)


@pytest.mark.usefixtures("patient")
def test_a_refused_goal_raises_its_sentence() -> None:
    with fake_robot("refused") as robot:
        robot.show_places()
        with pytest.raises(UserError, match="not today"):
            send_goal(["kitchen"], robot.url)


@pytest.mark.usefixtures("patient")
@pytest.mark.parametrize("before", [0, 3])
@pytest.mark.slow
def test_a_goal_that_fails_at_once_raises_its_reason(before: int) -> None:
    with fake_robot("unreachable") as robot:
        robot.show_failures(before, "An older reason.")
        with pytest.raises(UserError, match=r"^The goal lies outside the map\.$"):
            send_goal(["50", "50"], robot.url)


@pytest.mark.usefixtures("patient")
@pytest.mark.parametrize(
    "send", [lambda url: send_patrol(["kitchen"], 1, False, url), lambda url: send_follow(0, url)]
)
@pytest.mark.slow
def test_a_patrol_or_follow_that_fails_at_once_raises_its_reason(send: Callable[[str], None]) -> None:
    with fake_robot("unreachable") as robot:
        robot.show_places()
        with pytest.raises(UserError, match=r"^The goal lies outside the map\.$"):
            send(robot.url)


@pytest.mark.slow
def test_a_place_is_found_by_its_label() -> None:
    with fake_robot() as robot:
        robot.show_places()
        send_goal(["窗边", "2"], robot.url)
        assert robot.commands.get(timeout=PATIENCE) == GoPlace("table_2")


@pytest.mark.slow
def test_an_older_failure_is_not_that_of_the_goal(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.show_failures(3, "An older reason.")
        send_goal(["1", "2"], robot.url)
    assert capsys.readouterr().out.startswith("Driving to 1 2;")


@pytest.mark.slow
def test_cancel_is_sent() -> None:
    with fake_robot() as robot:
        cancel_goal(robot.url)
        assert robot.commands.get(timeout=PATIENCE) == Cancel()


@pytest.mark.slow
def test_one_waiting_order_is_cancelled_by_its_number(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        orders = tuple(WaitingOrderView(id=key, places=(f"table_{key}",)) for key in "12")
        robot.server.set_layer("delivery", DeliveryView(state="driving", orders=orders))
        with pytest.raises(UserError, match="there is no waiting order 3"):
            cancel_order(3, robot.url)
        cancel_order(2, robot.url)
        assert robot.commands.get(timeout=PATIENCE) == ChangeQueue([], "2")
    assert capsys.readouterr().out == "The order to table 2 is cancelled.\n"


@pytest.mark.slow
def test_stop_without_confirmation_gives_exit_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        assert press_stop(robot.url) == 1
        assert isinstance(robot.commands.get(timeout=PATIENCE), Stop)
    assert "has not confirmed" in capsys.readouterr().out


def test_stop_waits_for_the_confirmation_of_its_own_press(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running_robot, "RESPONSE_TIMEOUT", PATIENCE)
    with fake_robot() as robot:

        def confirm() -> None:
            press = robot.commands.get(timeout=PATIENCE)
            assert isinstance(press, Stop)
            robot.server.set_layer("stop", StopView(stopped=True, confirmed=("another", press.id)))

        with ThreadPoolExecutor(1) as pool:
            confirmed = pool.submit(confirm)
            assert press_stop(robot.url) == 0
            confirmed.result()


@pytest.mark.slow
def test_release_names_the_press_that_it_releases() -> None:
    with fake_robot() as robot:
        robot.server.set_layer("stop", StopView(stopped=True, pressed="17"))
        assert release_stop(robot.url) == 1
        assert robot.commands.get(timeout=PATIENCE) == ReleaseStop("17")


@pytest.mark.slow
def test_a_release_without_a_stop_claims_none(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.server.set_layer("stop", StopView())
        assert release_stop(robot.url) == 0
    assert capsys.readouterr().out.strip() == "No emergency stop is active."


@pytest.mark.slow
def test_a_refused_release_states_the_reason(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.server.set_layer("stop", StopView(stopped=True, pressed="17"))
        robot.server.set_layer("status", StatusView(reason="The robot lies on its side."))
        assert release_stop(robot.url) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert printed == "The emergency stop is still active. The robot lies on its side."


@pytest.mark.slow
def test_a_patrol_has_names_of_places_and_rounds(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        with pytest.raises(UserError, match="no named places"):
            send_patrol(["kitchen"], 1, False, robot.url)
        robot.show_places()
        send_patrol(["kitchen", "2"], 0, False, robot.url)
        assert robot.commands.get(timeout=PATIENCE) == Patrol(["kitchen", "table_2"], 0)
        send_patrol(["1"], 3, True, robot.url)
        assert robot.commands.get(timeout=PATIENCE) == Patrol(["table_1"], 3, True)
        with pytest.raises(UserError, match="did you mean 'kitchen'"):
            send_patrol(["kitchn"], 1, False, robot.url)
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        "Patrolling kitchen, table_2 until `chefbot drive cancel`.",
        "Patrolling table_1 in 3 rounds.",
    ]


@pytest.mark.parametrize(("person", "expected"), [(0, "the nearest person ahead"), (7, "person 7")])
@pytest.mark.slow
def test_follow_sends_the_number(person: int, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        send_follow(person, robot.url)
        assert robot.commands.get(timeout=PATIENCE) == Follow(person)
    assert capsys.readouterr().out.startswith(f"Following {expected};")
