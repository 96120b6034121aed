"""Nav2's actions of waypoints and people: hashes of Kilted, and the editions of Jazzy."""

from __future__ import annotations

import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.idl.editions import convert, older_editions
from chefbot.msgs.idl.fields import fields_of, ros_type
from chefbot.msgs.nav2_msgs import (
    FAILED,
    FollowWaypoints,
    FollowWaypoints_Result,
    NavigateThroughPoses,
    NavigateThroughPoses_Goal,
    WaypointStatus,
)
from chefbot.msgs.nav_msgs import Goals
from chefbot.msgs.std_msgs import Header

POSE = PoseStamped(Header.of(0, "map"), Pose.of(SE2(1.0, 2.0, 3.0)))


@pytest.mark.parametrize(
    ("action", "whole", "send_goal"),
    [
        (
            NavigateThroughPoses,
            "79fd41c3d79022e194035040f5adee498dfe56e797ede67e5ca31591d9f52eef",
            "0fb14135a40c3900a9a184f95b2ed6966a0ffd298739cc9de7903ebc6dc06a25",
        ),
        (
            FollowWaypoints,
            "667c9e9d426ede27da21dd3cdd3a34e4fc5cc6405b35bc9d5c0b084479920f54",
            "20cdb80c508af436914a6da2e812289d93c6b06b4cc0670ce6530c94797bb356",
        ),
    ],
    ids=lambda one: getattr(one, "name", ""),
)
def test_hashes_equal_those_that_rosidl_computed(action, whole: str, send_goal: str) -> None:
    assert action.type_hash == f"RIHS01_{whole}"
    assert action.send_goal_service.type_hash == f"RIHS01_{send_goal}"


@pytest.mark.slow
def test_poses_to_navigate_through_are_an_array_in_jazzy() -> None:
    jazzy, early = older_editions("nav2_msgs/action/NavigateThroughPoses")
    assert [field.name for field in fields_of(jazzy.result)] == ["error_code", "error_msg"]
    assert [field.name for field in fields_of(early.result)] == ["error_code"]
    assert "waypoint_statuses" not in jazzy.feedback.__struct_fields__
    ours = convert(jazzy.goal((POSE,), "tree"), NavigateThroughPoses_Goal)
    assert isinstance(ours.poses, Goals) and ours.poses.goals == (POSE,) and ours.behavior_tree == "tree"
    assert convert(ours, jazzy.goal).to_cdr() == jazzy.goal((POSE,), "tree").to_cdr()
    assert convert(jazzy.goal(()), NavigateThroughPoses_Goal).poses.goals == ()


def test_missed_waypoints_have_another_type_in_jazzy() -> None:
    jazzy, _ = older_editions("nav2_msgs/action/FollowWaypoints")
    (missed, *_) = fields_of(jazzy.result)
    assert missed.message is not None and ros_type(missed.message) == "nav2_msgs/msg/MissedWaypoint"
    result = FollowWaypoints_Result((WaypointStatus(FAILED, 2, POSE, 208, "no path"),), 603, "one was missed")
    theirs = convert(result, jazzy.result)
    back = convert(jazzy.result.from_cdr(theirs.to_cdr()), FollowWaypoints_Result)
    (one,) = back.missed_waypoints
    assert (one.waypoint_status, one.waypoint_index, one.error_code) == (FAILED, 2, 208)
    assert (back.error_code, back.error_msg) == (603, "one was missed")
