"""The robot's model for the 3-D view: solids, frames, wheel angles."""

from __future__ import annotations

import math

import numpy as np

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.joint_states import JOINTS, WHEELS, wheel_positions
from chefbot.robot.spec import Robot
from chefbot.ui.layers import FrameView


def make_glb(robot: Robot) -> bytes:
    """Return the robot's solids as GLB, a node per link in the link's own frame. Loads the CAD libraries."""
    from chefbot.design.solids.glb import glb

    return glb(robot)


def frame_views(message: TFMessage) -> dict[str, FrameView]:
    """Return each frame's pose in its parent by name, without the wheels, whose joint angles are sent
    separately."""
    views = {}
    for transform in message.transforms:
        if transform.child_frame_id in WHEELS:
            # Wheel frames are drawn from joint angles.
            continue
        translation, rotation = transform.transform.translation, transform.transform.rotation
        views[transform.child_frame_id] = FrameView(
            name=transform.child_frame_id,
            parent=transform.header.frame_id,
            at=(translation.x, translation.y, translation.z),
            turn=(rotation.x, rotation.y, rotation.z, rotation.w),
        )
    return views


def wheel_angles(ticks: WheelTicks, robot: Robot) -> dict[str, float]:
    """Return the angle of each wheel joint, rad, within one turn; positive is forward (REP-103: about +y)."""
    angles = np.mod(wheel_positions(ticks, robot), math.tau)
    return dict(zip(JOINTS, angles.tolist(), strict=True))
