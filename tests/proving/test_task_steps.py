"""The steps of the tasks, with a robot that does what a test requests: what is sent, recorded and judged."""

from __future__ import annotations

import math
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.proving.fake_run import DRIVE, ROBOT, FakeRun

from chefbot.demo.score import ARRIVAL_TOLERANCE
from chefbot.errors import UserError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Order
from chefbot.msgs.geometry_msgs import PoseStamped, PoseWithCovarianceStamped, Twist
from chefbot.proving.scenario_tasks import DeliverTask, DriveRandomlyTask, ExploreTask, GoTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.deliver import deliver
from chefbot.proving.tasks.drive import COMMAND_PERIOD, RELEASE_TIME, SEGMENT, TURN, drive_randomly
from chefbot.proving.tasks.explore import explore, map_figures
from chefbot.proving.tasks.go import drive_to, go
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

PLACES = {"a": SE2(3.0, 0.0, 0.0), "b": SE2(0.0, 3.0, 1.0), "c": SE2(-3.0, 0.0, 2.0), "home": IDENTITY}
KITCHEN = {
    "kitchen": SE2(1.0, 0.0, 0.0),
    **{f"table_{k}": SE2(3.0 * k, 2.0, 0.0) for k in range(1, 5)},
    "home": IDENTITY,
}


# go


@given(st.integers(1, 8), st.integers(0, 1000))
@settings(max_examples=12)
def test_all_places_but_the_start_are_driven_to_in_turn(goals: int, seed: int) -> None:
    run = FakeRun(GoTask(goals=goals), PLACES, seed=seed)
    go(run)
    driven = [goal.place for goal in run.goals]
    assert len(driven) == goals and "home" not in driven
    counts = Counter(driven)
    assert max(counts.values()) - min(counts[name] for name in "abc") <= 1
    assert all(goal.reached and goal.distance == 0.0 and goal.reason == "" for goal in run.goals)
    assert run.launched == ["waiter"] and run.scorer.phase == "delivering"


def test_a_goal_is_sent_in_the_map_and_timed() -> None:
    run = FakeRun(GoTask(), PLACES)
    run.run_for(5.0)
    assert drive_to(run, "b")
    (sent,) = [one.message for one in run.sent if isinstance(one.message, PoseStamped)]
    assert sent.header.frame_id == "map" and sent.pose.se2 == pytest.approx(PLACES["b"])
    (goal,) = run.goals
    assert (goal.began, goal.ended - goal.began) == (5.0, pytest.approx(DRIVE, abs=0.2))


def test_a_goal_that_was_missed_is_named_with_its_reason() -> None:
    run = FakeRun(GoTask(goals=3), PLACES, missed={"b": "no path leads there"})
    with pytest.raises(TaskFailedError, match=r"^not reached: b$"):
        go(run)
    by_place = {goal.place: goal for goal in run.goals}
    assert len(by_place) == 3, "the others are driven to nevertheless"
    assert not by_place["b"].reached and by_place["b"].reason == "no path leads there"
    assert by_place["b"].distance > ARRIVAL_TOLERANCE


def test_a_navigator_that_does_nothing_is_a_missed_goal() -> None:
    run = FakeRun(GoTask(), PLACES, missed={"a": None})
    assert not drive_to(run, "a")
    assert run.goals[0].reason == "the navigator did not start after 10 s"
    assert run.goals[0].ended == pytest.approx(10.0)


def test_a_robot_that_stands_at_the_goal_has_reached_it() -> None:
    run = FakeRun(GoTask(), PLACES, missed={"a": "refused"})
    run.scorer.last_ground_truth = SE2(3.0 + 0.9 * ARRIVAL_TOLERANCE, 0.0, 0.0)
    assert drive_to(run, "a") and run.goals[0].reason == ""
    run.scorer.last_ground_truth = SE2(3.0 + 1.1 * ARRIVAL_TOLERANCE, 0.0, 0.0)
    assert not drive_to(run, "a")


def test_a_world_without_places_is_refused() -> None:
    with pytest.raises(UserError, match="no place to drive to besides the start"):
        go(FakeRun(GoTask(), {"home": IDENTITY, "near": SE2(1.9 * ARRIVAL_TOLERANCE, 0.0, 0.0)}))


