"""A navigator beside an occupied goal: it turns to what is there before it accepts that it is near enough."""

from __future__ import annotations

import math
from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import FindBlockage, FindBlockage_Goal, FindBlockage_Result
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav2_msgs import Spin, Spin_Goal, Spin_Result
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.navigation.obstacle_facing import NOTHING_TO_SEE, ObstacleFacingNode
from chefbot.nodes.navigation.recovery_behaviors import SILENT
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams, Out

GOAL = PoseStamped(Header.of(0, "map"), Pose.of(SE2(3.0, 2.0, 0.0)))


class Facing(ObstacleFacingNode):
    """Turns to what occupies the goal when the test starts it, and publishes the error."""

    params: NoParams
    error: Out[String]

    def begin(self) -> None:
        self.spawn(self._face())

    async def _face(self) -> None:
        result = await self._face_obstacle(GOAL)
        self.error.publish(String(result.error_msg))


class OccupiedGoal(Node):
    """A planner whose goal is occupied at a point in the map, and a base that turns at once."""

    params: NoParams
    find_blockage = action_server(FindBlockage)
    spin = action_server(Spin)
    point: tuple[float, float] | None = None
    spin_error, sensor, spins = "", "ultrasonic ranger", True

    async def on_find_blockage(self, _: FindBlockage_Goal, __: Any) -> FindBlockage_Result:
        if self.point is None:
            return FindBlockage_Result()
        return FindBlockage_Result(goal_occupied=True, point=Point(*self.point), sensor=self.sensor)

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        if not self.spins:
            await self.sleep(3600.0)
        return Spin_Result(error_code=703 if self.spin_error else 0, error_msg=self.spin_error)


def faced(point: tuple[float, float] | None, robot: SE2 | None, **planner: object) -> tuple[list[float], str]:
    """Return the angles by which a robot turns, rad, and the error, for an obstacle at a point."""
    kinds = {"navigator": f"{__name__}:Facing", "planner": f"{__name__}:OccupiedGoal"}
    runner = NodeRunner(kinds, {})
    node: Any = runner.system.nodes["planner"]
    for name, value in {"point": point, **planner}.items():
        setattr(node, name, value)
    if robot is not None:
        transform = TFMessage((TransformStamped.of(0, "map", "base_link", robot),))
        runner.loop.publish("tf_static", transform, "test", from_device=True)
    navigator: Any = runner.system.nodes["navigator"]
    navigator.begin()
    runner.run(80.0)
    angles = [float(one.goal.target_yaw) for one in runner.messages("spin/_action/send_goal")]
    return angles, runner.messages("error")[-1].data


@pytest.mark.parametrize("bearing", [-3.0, -0.4, 0.0, 1.2, 3.1])
def test_it_turns_by_the_bearing_of_the_obstacle(bearing: float) -> None:
    robot = SE2(2.6, 1.8, 2.0)
    at = (robot.x + 0.4 * math.cos(robot.yaw + bearing), robot.y + 0.4 * math.sin(robot.yaw + bearing))
    angles, error = faced(at, robot)
    assert angles == [pytest.approx(bearing, abs=1e-6)] and error == ""


def test_it_does_not_turn_without_an_obstacle_or_a_pose() -> None:
    assert faced(None, SE2(2.6, 1.8, 2.0)) == ([], NOTHING_TO_SEE)
    angles, error = faced((3.0, 2.0), None)
    assert angles == [] and "map" in error


@pytest.mark.parametrize("sensor", ["map", "keep-out zone kitchen"])
def test_it_does_not_turn_to_what_no_sensor_can_see_gone(sensor: str) -> None:
    assert faced((3.0, 2.0), SE2(2.6, 1.8, 2.0), sensor=sensor) == ([], NOTHING_TO_SEE)


def test_a_rotation_that_fails_is_an_error() -> None:
    assert faced((3.0, 2.0), SE2(2.6, 1.8, 2.0), spin_error="Blocked.")[1] == "Blocked."
    assert faced((3.0, 2.0), SE2(2.6, 1.8, 2.0), spins=False)[1] == SILENT
