"""The robot's fixed frames, from which URDF joints, /tf_static and SDF frames are generated."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.design.export.links import sensor_mounts
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.shapes import ORIGIN, Vector
from chefbot.robot.geometry.solids import link_origin
from chefbot.robot.spec import Robot

LEVEL: Vector = (0.0, 0.0, 0.0)
OPTICAL: Vector = (-math.pi / 2, 0.0, -math.pi / 2)
"""Roll, pitch, yaw from a body frame (x forward) to an optical one (z forward, x right; REP-103)."""
DEPTH_FRAME, OPTICAL_FRAME = "camera_depth_frame", "camera_depth_optical_frame"
COLOR_OPTICAL_FRAME = "color_camera_optical_frame"
"""Frame of a colour camera's images, with the origin of `color_camera_link`."""


class Frame(NamedTuple):
    """A fixed frame in its parent: `at` in metres, roll, pitch, yaw in radians."""

    name: str
    parent: str
    at: Vector
    rpy: Vector = LEVEL


def joint_name(link: str) -> str:
    """Return the joint of a link or frame: `wheel_left_joint` for `wheel_left_link`."""
    return link.removesuffix("_link").removesuffix("_frame") + "_joint"


def fixed_frames(robot: Robot) -> list[Frame]:
    """Return all frames except the wheels', parents first (names by REP-105 and the drivers' usage)."""
    frames = [
        Frame("base_link", "base_footprint", ORIGIN),
        Frame("payload_link", "base_link", link_origin(robot, "payload_link")),
    ]
    for name, at in layout.caster_positions(robot).items():
        frames.append(Frame(f"caster_{name}_link", "base_link", at))
    for name, (at, pitch, yaw) in sensor_mounts(robot).items():
        turned = yaw + robot.calibration.yaw_of(name)
        frames.append(Frame(name, "base_link", at, (0.0, pitch, turned)))
    if robot.sensors.depth_camera is not None:
        frames.append(Frame(DEPTH_FRAME, "camera_link", ORIGIN))
        frames.append(Frame(OPTICAL_FRAME, DEPTH_FRAME, ORIGIN, OPTICAL))
    if robot.sensors.color_camera is not None:
        frames.append(Frame(COLOR_OPTICAL_FRAME, "color_camera_link", ORIGIN, OPTICAL))
    return frames


def quaternion(rpy: Vector) -> tuple[float, float, float, float]:
    """Return w, x, y, z of rotations about the fixed axes x, then y, then z (REP-103)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle / 2), math.sin(angle / 2)) for angle in rpy)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
