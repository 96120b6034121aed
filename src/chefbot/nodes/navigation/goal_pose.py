"""Goals as they are sent: in any frame, and not always poses."""

from __future__ import annotations

import msgspec

from chefbot.errors import ChefbotError
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.validity import check
from chefbot.planning.global_planning import ERROR_CODES, NO_TRANSFORM
from chefbot.planning.planner import PlanningFailure
from chefbot.runtime.transform_buffer import TransformBuffer, TransformError

MAP = "map"


class GoalError(ChefbotError):
    """Raised for a goal to which the robot cannot drive: `code` is that of ComputePathToPose, the text a sentence."""

    def __init__(self, code: int, sentence: str) -> None:
        super().__init__(sentence)
        self.code = code


def goal_in_map(goal: PoseStamped, transforms: TransformBuffer) -> PoseStamped:
    """Return a goal in the map frame, in which one without a frame is. Raises GoalError.

    It is transformed once, with the newest transform: a goal in a frame that moves does not move with it.
    """
    try:
        check(goal)
    except InvalidMessageError as error:
        outside = ERROR_CODES[PlanningFailure.GOAL_OUTSIDE_MAP]
        raise GoalError(outside, f"The goal is not a pose on the map: {error}.") from None
    frame = goal.header.frame_id
    if frame in ("", MAP):
        return goal
    try:
        pose = transforms.lookup(MAP, frame) @ goal.pose.se2
    except TransformError as error:
        raise GoalError(NO_TRANSFORM, f"The goal is in the frame {frame!r}: {error}.") from None
    return PoseStamped(msgspec.structs.replace(goal.header, frame_id=MAP), Pose.of(pose))
