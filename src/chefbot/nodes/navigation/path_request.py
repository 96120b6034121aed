"""Requests of a path from the planner, which has to answer in time."""

from __future__ import annotations

from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.nodes.navigation.recovery_behaviors import RecoveryBehaviorsNode
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import wait_any

PLANNER_TIMEOUT = 8.0
"""Time in which the planner has to answer, s; shorter than the patience with a robot that makes no progress, which
stands because there is no plan."""
PLANNER_SILENT = f"The planner has not answered for {PLANNER_TIMEOUT:.0f} s."
TIMEOUT = 207
"""Error code of nav2_msgs/action/ComputePathToPose: the planner has exceeded its time."""


class PathRequestNode(RecoveryBehaviorsNode):
    """Base class of a node that requests paths by compute_path_to_pose."""

    compute_path_to_pose = action_client(nav2.ComputePathToPose)
    _goal_notice = ""
    """What the planner reported about a goal to which it found a path: that it is occupied."""

    async def _plan(
        self, goal: PoseStamped, start: PoseStamped | None = None
    ) -> nav2.ComputePathToPose_Result:
        """Return the planner's result, from `start` or the robot's pose, or an error if there is none in time."""
        use_start = start is not None
        request = nav2.ComputePathToPose_Goal(goal, start or PoseStamped(), use_start=use_start)
        planning = self.compute_path_to_pose.call(request)
        await wait_any(planning, self.sleep(PLANNER_TIMEOUT))
        if planning.done:
            result = planning.result()
            self._goal_notice = "" if result.error_code else result.error_msg
            return result
        planning.discard()
        return nav2.ComputePathToPose_Result(error_code=TIMEOUT, error_msg=PLANNER_SILENT)
