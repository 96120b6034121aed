"""Contacts that the controller concludes from a robot that does not move although it is driven."""

from __future__ import annotations

import pytest
from tests.support.nodes import StationaryRobot

from chefbot.control.path_follower import FollowPathError
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.msgs.std_msgs import String

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
