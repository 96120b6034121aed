"""The controller of a camera robot looks to the sides before it drives off among people."""

from __future__ import annotations

import numpy as np
import pytest
from tests.support.nodes import StationaryRobot, send_goal_and_run

from chefbot.causes.reports import STOP
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, Twist
from chefbot.msgs.nav2_msgs import FollowPath_Goal
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.navigation.side_looking import LOOKS, side_look_of
from chefbot.robot.load import load_robot

PATH = FollowPath_Goal(
    Path(
        Header.of(0, "odom"),
        tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.1 * i, 0.0, 0.0))) for i in range(21)),
    )
)


def follow_path(people: bool, standing: float = 0.0) -> StationaryRobot:
    """Return a camera robot that has followed a path straight ahead for a second, after it stood for a time, s.

    people: whether somebody is seen at the beginning.
    """
    robot = StationaryRobot(load_robot("chefbot"))
    somebody = TrackedPerson(id=1, position=Point(4.0), covariance=0.01 * np.eye(4).ravel())
    header = Header.of(robot.loop.now_ns, "odom")
    robot.loop.publish("tracked_people", TrackedPeople(header, (somebody,) if people else ()), "tracker")
    robot.run(standing)
    send_goal_and_run(robot, "follow_path", PATH, 1.0)
    return robot


def commands(robot: StationaryRobot) -> list[Twist]:
    return [item for item in robot.messages("cmd_vel_nav") if isinstance(item, Twist)]


def test_among_people_it_turns_before_it_drives() -> None:
    robot = follow_path(people=True)
    assert max(abs(twist.angular.z) for twist in commands(robot)) > 0.3
    assert not any(twist.linear.x for twist in commands(robot))


def test_people_seen_while_it_stood_count_as_well() -> None:
    assert not any(twist.linear.x for twist in commands(follow_path(people=True, standing=5.0)))


def test_it_reports_why_it_turns() -> None:
    reports = follow_path(people=True).messages("cause_reports")
    (looks,) = [report for report in reports if report.check == "view to the sides"]
    assert (looks.kind, looks.sentence) == (STOP, LOOKS)


def test_without_people_it_drives_at_once() -> None:
    robot = follow_path(people=False)
    assert max(twist.linear.x for twist in commands(robot)) > 0.1
    assert "view to the sides" not in [report.check for report in robot.messages("cause_reports")]


@pytest.mark.parametrize(("name", "looks"), [("chefbot", True), ("chefbot_lidar", False), ("jackal", False)])
def test_only_a_disc_without_a_lidar_needs_to_look(name: str, looks: bool) -> None:
    assert (side_look_of(load_robot(name)) is not None) is looks
