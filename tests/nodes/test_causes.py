"""Causes of the nodes of a robot that stands before an obstacle: reported, joined to chains, and ended."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from tests.support.nodes import NodeRunner, StationaryRobot

from chefbot.causes.reports import END, STOP, make_report, stamped
from chefbot.causes.statuses import CANCELLED
from chefbot.delivery.status_messages import left_out, not_reached, not_taken
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import (
    Cause,
    DeliveryStatus,
    EmergencyStopStatus,
    ExplorationStatus,
    NavigationStatus,
    PresentCauses,
)
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose, ComputePathToPose_Goal
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID

SECOND = 1_000_000_000
BEAMS = 360


def kinds(causes: list[Cause]) -> list[tuple[str, str, str]]:
    return [(cause.kind, cause.node, cause.check) for cause in causes]


def test_statuses_become_causes_with_one_number_each() -> None:
    runner = NodeRunner({"causes": "chefbot.nodes.causes.chains:CausesNode"}, {})
    runner.loop.publish("stop_status", EmergencyStopStatus(active=True, description="Pressed."), "base")
    runner.run(2.0)
    runner.loop.publish("stop_status", EmergencyStopStatus(), "base")
    for state, reason in (("driving", ""), ("idle", "No path.")):
        runner.loop.publish("navigation_status", NavigationStatus(state=state, reason=reason), "navigator")
    runner.run(0.1)
    causes = runner.messages("causes")
    assert kinds(causes) == [
        ("stop", "base", "emergency stop"),
        ("end", "base", "emergency stop"),
        ("failure", "navigator", "goal aborted"),
    ]
    assert [cause.id for cause in causes] == [1, 1, 2]
    assert causes[1].numbers[0].name == "duration"
    assert causes[2].sentence.startswith("The goal was aborted: no path.")


def test_the_explorer_may_cancel_its_goals() -> None:
    runner = NodeRunner({"causes": "chefbot.nodes.causes.chains:CausesNode"}, {})
    for exploration_is_done, count in ((False, 0), (True, 2)):
        status = ExplorationStatus(done=exploration_is_done)
        runner.loop.publish("exploration_status", status, "explorer")
        for state, reason in (("driving", ""), ("idle", CANCELLED)):
            status = NavigationStatus(state=state, reason=reason)
            runner.loop.publish("navigation_status", status, "navigator")
        runner.run(0.1)
        assert len(runner.messages("causes")) == count


def ring(runner: NodeRunner, distance: float, seconds: float) -> None:
    """Publish the scans of a robot in the middle of a round room, m, for some seconds."""
    for _ in range(round(seconds * 10)):
        ranges = np.full(BEAMS, distance, np.float32)
        header = Header.of(runner.loop.now_ns, "base_link")
        step = 2 * np.pi / BEAMS
        scan = LaserScan(header, -np.pi, np.pi - step, step, 0.0, 0.1, 0.1, 8.0, ranges)
        runner.loop.publish("scan", scan, "lidar", from_device=True)
        runner.run(0.1)


def fixed_frames(runner: NodeRunner) -> None:
    for parent, child in (("map", "odom"), ("odom", "base_link")):
        transform = TransformStamped.of(
            0, parent, child, SE2(5.0, 5.0, 0.0) if parent == "map" else SE2(0, 0, 0)
        )
        runner.loop.publish("tf_static", TFMessage((transform,)), "test")


@pytest.mark.parametrize(("age_s", "obstacle"), [(0.5, "person"), (1.5, "not on the map")])
def test_an_obstacle_where_a_person_is_tracked_is_that_person(age_s: float, obstacle: str) -> None:
    runner = NodeRunner({"causes": "chefbot.nodes.causes.chains:CausesNode"}, {})
    fixed_frames(runner)
    empty = Grid(np.zeros((200, 200), np.int8), 0.05, 0.0, 0.0)
    runner.loop.publish("map", OccupancyGrid.of(Header.of(0, "map"), empty), "mapper")
    person = TrackedPerson(7, Point(1.0, 0.2))
    runner.loop.publish("tracked_people", TrackedPeople(Header.of(0, "odom"), (person,)), "people_tracker")
    runner.run(0.1)
    report = Cause(
        Header.of(round(age_s * 1e9), "odom"), kind="stop", node="base", check="collision", located=True
    )
    runner.loop.publish("cause_reports", msgspec.structs.replace(report, point=Point(1.1, 0.1)), "base")
    runner.run(0.1)
    (cause,) = runner.messages("causes")
    assert (cause.obstacle, cause.person) == (obstacle, 7 if obstacle == "person" else -1)
    assert (cause.point.x, cause.point.y) == pytest.approx((6.1, 5.1))


def plan_to(runner: NodeRunner, x: float, y: float) -> None:
    goal = ComputePathToPose_Goal(PoseStamped(Header.of(0, "map"), Pose.of(SE2(x, y, 0.0))))
    goal_id = UUID(np.arange(16, dtype=np.uint8))
    runner.loop.publish(
        "compute_path_to_pose/_action/send_goal", ComputePathToPose.send_goal(goal_id, goal), "client"
    )
    runner.run(0.2)


def test_a_planner_without_a_path_names_what_closes_it() -> None:
    kinds_of_nodes = {
        "planner": "chefbot.nodes.planner:PlannerNode",
        "causes": "chefbot.nodes.causes.chains:CausesNode",
    }
    runner = NodeRunner(kinds_of_nodes, {})
    fixed_frames(runner)
    empty = Grid(np.zeros((200, 200), np.int8), 0.05, 0.0, 0.0)
    runner.loop.publish("map", OccupancyGrid.of(Header.of(0, "map"), empty), "test")
    ring(runner, 1.0, 1.0)
    plan_to(runner, 8.0, 5.0)
    (cause, end) = runner.messages("causes")
    assert (cause.kind, cause.node, cause.check) == ("failure", "planner", "global plan")
    assert (cause.sensor, cause.obstacle, cause.header.frame_id) == ("lidar", "not on the map", "map")
    assert (cause.point.x, cause.point.y) == pytest.approx((6.0, 5.0), abs=0.1)
    assert 0 < cause.marked_at.ns <= cause.header.stamp.ns
    assert cause.robot.se2 == SE2(5.0, 5.0, 0.0) and end.kind == "end"


def test_a_wall_of_the_map_is_named_as_such() -> None:
    runner = NodeRunner(
        {"planner": "chefbot.nodes.planner:PlannerNode", "causes": "chefbot.nodes.causes.chains:CausesNode"},
        {},
    )
    fixed_frames(runner)
    cells = np.zeros((200, 200), np.int8)
    cells[150:170, 150:170] = 100
    runner.loop.publish("map", OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, 0.0, 0.0)), "test")
    runner.run(0.1)
    plan_to(runner, 8.0, 8.0)
    (cause, _) = runner.messages("causes")
    assert (cause.sensor, cause.obstacle) == ("map", "on the map")
    assert "The map has an obstacle" in cause.sentence


@pytest.mark.slow
def test_a_goal_that_ends_ends_what_the_controller_reported() -> None:
    robot = StationaryRobot()
    robot.send_goal("follow_path")
    robot.run(80.0)
    reports = robot.messages("cause_reports")
    open_now: set[tuple[str, str]] = set()
    for report in reports:
        key = report.node, report.check
        assert (report.kind == "end") == (key in open_now), "begun and ended in turn"
        open_now ^= {key}
    assert reports and not {key for key in open_now if key[0] == "controller"}
    assert ("stop", "controller", "progress") in kinds(reports)


def test_an_end_that_was_lost_is_published_later() -> None:
    """Also where a status opened a cause of the same node, which that node's own list does not name."""
    runner = NodeRunner({"causes": "chefbot.nodes.causes.chains:CausesNode"}, {})
    report = make_report(STOP, "sensor data", "The lidar is silent.")
    runner.loop.publish("cause_reports", stamped(report, "base", 0), "base")
    runner.loop.publish("stop_status", EmergencyStopStatus(active=True), "base")
    for second, checks in ((1, ("sensor data",)), (4, ())):
        runner.run(second - runner.loop.now_ns / 1e9)
        present = PresentCauses(Header.of(runner.loop.now_ns, ""), "base", checks)
        runner.loop.publish("present_reports", present, "base")
        runner.run(0.1)
    assert kinds(runner.messages("causes")) == [
        (STOP, "base", "sensor data"),
        (STOP, "base", "emergency stop"),
        (END, "base", "sensor data"),
    ]
    runner.run(1.5)
    assert runner.messages("present_causes")[-1].ids.tolist() == [2]


def test_a_table_that_a_person_left_out_is_no_failure() -> None:
    runner = NodeRunner({"causes": "chefbot.nodes.causes.chains:CausesNode"}, {})
    reasons = (left_out("table_1"), not_taken("table_2"), not_reached("table_3", "no path."))
    for count in range(len(reasons) + 1):
        status = DeliveryStatus(state="driving", skipped_reasons=reasons[:count])
        runner.loop.publish("delivery_status", status, "delivery")
        runner.run(0.1)
    assert [cause.sentence for cause in runner.messages("causes")] == [reasons[2]]
