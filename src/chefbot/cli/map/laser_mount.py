"""The pose of a laser on the robot, by the transforms of a bag."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Transform, TransformStamped
from chefbot.msgs.sensor_msgs import LaserScan

MAX_TILT = math.radians(10.0)
"""Angle between the laser's plane and the floor above which its scans show no walls, rad."""
Matrix = NDArray[np.float64]
"""A homogeneous transform (4, 4)."""


class LaserMount(NamedTuple):
    """The pose of a laser on the robot's base, seen from above, and whether it is mounted upside down."""

    pose: SE2
    upside_down: bool = False


def laser_mount(transforms: Iterable[TransformStamped], base: str, laser: str) -> LaserMount | None:
    """Return the mount of the laser frame on the base frame; None if the transforms do not connect them.

    Raises UserError for a laser that is tilted.
    """
    # ROS 1 allows a slash before the names of frames
    edges = {
        one.child_frame_id.strip("/"): (one.header.frame_id.strip("/"), _matrix(one.transform))
        for one in transforms
    }
    base_root, to_base = _from_root(edges, base.strip("/"))
    laser_root, to_laser = _from_root(edges, laser.strip("/"))
    if base_root != laser_root:
        return None
    mount = np.linalg.inv(to_base) @ to_laser
    _check_level(mount, base, laser)
    yaw = math.atan2(mount[1, 0], mount[0, 0])
    return LaserMount(SE2(float(mount[0, 3]), float(mount[1, 3]), yaw), bool(mount[2, 2] < 0.0))


def _check_level(mount: Matrix, base: str, laser: str) -> None:
    if abs(mount[2, 2]) < math.cos(MAX_TILT):
        tilt = math.degrees(math.acos(min(1.0, abs(mount[2, 2]))))
        raise UserError(
            f"the laser {laser} is tilted by {tilt:.0f} degrees against {base}, so it sees no plane of walls"
        )


def _from_root(edges: dict[str, tuple[str, Matrix]], frame: str) -> tuple[str, Matrix]:
    """Return the root above a frame and the transform from the root to it."""
    pose, visited = np.eye(4), {frame}
    while frame in edges:
        frame, edge = edges[frame]
        pose = edge @ pose
        if frame in visited:
            raise UserError(f"the transforms of the bag form a circle at {frame}")
        visited.add(frame)
    return frame, pose


def _matrix(transform: Transform) -> Matrix:
    q, t = transform.rotation, transform.translation
    matrix = np.eye(4)
    matrix[:3, 3] = t.x, t.y, t.z
    matrix[:3, :3] = (
        (1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z), 2 * (q.x * q.z + q.w * q.y)),
        (2 * (q.x * q.y + q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z - q.w * q.x)),
        (2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x), 1 - 2 * (q.x * q.x + q.y * q.y)),
    )
    return matrix


def turned_upright(scan: LaserScan) -> LaserScan:
    """Return the scan of a laser that is mounted upside down as that of one at the same place the right way up.

    Its beams are in the opposite order, so that the last one is the first, and the time runs backwards.
    """
    sweep_ns = round(1e9 * float(scan.time_increment) * max(len(scan.ranges) - 1, 0))
    last = float(scan.angle_min) + float(scan.angle_increment) * max(len(scan.ranges) - 1, 0)
    header = msgspec.structs.replace(
        scan.header, stamp=type(scan.header.stamp).of(scan.header.stamp.ns + sweep_ns)
    )
    return msgspec.structs.replace(
        scan,
        header=header,
        angle_min=-last,
        angle_max=-float(scan.angle_min),
        time_increment=-float(scan.time_increment),
        ranges=np.ascontiguousarray(scan.ranges[::-1]),
        intensities=scan.intensities[:0],
    )
