"""Error codes of global planning, as nav2_msgs has them."""

from __future__ import annotations

from chefbot.planning.global_planning import ERROR_CODES, NO_TRANSFORM, RETRY_WITHOUT_FAR_MARKS
from chefbot.planning.planner import PlanningFailure

NAV2 = ("UNKNOWN", "INVALID_PLANNER", "TF_ERROR", "START_OUTSIDE_MAP", "GOAL_OUTSIDE_MAP", "START_OCCUPIED",
        "GOAL_OCCUPIED", "TIMEOUT", "NO_VALID_PATH")  # fmt: skip
"""The constants of nav2_msgs/action/ComputePathToPose from 200 on."""


def test_every_failure_has_the_code_of_its_name() -> None:
    assert set(ERROR_CODES) == set(PlanningFailure)
    assert {failure.name: code for failure, code in ERROR_CODES.items()} == {
        failure.name: 200 + NAV2.index(failure.name) for failure in PlanningFailure
    }
    assert 200 + NAV2.index("TF_ERROR") == NO_TRANSFORM


def test_only_what_far_obstacles_cause_is_repeated_without_them() -> None:
    assert {failure.name for failure in RETRY_WITHOUT_FAR_MARKS} == {"NO_VALID_PATH", "GOAL_OCCUPIED"}
