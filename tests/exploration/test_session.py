"""The course of an exploration: when it ends, how it turns, and what its status reports."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.exploration.explorer import ExplorationDecision, ExplorationGoal, SkippedFrontier
from chefbot.exploration.session import (
    EMPTY_MAPS_TO_FINISH,
    ENCLOSED_MAPS_TO_FINISH,
    ExplorationSession,
    exploration_status,
    field_of_view,
)
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot

GOAL = ExplorationGoal(SE2(1.0, 0.0, 0.0), 2.0, 0.0, False, 1.0, 1.0)


@given(st.lists(st.booleans(), max_size=20))
def test_it_is_complete_after_enough_maps_without_a_goal(found: list[bool]) -> None:
    session, empty = ExplorationSession(), 0
    for has_goal in found:
        decision = ExplorationDecision(GOAL if has_goal else None, ())
        assert session.process(decision) is decision.goal and session.decision is decision
        empty = 0 if has_goal else empty + 1
        assert session.is_complete == (empty >= EMPTY_MAPS_TO_FINISH)


def test_a_robot_that_is_enclosed_waits_before_it_gives_up() -> None:
    session = ExplorationSession()
    for count in range(ENCLOSED_MAPS_TO_FINISH):
        assert not session.is_complete, count
        session.process(ExplorationDecision(None, (), enclosed=True))
    assert session.is_complete and session.result == "Not everything is seen: obstacles enclose the robot."
    assert session.progress == "Exploration waits: obstacles enclose the robot."
    session.process(ExplorationDecision(GOAL, ()))
    assert not session.is_complete and session.progress == "Exploring."


def test_it_turns_left_and_right_in_turn() -> None:
    session = ExplorationSession()
    turns = [float(session.next_turn().target_yaw) for _ in range(4)]
    assert turns == pytest.approx([2.0 * math.pi, -2.0 * math.pi] * 2)


def test_the_status_names_every_skipped_frontier() -> None:
    skipped = (SkippedFrontier(1.0, 2.0, 0.5, "too small"), SkippedFrontier(3.0, 4.0, 1.5, "unreachable"))
    status = exploration_status(7, done=True, decision=ExplorationDecision(None, skipped), sentence="Done.")
    assert status.done and status.header.stamp.ns == 7
    assert any("(1.0, 2.0) 0.5 m: too small" in str(value) for value in vars_of(status))
    assert any(value == 2 for value in vars_of(status))


def test_the_result_names_the_places_where_attempts_failed() -> None:
    session = ExplorationSession()
    small, hidden = SkippedFrontier(1.0, 2.0, 0.5, "too small"), SkippedFrontier(3.0, 4.0, 1.5, "unreachable")
    session.process(ExplorationDecision(None, (small, hidden)))
    assert session.result == "Everything within reach is seen."
    door = SkippedFrontier(-2.0, 1.25, 0.6, "failed 3 times", failed=True)
    other_piece, window = door._replace(x=-2.5, length=0.4), door._replace(y=9.0, length=0.9)
    session.process(ExplorationDecision(None, (small, other_piece, door, hidden, window)))
    assert session.result == "Not everything is seen: all attempts failed near (-2.0, 9.0), (-2.0, 1.2)."


def vars_of(status: object) -> list[object]:
    return [getattr(status, name) for name in type(status).__struct_fields__]  # type: ignore[attr-defined]


@pytest.mark.parametrize(("robot", "full"), [("chefbot_lidar", True), ("chefbot", False)])
def test_a_lidar_sees_all_around(robot: str, full: bool) -> None:
    assert (field_of_view(load_robot(robot)) == 2.0 * math.pi) == full
