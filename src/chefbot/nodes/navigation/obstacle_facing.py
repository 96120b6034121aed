"""Turns the robot to what occupies its goal, so that the sensor that marked it sees whether it is still there."""

from __future__ import annotations

import math

from chefbot.behavior.motion_errors import SPIN
from chefbot.causes.reports import MAP, is_zone
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import Spin_Result
from chefbot.nodes.navigation.blockage_request import BlockageRequestNode
from chefbot.nodes.navigation.recovery_behaviors import RecoveryBehaviorsNode
from chefbot.runtime.transform_buffer import TransformError

TIME_ALLOWANCE = 10.0
"""Time in which the robot faces the obstacle, s: half a turn and waiting for a sensor."""
NOTHING_TO_SEE = "No sensor has marked what occupies the goal."


class ObstacleFacingNode(RecoveryBehaviorsNode, BlockageRequestNode):
    """Base class of a node that turns the robot to what occupies its goal."""

    async def _face_obstacle(self, goal: PoseStamped) -> Spin_Result:
        """Rotate in place until the robot faces what occupies a pose; an error if no sensor shows it or it cannot."""
        found = await self._find_blockage(goal)
        if not found.goal_occupied or found.sensor == MAP or is_zone(found.sensor):
            return Spin_Result(error_code=SPIN.unknown, error_msg=NOTHING_TO_SEE)
        try:
            robot = self.tf.lookup("map", "base_link")
        except TransformError as error:
            return Spin_Result(error_code=SPIN.unknown, error_msg=str(error))
        obstacle = robot.between(SE2(found.point.x, found.point.y, 0.0))
        angle = math.atan2(obstacle.y, obstacle.x)
        return await self._spin_by(angle, TIME_ALLOWANCE)
