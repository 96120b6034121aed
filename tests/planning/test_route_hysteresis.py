"""The route to a goal while the marks at a narrow passage come and go with each scan."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.planning.planner import PlanningError, PlanningFailure
from chefbot.planning.route_hysteresis import CLOSED_MEMORY, SAME_ROUTE, SWITCH_DELAY, RouteHysteresis

ROBOT, GOAL = SE2(0.0, 0.0, 0.0), SE2(4.0, 0.0, 0.0)
NEAR, FAR = (np.array([[x, y, 0.0] for x in (0.0, 2.0, 4.0)]) for y in (0.0, 3.0))
"""Paths through the passage that the robot sees, and through another one whose marks may have left."""


class Passages:
    """Plans of a robot between two passages."""

    def __init__(self) -> None:
        self.routes = RouteHysteresis()

    def plan(
        self, now: float, *, is_open: bool, far_is_open: bool = True, pose: SE2 = ROBOT, goal: SE2 = GOAL
    ) -> NDArray[np.float64]:
        return self.routes.plan(
            now,
            pose,
            goal,
            around_all=lambda: plan(NEAR, goal, is_open=is_open),
            without_far=lambda: plan(FAR, goal, is_open=far_is_open),
        )


def plan(path: NDArray[np.float64], goal: SE2, *, is_open: bool) -> NDArray[np.float64]:
    if not is_open:
        raise PlanningError(PlanningFailure.NO_VALID_PATH, goal)
    return path


def test_a_mark_of_one_scan_does_not_turn_the_robot_round() -> None:
    passages = Passages()
    assert passages.plan(0.0, is_open=True) is NEAR
    assert np.array_equal(passages.plan(1.0, is_open=False), NEAR)
    assert passages.plan(2.0, is_open=True) is NEAR
    assert np.array_equal(passages.plan(1.0 + SWITCH_DELAY, is_open=False), NEAR), "it was open in between"


def test_the_kept_path_begins_where_the_robot_is() -> None:
    passages = Passages()
    passages.plan(0.0, is_open=True)
    assert np.array_equal(passages.plan(1.0, is_open=False, pose=SE2(1.9, 0.1, 0.0)), NEAR[1:])


def test_a_passage_that_stays_closed_is_given_up() -> None:
    passages = Passages()
    passages.plan(0.0, is_open=True)
    passages.plan(1.0, is_open=False)
    assert passages.plan(1.0 + SWITCH_DELAY, is_open=False) is FAR


def test_another_route_is_kept_until_the_first_stays_open() -> None:
    passages = Passages()
    assert passages.plan(0.0, is_open=False) is FAR, "without a path so far there is nothing to keep"
    assert np.array_equal(passages.plan(1.0, is_open=True), FAR)
    assert passages.plan(2.0, is_open=False) is FAR
    assert np.array_equal(passages.plan(3.0, is_open=True), FAR)
    assert passages.plan(3.0 + SWITCH_DELAY, is_open=True) is NEAR


def test_a_way_round_an_obstacle_is_taken_at_once() -> None:
    passages, detour = Passages(), NEAR + np.array([0.0, 0.9 * SAME_ROUTE, 0.0])
    passages.plan(0.0, is_open=False, far_is_open=True)
    passages.plan(SWITCH_DELAY, is_open=True)
    assert passages.plan(2.0 * SWITCH_DELAY, is_open=True) is NEAR
    assert (
        passages.routes.plan(7.0, ROBOT, GOAL, around_all=lambda: detour, without_far=lambda: FAR) is detour
    )


def test_where_a_path_was_never_closed_routes_change_at_once() -> None:
    routes = RouteHysteresis()
    for t, path in enumerate((NEAR, FAR, NEAR)):
        chosen = routes.plan(float(t), ROBOT, GOAL, around_all=lambda path=path: path, without_far=list)  # type: ignore[misc]
        assert chosen is path


def test_after_a_while_routes_change_at_once_again() -> None:
    passages = Passages()
    passages.plan(0.0, is_open=False)
    routes = [passages.plan(float(t), is_open=True) for t in range(1, 2 + int(CLOSED_MEMORY))]
    assert routes[0] is not NEAR and routes[-1] is NEAR
    last = 2.0 + CLOSED_MEMORY
    assert passages.routes.plan(last, ROBOT, GOAL, around_all=lambda: FAR, without_far=lambda: NEAR) is FAR


def test_a_path_of_some_time_ago_is_not_kept() -> None:
    passages = Passages()
    passages.plan(0.0, is_open=False)
    assert passages.plan(SWITCH_DELAY + 1.0, is_open=True) is NEAR


@pytest.mark.parametrize("begun", [True, False])
def test_no_path_is_kept_where_every_route_is_closed(begun: bool) -> None:
    passages = Passages()
    passages.plan(0.0, is_open=begun)
    with pytest.raises(PlanningError):
        passages.plan(1.0, is_open=False, far_is_open=False)


def test_a_path_to_another_goal_is_not_kept() -> None:
    passages = Passages()
    passages.plan(0.0, is_open=True)
    assert passages.plan(1.0, is_open=False, goal=SE2(4.0, 1.0, 0.0)) is FAR


def test_a_clock_that_jumps_back_keeps_no_path_for_longer() -> None:
    passages = Passages()
    passages.plan(100.0, is_open=True)
    passages.plan(101.0, is_open=False)
    assert passages.plan(50.0, is_open=True) is NEAR
    passages.plan(51.0, is_open=False)
    assert passages.plan(51.0 + SWITCH_DELAY, is_open=False) is FAR


def test_other_failures_are_raised() -> None:
    def outside() -> NDArray[np.float64]:
        raise PlanningError(PlanningFailure.GOAL_OUTSIDE_MAP, GOAL)

    with pytest.raises(PlanningError, match="outside"):
        RouteHysteresis().plan(0.0, ROBOT, GOAL, around_all=outside, without_far=lambda: FAR)


@given(st.lists(st.booleans(), min_size=2, max_size=60), st.booleans())
def test_the_route_changes_at_most_once_in_the_delay(opened: list[bool], prefers_near: bool) -> None:
    """Also if the plan without far marks leads through the passage whose edge is marked now and then."""
    passages, routes = RouteHysteresis(), []
    for t, is_open in enumerate(opened):
        fallback = NEAR if prefers_near and is_open else FAR
        path = passages.plan(
            float(t),
            ROBOT,
            GOAL,
            around_all=lambda is_open=is_open: plan(NEAR, GOAL, is_open=is_open and not prefers_near),  # type: ignore[misc]
            without_far=lambda fallback=fallback: fallback,  # type: ignore[misc]
        )
        routes.append(float(path[-1, 1]))
    changes = [t for t in range(1, len(routes)) if routes[t] != routes[t - 1]]
    assert all(later - earlier >= SWITCH_DELAY for earlier, later in pairwise(changes))
