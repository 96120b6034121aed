"""Error codes of global planning, and the failures after which it is repeated."""

from __future__ import annotations

from chefbot.planning.planner import PlanningFailure

NO_TRANSFORM = 202
ERROR_CODES = {
    PlanningFailure.START_OUTSIDE_MAP: 203,
    PlanningFailure.GOAL_OUTSIDE_MAP: 204,
    PlanningFailure.START_OCCUPIED: 205,
    PlanningFailure.GOAL_OCCUPIED: 206,
    PlanningFailure.NO_VALID_PATH: 208,
}
"""Error codes of nav2_msgs/action/ComputePathToPose."""
RETRY_WITHOUT_FAR_MARKS = (PlanningFailure.NO_VALID_PATH, PlanningFailure.GOAL_OCCUPIED)
"""Failures after which planning is repeated without obstacles out of sensor range, which may have left."""
RETRY_THROUGH_NARROW_PASSAGES = (PlanningFailure.NO_VALID_PATH, PlanningFailure.START_OCCUPIED)
"""Failures after which planning is repeated through passages in which the body just fits."""
