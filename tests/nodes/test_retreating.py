"""A navigator that something remembered stops: it backs up along its track until its camera sees the place."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.behavior.retreat import sight_distance
from chefbot.causes.reports import CAMERA, END, LIDAR, SLOW, STOP, MarkedPlace, make_report
from chefbot.costmap.ranger_marks import contact_radius
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.geometry_msgs import PoseStamped, TransformStamped
from chefbot.msgs.nav2_msgs import BackUp, BackUp_Goal, BackUp_Result, Spin, Spin_Goal, Spin_Result
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.causes.motion_reasons import CONDITION, MONITOR
from chefbot.nodes.navigation.retreating import NO_TRACK, NOTHING_REMEMBERED, RetreatingNode
from chefbot.robot.load import load_robot
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams, Out
from chefbot.safety.obstacle_sensors import BLIND

NEAR = (1.2, 0.0)
"""A place 0.2 m from the end of the drive, in odom."""


class Retreating(RetreatingNode):
    """Backs up when the test starts it, and publishes the error."""

    params: NoParams
    error: Out[String]

    def begin(self) -> None:
        self.spawn(self._retreat())

    async def _retreat(self) -> None:
        self.error.publish(String((await self._back_up_to_see()).error_msg))


class Motions(Node):
    """A behavior server whose motions end at once."""

    params: NoParams
    spin, backup = action_server(Spin), action_server(BackUp)
    backup_error = ""

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        return Spin_Result()

    async def on_backup(self, _: BackUp_Goal, __: Any) -> BackUp_Result:
        return BackUp_Result(error_code=714 if self.backup_error else 0, error_msg=self.backup_error)


class Drive:
    """A robot that has driven one metre ahead and then turned, and its navigator."""

    def __init__(self, yaw: float = 0.0, length: float = 1.0, robot: str = "chefbot") -> None:
        kinds = {"navigator": f"{__name__}:Retreating", "behaviors": f"{__name__}:Motions"}
        self.runner = NodeRunner(kinds, {}, robot=load_robot(robot))
        for i in range(round(length / 0.05) + 1):
            self.move_to(SE2(1.0 - length + 0.05 * i, 0.0, 0.0))
        self.move_to(SE2(1.0, 0.0, yaw))

    def move_to(self, pose: SE2) -> None:
        now_ns = self.runner.loop.now_ns
        transform = TFMessage((TransformStamped.of(now_ns, "odom", "base_link", pose),))
        self.runner.loop.publish("tf", transform, "test", from_device=True)
        self.runner.run(0.25)

    def report(self, cause: Cause, seconds: float = 0.1) -> None:
        self.runner.loop.publish("cause_reports", cause, "base", from_device=True)
        self.runner.run(seconds)

    def retreat(self) -> tuple[list[float], list[float], str]:
        """Return the rotations (rad), the distances (m) and the error of a retreat."""
        navigator: Any = self.runner.system.nodes["navigator"]
        navigator.begin()
        self.runner.run(5.0)
        turns = [float(one.goal.target_yaw) for one in self.runner.messages("spin/_action/send_goal")]
        distances = [float(one.goal.target.x) for one in self.runner.messages("backup/_action/send_goal")]
        return turns, distances, self.runner.messages("error")[-1].data


def stop_at(x: float, y: float, kind: str = STOP, sensor: str = CAMERA, check: str = MONITOR) -> Cause:
    return make_report(kind, check, "An obstacle.", MarkedPlace(sensor, "odom", x, y, 0))


def test_it_backs_up_until_the_place_is_in_sight() -> None:
    drive = Drive()
    drive.report(stop_at(*NEAR))
    camera = drive.runner.system.nodes["navigator"].robot.sensors.depth_camera
    assert camera is not None
    far_enough = sight_distance(camera) - 0.2
    assert drive.retreat() == ([], [pytest.approx(-far_enough, abs=0.051)], "")


def test_it_turns_its_back_to_its_track_first_and_looks_at_last() -> None:
    drive = Drive(yaw=-1.2)
    drive.report(stop_at(1.1, -0.2))
    turns, distances, error = drive.retreat()
    assert turns == [pytest.approx(1.2, abs=0.01), pytest.approx(-0.35, abs=0.1)]
    assert len(distances) == 1 and error == ""


def test_a_stop_that_has_just_ended_counts_but_not_for_long() -> None:
    drive = Drive()
    drive.report(stop_at(*NEAR))
    drive.report(stop_at(*NEAR, kind=END), seconds=1.0)
    assert drive.retreat()[2] == ""
    drive.runner.run(4.0)
    assert drive.retreat()[2] == NOTHING_REMEMBERED


@pytest.mark.parametrize(
    "report",
    [
        stop_at(*NEAR, sensor=LIDAR),
        stop_at(*NEAR, kind=SLOW),
        stop_at(*NEAR, check=CONDITION),
        stop_at(float("nan"), 0.0),
        make_report(STOP, MONITOR, "No sensor has recently seen the ground."),
    ],
)
def test_it_stays_if_its_camera_remembers_nothing_that_stops_it(report: Cause) -> None:
    drive = Drive()
    drive.report(report)
    assert drive.retreat() == ([], [], NOTHING_REMEMBERED)


def test_it_stays_where_no_track_leads_back() -> None:
    drive = Drive(length=0.1)
    drive.report(stop_at(*NEAR))
    assert drive.retreat() == ([], [], NO_TRACK)


def test_a_way_back_that_is_blocked_is_an_error() -> None:
    drive = Drive()
    drive.report(stop_at(1.1, -0.2))
    motions: Any = drive.runner.system.nodes["behaviors"]
    motions.backup_error = "Blocked."
    turns, distances, error = drive.retreat()
    assert turns == [] and len(distances) == 1 and error == "Blocked."


def test_it_backs_up_to_see_what_it_touches() -> None:
    """A board above the ranger is too near for the camera, and only seen from farther away."""
    drive = Drive()
    drive.runner.loop.publish("contact", PoseStamped(Header.of(0, "base_link")), "controller")
    drive.runner.run(0.1)
    turns, distances, error = drive.retreat()
    robot = drive.runner.system.nodes["navigator"].robot
    camera = robot.sensors.depth_camera
    assert camera is not None
    far_enough = sight_distance(camera) - contact_radius(robot)
    assert (turns, distances, error) == ([], [pytest.approx(-far_enough, abs=0.051)], "")
    drive.runner.run(4.0)
    assert drive.retreat()[2] == NOTHING_REMEMBERED


def test_it_backs_up_once_from_what_blinds_its_camera() -> None:
    """A mirror or a wall nearer than the camera's minimum range; a cover on its lens it takes along."""
    drive = Drive()
    drive.runner.loop.publish("collision_monitor/reason", String(BLIND), "base")
    drive.runner.run(0.1)
    _, distances, error = drive.retreat()
    assert error == "" and len(distances) == 1 and distances[0] < -0.3
    assert drive.retreat()[2] == NOTHING_REMEMBERED


@pytest.mark.parametrize(("robot", "backs_up"), [("chefbot_lidar", True), ("chefbot", False)])
def test_ground_covered_before_counts_where_a_lidar_sees_it(robot: str, backs_up: bool) -> None:
    drive = Drive(robot=robot)
    drive.runner.run(40.0)
    drive.report(stop_at(*NEAR))
    assert (drive.retreat()[2] == "") == backs_up
