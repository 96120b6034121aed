"""Waypoints: their order over all rounds, those missed, and poses that are driven through."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.behavior.waypoints import (
    ENDLESS_LOOPS,
    STOP_ON_MISSED_WAYPOINT,
    UNKNOWN,
    PosesToPass,
    WaypointRun,
)
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import COMPLETED, FAILED, PENDING, SKIPPED
from chefbot.msgs.std_msgs import Header


def poses(count: int) -> tuple[PoseStamped, ...]:
    return tuple(PoseStamped(Header.of(0, "map"), Pose.of(SE2(float(x), 0.0, 0.0))) for x in range(count))


@given(st.integers(1, 6), st.integers(0, 5), st.integers(0, 3))
def test_each_round_has_all_waypoints_in_order(count: int, first: int, loops: int) -> None:
    run = WaypointRun(poses(count), first % count, loops)
    visited, going_on = [], True
    while going_on:
        visited.append(run.index)
        going_on = run.reached()
    assert visited == [*range(first % count, count), *(list(range(count)) * loops)]
    assert run.result(stopped=False).error_code == 0


@given(st.lists(st.booleans(), min_size=1, max_size=12), st.integers(1, 4))
def test_missed_waypoints_are_reported_once(outcomes: list[bool], count: int) -> None:
    run = WaypointRun(poses(count), 0, ENDLESS_LOOPS)
    missed: set[int] = set()
    for reached in outcomes:
        if not reached:
            missed.add(run.index)
        if not (run.reached() if reached else run.missed(208, "no path")):
            break
    result = run.result(stopped=False)
    assert {one.waypoint_index for one in result.missed_waypoints} == missed
    assert all(one.waypoint_status == FAILED and one.error_code == 208 for one in result.missed_waypoints)


def test_a_round_without_any_waypoint_is_the_last() -> None:
    run = WaypointRun(poses(2), 0, ENDLESS_LOOPS)
    assert run.reached() and run.missed(208, "no path") and run.loop == 1
    assert run.missed(208, "no path") and not run.missed(208, "the door is closed")
    result = run.result(stopped=False)
    assert result.error_code == UNKNOWN and "the door is closed" in result.error_msg


def test_a_missed_waypoint_may_end_the_run() -> None:
    run = WaypointRun(poses(3), 1, 0)
    run.missed(204, "it lies outside the map")
    result = run.result(stopped=True)
    assert result.error_code == STOP_ON_MISSED_WAYPOINT
    assert result.error_msg == "Waypoint 1 was missed: it lies outside the map"


@pytest.mark.parametrize(("count", "first"), [(0, 0), (2, 2), (2, 4_000_000_000)])
def test_a_goal_without_a_first_waypoint_is_at_fault(count: int, first: int) -> None:
    assert WaypointRun(poses(count), first, 0).failure_reason
    assert not WaypointRun(poses(2), 1, 0).failure_reason


@given(st.integers(2, 6), st.floats(0.1, 0.45))
def test_poses_are_passed_in_order_and_the_last_is_not(count: int, radius: float) -> None:
    run = PosesToPass(poses(count), radius)
    for i in range(100 * count):
        x = i / 100.0
        before = run.index
        if run.passes(SE2(x, 0.0, 0.0), max(before - x, 0.0)):
            assert abs(before - x) <= radius and run.index == before + 1
    assert run.remaining == 1
    assert [one.waypoint_status for one in run.statuses(ended=True)] == [COMPLETED] * count


def test_a_pose_beyond_a_wall_is_not_passed() -> None:
    run = PosesToPass(poses(2), 0.5)
    assert not run.passes(SE2(-0.3, 0.0, 0.0), path_length=4.0)
    assert run.passes(SE2(-0.3, 0.0, 0.0), path_length=0.3)


def test_statuses_of_a_pose_without_a_path() -> None:
    run = PosesToPass(poses(4), 0.5)
    assert run.passes(SE2(0.0, 0.0, 0.0), 0.0) and run.distance_after() == 2.0
    ended = [one.waypoint_status for one in run.statuses(208, "no path", ended=True)]
    assert ended == [COMPLETED, FAILED, SKIPPED, SKIPPED]
    driving = [one.waypoint_status for one in run.statuses(ended=False)]
    assert driving == [COMPLETED, PENDING, PENDING, PENDING]