# deliver


def test_the_drawn_tables_are_ordered_and_served() -> None:
    run = FakeRun(DeliverTask(tables=3), KITCHEN)
    deliver(run)
    (order,) = [one.message for one in run.sent if isinstance(one.message, Order)]
    served = [goal.place for goal in run.goals]
    assert served == list(order.places) and len(set(served)) == 3
    assert all(name.startswith("table_") for name in served)
    assert all(goal.reached for goal in run.goals)
    assert all(a.ended <= b.began for a, b in zip(run.goals, run.goals[1:], strict=False))


def first_topics(run: FakeRun) -> list[str]:
    """Return the topics of what a person sends before the first button is pressed."""
    return [one.topic for one in run.sent[:2]]


def test_deliveries_on_the_true_map_begin_with_a_click() -> None:
    run = FakeRun(DeliverTask(tables=1), KITCHEN)
    deliver(run)
    assert (run.launched, run.maps) == (["waiter"], ["true_map.yaml"])
    assert first_topics(run) == ["initialpose", "order"]


@pytest.mark.parametrize(
    ("robot", "begin"), [("chefbot_lidar", "reinitialize_global_localization"), ("chefbot", "initialpose")]
)
def test_deliveries_on_its_own_map_begin_with_exploring(robot: str, begin: str) -> None:
    run = FakeRun(DeliverTask(tables=2, map="explored"), KITCHEN)
    run.system.robot = load_robot(robot)
    deliver(run)
    assert (run.launched, run.maps) == (["explore", "waiter"], ["explored_map.yaml"])
    assert first_topics(run) == [begin, "order"] and all(goal.reached for goal in run.goals)


def test_a_click_is_placed_where_the_exploration_has_ended() -> None:
    run = FakeRun(DeliverTask(tables=1, map="explored"), KITCHEN)
    run.system.robot = load_robot("chefbot")
    run.scorer.last_ground_truth = SE2(4.0, -2.0, 0.5)
    deliver(run)
    (click,) = [
        one.message.pose.pose.se2 for one in run.sent if isinstance(one.message, PoseWithCovarianceStamped)
    ]
    assert click.distance(SE2(4.0, -2.0, 0.5)) == pytest.approx(0.5)


def test_an_exploration_without_a_map_has_failed() -> None:
    run = FakeRun(DeliverTask(tables=1, map="explored"), KITCHEN)
    with pytest.raises(TaskFailedError, match="exploration made no map"):
        SimulatedRun.saved_map(run)


def test_a_table_where_the_robot_truly_was_not_is_missed() -> None:
    run = FakeRun(DeliverTask(tables=4), KITCHEN, missed={"table_2": "elsewhere"})
    with pytest.raises(TaskFailedError, match="not served: table_2;"):
        deliver(run)
    missed = next(goal for goal in run.goals if goal.place == "table_2")
    assert not missed.reached and missed.distance > ARRIVAL_TOLERANCE


def test_a_table_that_is_never_reported_is_recorded() -> None:
    run = FakeRun(DeliverTask(tables=4), KITCHEN, missed={"table_1": None})
    with pytest.raises(TaskFailedError, match="not served: table_1"):
        deliver(run)
    assert len(run.goals) == 4 and run.goals[-1].reason == "never served"


def test_deliveries_that_fail_end_at_once() -> None:
    run = FakeRun(DeliverTask(tables=4), KITCHEN)
    run.later(
        15.0,
        lambda: run.publish_as_robot(
            "delivery_status", DeliveryStatus(state="failed", description="tray lost")
        ),
    )
    with pytest.raises(TaskFailedError, match=r"not served: .*; tray lost"):
        deliver(run)
    assert run.time < 2.0 * DRIVE
    assert {goal.reason for goal in run.goals} == {"tray lost"}


def test_deliveries_that_never_end_are_recorded_as_missed() -> None:
    run = FakeRun(DeliverTask(tables=2), KITCHEN, limit=12.0)
    with pytest.raises(TaskFailedError, match="the deliveries were not done after 12 s"):
        deliver(run)
    assert len(run.goals) == 2 and not any(goal.reached for goal in run.goals)


