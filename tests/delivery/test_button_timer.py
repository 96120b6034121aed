"""The timer that replaces the buttons: one press per arrival, none after the round went on or was held."""

from __future__ import annotations

import pytest

from chefbot.delivery.button_timer import ButtonTimer
from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.params import DeliveryParams
from chefbot.msgs.chefbot_msgs import Order

PARAMS = DeliveryParams(loading_timeout=2.0, pickup_timeout=3.0)


@pytest.fixture
def mission() -> DeliveryRound:
    mission = DeliveryRound("kitchen", "home", lambda names: names, lambda _: None)
    mission.order(Order(("table_1",), "a"))
    mission.arrived()
    assert mission.status.state == "loading"
    return mission


def test_each_button_is_pressed_after_its_own_time(mission: DeliveryRound) -> None:
    timer, states = ButtonTimer(), []
    for _ in range(2):
        press = timer.update(mission, PARAMS)
        assert press is not None and timer.update(mission, PARAMS) is None
        states.append((press.state, press.seconds))
        assert timer.elapse(press, mission)
        mission.arrived()
    assert states == [("loading", 2.0), ("waiting", 3.0)] and mission.status.state == "idle"


def test_without_times_no_button_is_pressed(mission: DeliveryRound) -> None:
    assert ButtonTimer().update(mission, DeliveryParams()) is None


@pytest.mark.parametrize("event", ["loaded", "stop", "cancel"])
def test_a_press_that_is_no_longer_due_does_nothing(mission: DeliveryRound, event: str) -> None:
    timer = ButtonTimer()
    press = timer.update(mission, PARAMS)
    assert press is not None
    if event == "stop":
        mission.stop(True)
    else:
        getattr(mission, event)()
    before = mission.status
    assert timer.update(mission, PARAMS) is None
    assert not timer.elapse(press, mission) and mission.status is before


@pytest.mark.parametrize(
    ("pressed", "meanwhile"), [(False, False), (True, False), (False, True), (True, True)]
)
def test_a_restored_round_is_held_if_there_was_a_stop(pressed: bool, meanwhile: bool) -> None:
    mission = DeliveryRound("kitchen", "home", lambda names: names, lambda _: None)
    mission.order(Order(("table_1",), "a"))
    mission.resume(mission.status)
    mission.resume_after_stop(pressed=pressed, pressed_meanwhile=meanwhile)
    reason = "stop" if pressed else "choice" if meanwhile else ""
    assert mission.status.hold_reason == reason and (mission.leg is not None) == (not reason)
