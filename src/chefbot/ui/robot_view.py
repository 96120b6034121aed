"""The robot's body as the 3-D view wants it: solids, frames, wheels."""

from __future__ import annotations

import math

import numpy as np

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.joint_states import JOINTS, WHEELS, wheel_positions
from chefbot.robot.spec import Robot
from chefbot.ui.layers import FrameView


def make_glb(robot: Robot) -> bytes:
    """The robot's solids, a node per link in the link's own frame. Loads the CAD libraries."""
    from chefbot.design.solids.glb import glb

    return glb(robot)


def frame_views(message: TFMessage) -> dict[str, FrameView]:
    """Frame to its place in its parent; not of the wheels, which are told as joints, so that they can be turned."""
    views = {}
    for one in message.transforms:
        if one.child_frame_id in WHEELS:
            continue
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
    angles = np.mod(wheel_positions(ticks, robot), math.tau)
    return dict(zip(JOINTS, angles.tolist(), strict=True))
