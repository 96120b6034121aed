"""The robot's body as the 3-D view wants it: solids, frames, wheels."""

from __future__ import annotations

import math

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.spec import Robot
from chefbot.ui.layers import FrameView


def make_glb(robot: Robot) -> bytes:
    """The robot's solids, a node per link in the link's own frame. Loads the CAD libraries."""
    from chefbot.design.mesh import glb

    return glb(robot)


def frame_views(message: TFMessage) -> dict[str, FrameView]:
    """Frame to its place in its parent."""
    views = {}
    for one in message.transforms:
        at, turn = one.transform.translation, one.transform.rotation
        views[one.child_frame_id] = FrameView(
            name=one.child_frame_id,
            parent=one.header.frame_id,
            at=(at.x, at.y, at.z),
            turn=(turn.x, turn.y, turn.z, turn.w),
        )
    return views


def wheel_angles(ticks: WheelTicks, robot: Robot) -> dict[str, float]:
    """Joint to angle in radians within one turn; positive is forward (REP-103: about +y)."""
    turn = robot.motor.ticks_per_turn
    counts = {"wheel_left_joint": ticks.left, "wheel_right_joint": ticks.right}
    return {joint: math.tau * (count % turn) / turn for joint, count in counts.items()}
