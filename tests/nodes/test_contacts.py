"""Contacts that the controller concludes from a robot that does not move although it is driven."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import NodeRunner, StationaryRobot

from chefbot.control.path_follower import FollowPathError
from chefbot.msgs.geometry_msgs import Twist, Vector3
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.msgs.std_msgs import String
from chefbot.nodes.navigation.contacts import ContactsNode
from chefbot.nodes.navigation.controller_params import ControllerNodeParams

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
