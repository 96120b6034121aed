"""The people of a simulated delivery press the button that the robot waits for, and no other."""

from __future__ import annotations

import pytest

from chefbot.demo.button_presser import PRESSES, ButtonPresser
from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.runtime.clock import StepClock
from chefbot.runtime.loop import TIMER, Loop, Publication

SECOND = 1_000_000_000


def presses(*states: tuple[float, str, str]) -> list[tuple[str, float]]:
    """Return the buttons pressed, with their times (s), for states (time s, state, place) of the robot."""
    loop, pressed = Loop(StepClock(), 0), list[tuple[str, float]]()

    def note(publication: Publication) -> None:
        if publication.publisher == "person":
            assert publication.from_device, "a replay finds it in the log"
            pressed.append((publication.topic, publication.time_ns / SECOND))

    for observer in (ButtonPresser(loop), note):
        loop.add_observer(observer)
    for time, state, place in states:
        status = DeliveryStatus(state=state, place=place)
        loop.schedule(
            round(time * SECOND),
            TIMER,
            lambda status=status: loop.publish("delivery_status", status, "robot"),
        )
    loop.run()
    return pressed


def test_the_food_is_loaded_and_taken_after_a_while() -> None:
    assert presses((1.0, "loading", "kitchen"), (20.0, "waiting", "table_1")) == [
        ("loaded", 4.0),
        ("taken", 25.0),
    ]


@pytest.mark.parametrize("state", ["", "idle", "driving", "returning", "errand", "failed"])
def test_nobody_presses_for_a_robot_that_does_not_wait(state: str) -> None:
    assert state not in PRESSES
    assert presses((1.0, state, "table_1")) == []


@pytest.mark.parametrize("left", [("driving", "table_2"), ("waiting", "table_2"), ("idle", "")])
def test_nobody_presses_after_the_robot_has_left(left: tuple[str, str]) -> None:
    pressed = presses((1.0, "waiting", "table_1"), (3.0, *left))
    assert pressed == ([("taken", 8.0)] if left[0] == "waiting" else [])


def test_a_robot_that_comes_back_is_served() -> None:
    states = [(1.0, "waiting", "table_1"), (2.0, "driving", "table_2"), (30.0, "waiting", "table_1")]
    assert presses(*states) == [("taken", 35.0)]
