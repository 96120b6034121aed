"""Ray casting through the world for lidar and ultrasonic ranger."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.mjcf import LOOKS_GROUP
from chefbot.robot.as_built import AsBuilt
from chefbot.robot.geometry.shapes import rotation
from chefbot.robot.section import Mount
from chefbot.robot.sensors import Lidar, Ultrasonic
from chefbot.sim.ray_kernels import cast_rays
from chefbot.sim.world.shapes import ShapeArrays

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
SOUND = -1.0
"""Cosine of the angle of incidence on glass for sound, which does not pass glass at any angle."""
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


def lidar_rays(lidar: Lidar, bearings: NDArray[np.float64], as_built: AsBuilt) -> NDArray[np.float64]:
    """Return (n, 3) unit vectors in base_link of a lidar, as it is mounted, at bearings (n,), rad, in its frame."""
    angles = -bearings if as_built.lidar_upside_down else bearings
    flat = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    return flat @ mount_rotation(rotate_mount(lidar.mount, as_built.lidar_yaw)).T


def cone_rays(ultrasonic: Ultrasonic) -> NDArray[np.float64]:
    """Return (n, 3) unit vectors in base_link that fill the cone: one on its axis, the others in rings."""
    rays = [(1.0, 0.0, 0.0)]
    for ring in range(1, CONE_RINGS + 1):
        off_axis = ultrasonic.field_of_view / 2 * ring / CONE_RINGS
        for azimuth in np.linspace(0.0, 2.0 * math.pi, 6 * ring, endpoint=False):
            radius = math.sin(off_axis)
            rays.append((math.cos(off_axis), radius * math.cos(azimuth), radius * math.sin(azimuth)))
    return np.array(rays) @ mount_rotation(ultrasonic.mount).T


def lidar_rays_of(lidar: Lidar, as_built: AsBuilt) -> RayCaster:
    """Return the bundle of rays of a lidar's scan as it is mounted."""
    rays = lidar_rays(lidar, lidar_angles(lidar), as_built)
    return RayCaster(lidar.mount, rays, lidar.range_max + 1.0)


class RayScene(NamedTuple):
    """The solids of a world at one instant; the floor is the plane z = 0 or, if not flat, slabs among them."""

    shapes: ShapeArrays
    flat_floor: bool


class RayCaster:
    """A bundle of rays from one sensor on the robot."""

    def __init__(self, mount: Mount, rays: NDArray[np.float64], max_range: float) -> None:
        self._mount_position = np.array([mount.x, mount.y, mount.z])
        self._rays = rays
        self._max_range = max_range
        self.own_body: NDArray[np.float64] = np.full(len(rays), np.inf)
        """Distance at which the robot's own body blocks each ray, m."""

    def light(self, scene: RayScene, base: BasePose) -> NDArray[np.float64]:
        """Return (n,) distances that laser light measures, m, inf for none, with base_link at `base`.

        Light passes glass and is reflected by mirrors. Glass returns a beam that hits it at a right angle. A beam
        that a mirror reflects measures the length of the path to what it meets then.
        """
        return self._cast(scene, base, math.cos(MAX_GLASS_ANGLE))[0]

    def light_along(
        self, scene: RayScene, origin: NDArray[np.float64], rays: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (n,) distances as `light`, of other rays (n, 3) from an origin (3,), both in the world."""
        kind, centre, half, yaw, _, material = scene.shapes
        solids = kind, centre, half, yaw, material
        cosine = math.cos(MAX_GLASS_ANGLE)
        return cast_rays(solids, scene.flat_floor, origin, rays, self._max_range, cosine)[0]

    @property
    def mount_position(self) -> NDArray[np.float64]:
        """Position of the sensor in base_link (3,), m."""
        return self._mount_position

    def echoes(self, scene: RayScene, base: BasePose) -> NDArray[np.float64]:
        """Return (n,) distances to the first hit, m, for ultrasound: surfaces hit at too flat an angle give inf."""
        ranges, normals, beams = self._cast(scene, base, SOUND)
        # Cosine of the incidence angle: |n . d|.
        cos_incidence = np.abs(np.sum(normals * beams, axis=1))
        return np.where(cos_incidence > math.cos(MAX_ECHO_ANGLE), ranges, np.inf)

    def find_own_body(self, model: Any, data: Any, base: BasePose) -> None:
        """Find out where parts of the robot, in MuJoCo's model with base_link at `base`, block the rays."""
        origin, beams = self._in_world(base)
        count = len(beams)
        geom_ids, distances = np.zeros(count, dtype=np.int32), np.zeros(count)
        mujoco.mj_multiRay(
            model,
            data,
            origin,
            beams.ravel(),
            ROBOT_ONLY,
            True,
            -1,
            geom_ids,
            distances,
            None,
            count,
            self._max_range,
        )
        self.own_body = np.where(geom_ids >= 0, distances, np.inf)

    def _cast(
        self, scene: RayScene, base: BasePose, min_glass_cosine: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return distances (n,), surface normals (n, 3) and the rays in the world (n, 3)."""
        origin, beams = self._in_world(base)
        kind, centre, half, yaw, _, material = scene.shapes
        solids = kind, centre, half, yaw, material
        hits = cast_rays(solids, scene.flat_floor, origin, beams, self._max_range, min_glass_cosine)
        return *hits, beams

    def _in_world(self, base: BasePose) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        position, rotation = base
        return position + rotation @ self._mount_position, np.ascontiguousarray(self._rays @ rotation.T)


def to_rep117(ranges: NDArray[np.float64], range_min: float, range_max: float) -> NDArray[np.float32]:
    """Convert ranges to REP-117: inf where nothing is seen, -inf where something is too close to measure."""
    limited = np.where(ranges > range_max, np.inf, ranges)
    return np.where(limited < range_min, -np.inf, limited).astype(np.float32)
