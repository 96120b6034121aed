"""Contacts that the controller concludes from a robot that does not move although it is driven."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.nodes.clear_sensors import WALL
from tests.support.nodes import AHEAD, NodeRunner, StationaryRobot, send_goal_and_run

from chefbot.control.path_follower import FollowPathError
from chefbot.control.slip_detector import MIN_TRAVEL
from chefbot.costmap.sources import CONTACT
from chefbot.maths.costs import LETHAL
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped, Twist, Vector3
from chefbot.msgs.nav2_msgs import FollowPath_Goal, SpeedLimit
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.navigation.contacts import SLIPPING, ContactsNode
from chefbot.nodes.navigation.controller_params import ControllerNodeParams

FAR_AHEAD = PoseStamped(Header.of(0, "odom"), Pose.of(SE2(4.0, 0.0, 0.0)))
FAULT = "The left encoder is silent. The motors are off; press STOP, then Release STOP, to clear it."


def following() -> StationaryRobot:
    robot = StationaryRobot()
    robot.send_goal("follow_path")
    robot.run(2.0)
    assert robot.messages("cmd_vel")[-1].linear.x > 0.0
    return robot


def test_a_driven_robot_without_progress_touches_something() -> None:
    robot = following()
    robot.run(10.0)
    (outcome,) = robot.results("follow_path")
    assert outcome.result.error_code == FollowPathError.STUCK
    (contact,) = robot.messages("contact")
    assert contact.header.frame_id == "base_link"


class SlippingRobot(StationaryRobot):
    """A robot whose odometry moves as commanded, while its scans show that it stands."""

    fixed = (("map", "odom"), ("base_footprint", "base_link"))
    x = 0.0

    def __init__(self) -> None:
        self.track: list[tuple[int, float]] = []
        super().__init__()

    def odometry_at(self, time_ns: int) -> float:
        """Return the x coordinate that the odometry had at a time."""
        return next(x for then_ns, x in self.track if then_ns >= time_ns)

    def run(self, seconds: float) -> None:
        """Run and publish the odometry at 50 Hz, with scans that are never exactly the same."""
        lidar: Any = self.system.nodes["sensors"]
        for _ in range(round(50 * seconds)):
            super().run(0.02)
            lidar.ranges = lidar.ranges[::-1] if lidar.ranges[0] < WALL else np.linspace(6.99, WALL, 360)
            twists = self.messages("cmd_vel")
            self.x += 0.02 * twists[-1].linear.x if twists else 0.0
            self.track.append((self.loop.now_ns, self.x))
            moved = TransformStamped.of(self.loop.now_ns, "odom", "base_footprint", SE2(self.x, 0.0, 0.0))
            self.loop.publish("tf", TFMessage((moved,)), "odometry")


def test_wheels_that_slip_end_the_path_with_a_contact() -> None:
    robot = SlippingRobot()
    path = FollowPath_Goal(Path(Header.of(0, "odom"), (AHEAD, FAR_AHEAD)))
    send_goal_and_run(robot, "follow_path", path, 6.0)
    (outcome,) = robot.results("follow_path")
    assert outcome.result.error_code == FollowPathError.STUCK
    assert outcome.result.error_msg.startswith(SLIPPING) and robot.x < 0.8
    (contact,) = robot.messages("contact")
    slipped = robot.x - robot.odometry_at(contact.header.stamp.ns)
    assert slipped == pytest.approx(MIN_TRAVEL, abs=0.1), "the pose on the map is that from before the slip"
    costs: Any = robot.system.nodes["controller"]._costs
    columns = np.nonzero(costs.source_cells(CONTACT) == LETHAL)[1]
    touched = costs.origin_x + (columns + 0.5) * costs.resolution
    assert len(touched) and (touched > robot.x + 0.1).all(), "where the odometry has it now"
    assert SLIPPING in {report.sentence for report in robot.messages("cause_reports")}
    robot.run(2.0)
    send_goal_and_run(robot, "follow_path", path, 1.0)
    assert len(robot.results("follow_path")) == 1, "what was seen before does not count again"


@pytest.mark.parametrize("after", [0.0, 5.5])
@pytest.mark.slow
def test_motors_that_are_off_are_waited_for_without_a_contact(after: float) -> None:
    robot = following()
    robot.run(after)
    robot.loop.publish("board_fault", String(FAULT), "board")
    robot.run(15.0)
    assert robot.messages("contact") == [] and robot.results("follow_path") == []
    assert robot.messages("controller/wait_reason")[-1].data == FAULT
    reports = [report for report in robot.messages("cause_reports") if FAULT in report.sentence]
    assert reports and {report.kind for report in reports} <= {"stop", "end"}
    robot.loop.publish("board_fault", String(""), "board")
    robot.run(2.0)
    assert robot.messages("cmd_vel")[-1].linear.x > 0.0


def test_a_speed_limit_too_low_to_drive_is_waited_for() -> None:
    robot = following()
    robot.loop.publish("speed_limit", SpeedLimit(speed_limit=0.001), "another program")
    robot.run(12.0)
    assert robot.messages("contact") == [] and robot.results("follow_path") == []
    reason = "The speed limit of 1.0 mm/s is too low to drive."
    assert robot.messages("controller/wait_reason")[-1].data == reason
    assert "speed limit" in {report.check for report in robot.messages("cause_reports")}
    robot.loop.publish("speed_limit", SpeedLimit(), "another program")
    robot.run(2.0)
    assert robot.messages("cmd_vel")[-1].linear.x > 0.0


class BareContacts(ContactsNode):
    """The base class alone."""

    params: ControllerNodeParams


@pytest.mark.parametrize(("speed", "contacts"), [(0.0, 0), (0.2, 1), (-0.2, 1)])
def test_only_a_driven_robot_touches_something(speed: float, contacts: int) -> None:
    nodes = NodeRunner({"contacts": f"{__name__}:BareContacts"}, {})
    node: Any = nodes.system.nodes["contacts"]
    for _ in range(30):
        nodes.loop.publish("cmd_vel", Twist(Vector3(speed)), "test")
        nodes.run(0.1)
    node.publish_contact_if_driven()
    nodes.run(0.1)
    assert [contact.header.frame_id for contact in nodes.messages("contact")] == ["base_link"] * contacts
