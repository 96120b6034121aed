"""For how long plans to a goal have failed."""

from __future__ import annotations

from chefbot.maths.se2 import SE2
from chefbot.planning.closed_routes import MAX_GAP, STANDING_TIME, ClosedRoutes

GOAL, OTHER = SE2(1.0, 2.0, 0.0), SE2(2.0, 2.0, 0.0)


def closed_for(routes: ClosedRoutes, begun: float, seconds: float) -> bool:
    """Fail once a second; return whether the last failure shows something that stands there."""
    return [routes.is_standing(begun + t, GOAL) for t in range(int(seconds) + 1)][-1]


def test_what_has_closed_a_path_for_long_stands_there() -> None:
    assert not closed_for(ClosedRoutes(), 100.0, STANDING_TIME - 1.0)
    assert closed_for(ClosedRoutes(), 100.0, STANDING_TIME)


def test_a_moment_without_failure_changes_nothing() -> None:
    routes = ClosedRoutes()
    closed_for(routes, 0.0, STANDING_TIME - 5.0)
    assert routes.is_standing(STANDING_TIME + MAX_GAP - 6.0, GOAL)


def test_a_long_time_without_failure_begins_again() -> None:
    routes = ClosedRoutes()
    closed_for(routes, 0.0, STANDING_TIME)
    assert not routes.is_standing(STANDING_TIME + MAX_GAP + 1.0, GOAL)


def test_each_goal_has_its_own_time() -> None:
    routes = ClosedRoutes()
    closed_for(routes, 0.0, STANDING_TIME)
    assert not routes.is_standing(STANDING_TIME + 1.0, OTHER)


def test_a_clock_that_jumps_back_begins_again() -> None:
    routes = ClosedRoutes()
    closed_for(routes, 100.0, STANDING_TIME)
    assert not routes.is_standing(50.0, GOAL)
