"""Requests of what blocks a path from the planner, which has to answer in time."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import FindBlockage, FindBlockage_Goal, FindBlockage_Result
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import wait_any
from chefbot.runtime.node import Node

ANSWER_TIMEOUT = 2.0
"""Time in which the planner has to answer what blocks a path, s."""


class BlockageRequestNode(Node):
    """Base class of a node that requests what blocks a path by find_blockage."""

    find_blockage = action_client(FindBlockage)

    async def _find_blockage(
        self, goal: PoseStamped, *, find_waiting_pose: bool = False
    ) -> FindBlockage_Result:
        """Return what blocks the path to a pose; nothing if the planner does not answer in time."""
        finding = self.find_blockage.call(FindBlockage_Goal(goal, find_waiting_pose))
        await wait_any(finding, self.sleep(ANSWER_TIMEOUT))
        if finding.done:
            return finding.result()
        finding.discard()
        return FindBlockage_Result()
