"""Spin, BackUp and DriveOnHeading mean and answer what Nav2's behaviours do."""

from __future__ import annotations

import pytest
from tests.nodes import test_stopped
from tests.nodes.test_stopped import Robot

from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_CANCELED
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Point, Twist
from chefbot.msgs.nav2_msgs import BackUp_Goal, DriveOnHeading_Goal, Spin_Goal
from chefbot.nodes.controller import ControllerNode

INVALID = {"backup": 713, "drive_on_heading": 724}
TIMEOUT = {"backup": 711, "drive_on_heading": 721, "spin": 701}
SHORT = Duration.of(0.5)


def ordered(robot: Robot, name: str, goal: object, seconds: float = 2.0) -> None:
    """Somebody gives it."""
    action, before = test_stopped.ORDERS[name]
    test_stopped.ORDERS[name] = action, goal
    try:
        robot.order(name)
    finally:
        test_stopped.ORDERS[name] = action, before
    robot.run(seconds)


def speeds(robot: Robot) -> list[float]:
    """What navigation commanded."""
    return [
        one.message.linear.x
        for one in robot.said
        if one.topic == "cmd_vel_nav" and isinstance(one.message, Twist)
    ]


@pytest.mark.parametrize("metres", [0.3, -0.3])
@pytest.mark.parametrize("speed", [0.1, -0.1])
def test_backing_up_is_backwards_whatever_the_sign(metres: float, speed: float) -> None:
    robot = Robot()
    ordered(robot, "backup", BackUp_Goal(Point(metres), speed))
    assert min(speeds(robot)) < 0.0 and max(speeds(robot)) <= 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_driving_goes_where_the_sign_says(sign: float) -> None:
    robot = Robot()
    ordered(robot, "drive_on_heading", DriveOnHeading_Goal(Point(0.3 * sign), 0.1 * sign))
    assert max(one * sign for one in speeds(robot)) > 0.0 and min(one * sign for one in speeds(robot)) >= 0.0


@pytest.mark.parametrize(
    ("name", "goal"),
    [
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3), -0.1)),
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3, 0.1), 0.1)),
        ("backup", BackUp_Goal(Point(0.3, 0.0, 0.1), 0.1)),
    ],
)
def test_what_cannot_be_driven_is_refused_with_nav2s_code(name: str, goal: object) -> None:
    robot = Robot()
    ordered(robot, name, goal)
    (outcome,) = robot.outcomes(name)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, INVALID[name])
    assert not any(speeds(robot))


@pytest.mark.parametrize(
    ("name", "goal"),
    [
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3), 0.1, SHORT)),
        ("backup", BackUp_Goal(Point(0.3), 0.1, SHORT)),
        ("spin", Spin_Goal(1.0, SHORT)),
    ],
)
def test_time_that_runs_out_has_nav2s_code(name: str, goal: object) -> None:
    robot = Robot()  # it stands whatever it is told
    ordered(robot, name, goal)
    (outcome,) = robot.outcomes(name)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, TIMEOUT[name])
    assert outcome.result.total_elapsed_time.seconds == pytest.approx(0.5, abs=0.25)


def test_one_motion_ends_when_another_begins() -> None:
    robot = Robot()
    ordered(robot, "spin", Spin_Goal(3.0), 0.5)
    ordered(robot, "backup", BackUp_Goal(Point(0.3), 0.1, SHORT))
    assert [one.status for one in robot.outcomes("spin")] == [STATUS_CANCELED]
    assert robot.outcomes("backup")[0].result.error_code == TIMEOUT["backup"]
    controller = robot.system.nodes["controller"]
    assert isinstance(controller, ControllerNode) and not controller.spin.busy and not controller.backup.busy
