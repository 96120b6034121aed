"""Ray casting through MuJoCo's world for lidar and ultrasonic ranger."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.mjcf import LOOKS_GROUP
from chefbot.robot.as_built import AsBuilt
from chefbot.robot.geometry.shapes import rotation
from chefbot.robot.section import Mount
from chefbot.robot.sensors import Lidar, Ultrasonic
from chefbot.sim.world.world_mjcf import GLASS_GROUP, MIRROR_GROUP

WORLD_ONLY = np.array([1, 0, 0, 0, 1, 1], dtype=np.uint8)
"""Geom groups that reflect sound, without the robot's own."""
OPAQUE_ONLY = np.array([group in (0, MIRROR_GROUP) for group in range(6)], dtype=np.uint8)
"""Geom groups that light does not pass."""
MAX_GLASS_ANGLE = math.radians(5.0)
"""Incidence angle, from the surface normal, up to which glass reflects a laser beam back to the sensor. An
assumption: scanners see glass within a few degrees of a right angle."""
ROBOT_ONLY = np.array([group == LOOKS_GROUP for group in range(6)], dtype=np.uint8)
"""Geom groups of the robot's parts as built, without the sensor housings."""
BasePose = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Pose of base_link in the world: position (3,) and rotation (3, 3)."""
CONE_RINGS = 4
MAX_ECHO_ANGLE = math.radians(60.0)
"""Maximum incidence angle, from the surface normal, of a reflection back to the sensor; beyond it sound is
mirrored away, so that the ranger does not detect the floor."""
MIRROR_OFFSET = 1e-4  # m
ULTRASONIC_NOISE = 0.003  # m, standard deviation of an HC-SR04's reading


def mount_rotation(mount: Mount) -> NDArray[np.float64]:
    """Return the rotation (3, 3) from the sensor frame to base_link."""
    return rotation(mount.pitch, mount.yaw)


def lidar_angles(lidar: Lidar) -> NDArray[np.float64]:
    """Return (beams,) bearings in the lidar frame, rad, in equal steps; a full turn ends one step before pi."""
    return lidar.angle_min + lidar.angle_increment * np.arange(lidar.beams, dtype=np.float64)


def rotate_mount(mount: Mount, yaw: float) -> Mount:
    """Return the mount rotated by `yaw` rad to the left."""
    return msgspec.structs.replace(mount, yaw=mount.yaw + yaw)


def lidar_rays(lidar: Lidar, mount: Mount | None = None, *, upside_down: bool = False) -> NDArray[np.float64]:
    """Return (beams, 3) unit vectors in base_link; `mount` overrides the drawn one with the actual one."""
    angles = -lidar_angles(lidar) if upside_down else lidar_angles(lidar)
    flat = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    return flat @ mount_rotation(mount or lidar.mount).T


def cone_rays(ultrasonic: Ultrasonic) -> NDArray[np.float64]:
    """Return (n, 3) unit vectors in base_link that fill the cone: one on its axis, the others in rings."""
    rays = [(1.0, 0.0, 0.0)]
    for ring in range(1, CONE_RINGS + 1):
        off_axis = ultrasonic.field_of_view / 2 * ring / CONE_RINGS
        for azimuth in np.linspace(0.0, 2.0 * math.pi, 6 * ring, endpoint=False):
            radius = math.sin(off_axis)
            rays.append((math.cos(off_axis), radius * math.cos(azimuth), radius * math.sin(azimuth)))
    return np.array(rays) @ mount_rotation(ultrasonic.mount).T


def lidar_caster(lidar: Lidar, as_built: AsBuilt) -> RayCaster:
    """Return the bundle of rays of a lidar as it is mounted."""
    mount = rotate_mount(lidar.mount, as_built.lidar_yaw)
    rays = lidar_rays(lidar, mount, upside_down=as_built.lidar_upside_down)
    return RayCaster(mount, rays, lidar.range_max + 1.0)


class RayCaster:
    """A bundle of rays from one sensor on the robot."""

    def __init__(self, mount: Mount, rays: NDArray[np.float64], max_range: float) -> None:
        self._mount_position = np.array([mount.x, mount.y, mount.z])
        self._rays = rays
        self._max_range = max_range
        self._geom_ids = np.zeros(len(rays), dtype=np.int32)
        self._distances = np.zeros(len(rays))
        self._normals = np.zeros(3 * len(rays))
        self.own_body: NDArray[np.float64] = np.full(len(rays), np.inf)
        """Distance at which the robot's own body blocks each ray, m."""

    def cast(
        self, model: Any, data: Any, base: BasePose, groups: NDArray[np.uint8] = WORLD_ONLY
    ) -> NDArray[np.float64]:
        """Return (n,) distances to the first hit, m, inf for none, with base_link at `base`."""
        position, rotation = base
        origin = position + rotation @ self._mount_position
        vectors = np.ascontiguousarray(self._rays @ rotation.T).ravel()
        count = len(self._rays)
        mujoco.mj_multiRay(
            model, data, origin, vectors, groups, True, -1,
            self._geom_ids, self._distances, self._normals, count, self._max_range,
        )  # fmt: skip
        return np.where(self._geom_ids >= 0, self._distances, np.inf)

    def cast_light(self, model: Any, data: Any, base: BasePose) -> NDArray[np.float64]:
        """Return the distances as `cast` does, for laser light, which passes glass and is reflected by mirrors.

        Glass returns a beam that hits it at a right angle. A beam that a mirror reflects measures the length of the
        way to what it meets then.
        """
        groups, (position, rotation) = model.geom_group, base
        ranges = self.cast(model, data, base, OPAQUE_ONLY)
        hits, normals = self._geom_ids.copy(), self._normals.reshape(-1, 3).copy()
        beams = self._rays @ rotation.T
        if (groups == MIRROR_GROUP).any():
            origin = position + rotation @ self._mount_position
            for i in np.flatnonzero((hits >= 0) & (groups[hits] == MIRROR_GROUP)):
                point = origin + ranges[i] * beams[i]
                ranges[i] += _reflected_range(model, data, point, beams[i], normals[i])
        if (groups == GLASS_GROUP).any():
            to_glass = self.cast(model, data, base)
            cos_incidence = np.abs(np.sum(self._normals.reshape(-1, 3) * beams, axis=1))
            is_glass = (self._geom_ids >= 0) & (groups[self._geom_ids] == GLASS_GROUP)
            returned = is_glass & (cos_incidence > math.cos(MAX_GLASS_ANGLE))
            ranges = np.where(returned, to_glass, ranges)
        return ranges

    def echoes(self, model: Any, data: Any, base: BasePose) -> NDArray[np.float64]:
        """Return the distances as `cast` does, for ultrasound: surfaces hit at too flat an angle give inf."""
        ranges, rotation = self.cast(model, data, base), base[1]
        # Cosine of the incidence angle: |n . d|.
        cos_incidence = np.abs(np.sum(self._normals.reshape(-1, 3) * (self._rays @ rotation.T), axis=1))
        return np.where(cos_incidence > math.cos(MAX_ECHO_ANGLE), ranges, np.inf)


def _reflected_range(
    model: Any,
    data: Any,
    point: NDArray[np.float64],
    beam: NDArray[np.float64],
    normal: NDArray[np.float64],
) -> float:
    """Return the distance (m) from a mirror at `point` to what a reflected beam (3,) meets, inf for nothing."""
    # Reflection: d' = d - 2 (d . n) n; the ray begins a little before the mirror.
    reflected = beam - 2.0 * float(beam @ normal) * normal
    geom_id = np.zeros(1, dtype=np.int32)
    start = point + MIRROR_OFFSET * reflected
    distance = mujoco.mj_ray(model, data, start, reflected, OPAQUE_ONLY, True, -1, geom_id, np.zeros(3))
    return distance + MIRROR_OFFSET if distance >= 0.0 else math.inf


def to_rep117(ranges: NDArray[np.float64], range_min: float, range_max: float) -> NDArray[np.float32]:
    """Convert ranges to REP-117: inf where nothing is seen, -inf where something is too close to measure."""
    limited = np.where(ranges > range_max, np.inf, ranges)
    return np.where(limited < range_min, -np.inf, limited).astype(np.float32)