def test_a_robot_that_does_not_come_home_has_failed() -> None:
    run = FakeRun(DeliverTask(tables=1), KITCHEN)
    run.scorer.at_home = lambda: False
    with pytest.raises(TaskFailedError, match="did not return home"):
        deliver(run)
    assert run.goals[0].reached


@pytest.mark.parametrize("missing", [{"kitchen"}, {"table_1", "table_2", "table_3", "table_4"}])
def test_a_world_without_kitchen_or_table_is_refused(missing: set[str]) -> None:
    places = {name: pose for name, pose in KITCHEN.items() if name not in missing}
    with pytest.raises(UserError, match="no kitchen or no table"):
        deliver(FakeRun(DeliverTask(), places))


# drive_randomly


def commands(run: FakeRun) -> list[tuple[float, float]]:
    sent = [one.message for one in run.sent if isinstance(one.message, Twist)]
    return [(twist.linear.x, twist.angular.z) for twist in sent]


@given(st.integers(0, 1000))
@settings(max_examples=8)
def test_random_commands_stay_within_the_limits(seed: int) -> None:
    run, limits = FakeRun(DriveRandomlyTask(duration=20.0), seed=seed), Limits.of(ROBOT)
    drive_randomly(run)
    sent = commands(run)
    assert run.time == pytest.approx(20.0, abs=COMMAND_PERIOD)
    assert len(sent) == pytest.approx(20.0 / COMMAND_PERIOD, abs=2)
    assert all(0.0 <= v <= limits.speed and abs(w) <= limits.angular_speed for v, w in sent)
    groups = _runs(sent)
    lengths = [len(group) * COMMAND_PERIOD for group in groups if any(group[0])]
    assert all(length <= SEGMENT[1] + 2 * COMMAND_PERIOD for length in lengths)
    assert all(length >= SEGMENT[0] - COMMAND_PERIOD for length in lengths[:-1])
    # the driver lets go of the controls before each speed
    assert not any(any(group[0]) for group in groups[::2])
    releases = [len(group) * COMMAND_PERIOD for group in groups[:-1:2]]
    assert all(length == pytest.approx(RELEASE_TIME, abs=1.01 * COMMAND_PERIOD) for length in releases)


def _runs(sent: list[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    found: list[list[tuple[float, float]]] = []
    for one in sent:
        if found and found[-1][-1] == one:
            found[-1].append(one)
        else:
            found.append([one])
    return found


@pytest.mark.parametrize("careful", [True, False])
def test_a_careful_driver_turns_away_from_what_is_ahead(careful: bool) -> None:
    run = FakeRun(DriveRandomlyTask(duration=10.0, careful=careful))
    run.scorer.last_ground_truth = SE2(1.0, 0.0, math.pi / 2)
    run.safety.clearance = lambda pose: 0.1 if pose.y > 0.5 else 9.0
    drive_randomly(run)
    turns = {(v, abs(w)) for v, w in commands(run) if v or w}
    assert (turns == {(0.0, TURN)}) == careful


def test_a_drive_that_reaches_the_time_limit_has_failed() -> None:
    run = FakeRun(DriveRandomlyTask(duration=60.0), limit=7.0)
    with pytest.raises(TaskFailedError, match="the drive was not over after 7 s"):
        drive_randomly(run)
    assert run.time == pytest.approx(7.0, abs=COMMAND_PERIOD)
    assert run.launched == ["gmapping_demo"]


# explore


def test_exploration_ends_when_the_explorer_is_done() -> None:
    run = FakeRun(ExploreTask())
    explore(run)
    assert run.launched == ["explore"] and run.time == pytest.approx(DRIVE, abs=0.2)
    assert map_figures(run) == {}, "without a map there is nothing to compare"


def test_an_explorer_that_is_not_done_has_failed() -> None:
    with pytest.raises(TaskFailedError, match="exploration was not done after 5 s"):
        explore(FakeRun(ExploreTask(), limit=5.0))


def test_an_explorer_that_does_not_return_has_failed() -> None:
    run = FakeRun(ExploreTask())
    run.scorer.at_home = lambda: False
    with pytest.raises(TaskFailedError, match="did not return to its start"):
        explore(run)
