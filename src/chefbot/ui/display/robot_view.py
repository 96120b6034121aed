"""The robot for the views of the web UI: its shape from above, solids, frames, wheel angles."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.joint_states import JOINTS, WHEELS, wheel_positions
from chefbot.robot.sensors import Sensors
from chefbot.robot.spec import Robot
from chefbot.ui.display.views import FrameView, RobotView, ShapeView, ViewCone

MOVED_DISTANCE, TURNED_ANGLE = 0.003, 0.003
"""Change of the estimated pose of a robot at rest from which it is shown, m and rad; less is noise."""


def make_glb(robot: Robot) -> bytes:
    """Return the robot's solids as GLB, a node per link in the link's own frame. Loads the CAD libraries."""
    from chefbot.design.solids.glb import glb

    return glb(robot)


def robot_view(pose: SE2, twist: Twist, shown: RobotView | None = None) -> RobotView:
    """Return pose and velocity to the millimetre and milliradian; `shown` if a robot at rest has not left it."""
    x, y, yaw = (round(float(number), 3) for number in pose)
    view = RobotView(x=x, y=y, yaw=yaw, v=round(twist.linear.x, 3), w=round(twist.angular.z, 3))
    return shown if shown and _is_at(shown, view) else view


def _is_at(shown: RobotView, view: RobotView) -> bool:
    """Return whether a robot stands, as before, where it is shown."""
    stands = view.v == view.w == shown.v == shown.w == 0.0
    moved, turned = math.hypot(view.x - shown.x, view.y - shown.y), abs(wrap(view.yaw - shown.yaw))
    return stands and moved <= MOVED_DISTANCE and turned <= TURNED_ANGLE


def shape_view(robot: Robot) -> ShapeView:
    """Return the robot seen from above: footprint, wheels, and the cones of sensors that do not see all around."""
    wheels, footprint = robot.wheels, robot.footprint
    sides = (wheels.separation / 2.0, -wheels.separation / 2.0)
    return ShapeView(
        radius=footprint.circumscribed_radius,
        corners=footprint.corners,
        wheels=tuple((0.0, y, wheels.diameter, wheels.width) for y in sides),
        cones=tuple(_cones(robot.sensors)),
    )


def _cones(sensors: Sensors) -> Iterator[ViewCone]:
    for sensor in (sensors.depth_camera, sensors.lidar):
        if sensor is None or sensor.field_of_view > math.pi:
            continue
        x, y, yaw = sensor.mount.planar
        yield ViewCone(x=x, y=y, yaw=yaw, field_of_view=sensor.field_of_view, range=sensor.range_max)


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
            time=round(transform.header.stamp.ns / 1e9, 2),
        )
    return views


def wheel_angles(ticks: WheelTicks, robot: Robot) -> dict[str, float]:
    """Return the angle of each wheel joint, rad, within one turn; positive is forward (REP-103: about +y)."""
    angles = np.mod(wheel_positions(ticks, robot), math.tau)
    return dict(zip(JOINTS, angles.tolist(), strict=True))
