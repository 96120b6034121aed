"""Ranges by rays through MuJoCo's world: lidar and ultrasonic ranger."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.mjcf import LOOKS_GROUP
from chefbot.robot.geometry.shapes import rotation
from chefbot.robot.section import Mount
from chefbot.robot.sensors import Lidar, Ultrasonic

WORLD_ONLY = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
"""Geom groups that rays see: the robot's own are not among them."""
OWN_BODY = np.array([group == LOOKS_GROUP for group in range(6)], dtype=np.uint8)
"""The robot's parts as they are built, the sensors' housings left out."""
CONE_RINGS = 4
FLATTEST_ECHO = math.radians(60.0)
"""Angle off a surface's normal from which sound is mirrored away; so a ranger does not see the floor."""
ULTRASONIC_NOISE = 0.003  # m, standard deviation of an HC-SR04's reading


def mount_rotation(mount: Mount) -> NDArray[np.float64]:
    """(3, 3) from the sensor's frame to base_link."""
    return rotation(mount.pitch, mount.yaw)


def lidar_angles(lidar: Lidar) -> NDArray[np.float64]:
    """(beams,) bearings in the lidar's frame, from -pi on in equal steps; the last is one step before pi."""
    return -math.pi + 2.0 * math.pi / lidar.beams * np.arange(lidar.beams, dtype=np.float64)


def turned(mount: Mount, yaw: float) -> Mount:
    """A mount that looks `yaw` rad further to the left."""
    return msgspec.structs.replace(mount, yaw=mount.yaw + yaw)


def lidar_rays(lidar: Lidar, mount: Mount | None = None) -> NDArray[np.float64]:
    """(beams, 3) unit vectors in base_link; `mount`: as it is mounted, where that is not as drawn."""
    angles = lidar_angles(lidar)
    flat = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    return flat @ mount_rotation(mount or lidar.mount).T


def cone_rays(ultrasonic: Ultrasonic) -> NDArray[np.float64]:
    """(n, 3) unit vectors in base_link that fill the cone: one in the middle, the others in rings."""
    rays = [(1.0, 0.0, 0.0)]
    for ring in range(1, CONE_RINGS + 1):
        off_axis = ultrasonic.field_of_view / 2 * ring / CONE_RINGS
        for turn in np.linspace(0.0, 2.0 * math.pi, 6 * ring, endpoint=False):
            side = math.sin(off_axis)
            rays.append((math.cos(off_axis), side * math.cos(turn), side * math.sin(turn)))
    return np.array(rays) @ mount_rotation(ultrasonic.mount).T


class RayCaster:
    """One bundle of rays from a sensor on the robot."""

    def __init__(self, mount: Mount, rays: NDArray[np.float64], reach: float) -> None:
        self._at = np.array([mount.x, mount.y, mount.z])
        self._rays = rays
        self._reach = reach
        self._hit = np.zeros(len(rays), dtype=np.int32)
        self._distance = np.zeros(len(rays))
        self._normal = np.zeros(3 * len(rays))
        self.own_body: NDArray[np.float64] = np.full(len(rays), np.inf)

    def look_at_own_body(
        self, model: Any, data: Any, position: NDArray[np.float64], rotation: NDArray[np.float64]
    ) -> None:
        """Find once how far each ray gets before it ends at a part of the robot."""
        self.own_body = self.cast(model, data, position, rotation, OWN_BODY)

    def cast(
        self,
        model: Any,
        data: Any,
        position: NDArray[np.float64],
        rotation: NDArray[np.float64],
        groups: NDArray[np.uint8] = WORLD_ONLY,
    ) -> NDArray[np.float64]:
        """(n,) metres to the first hit, inf for none, with base_link at `position` turned by `rotation`."""
        origin = position + rotation @ self._at
        vectors = np.ascontiguousarray(self._rays @ rotation.T).ravel()
        count = len(self._rays)
        mujoco.mj_multiRay(
            model, data, origin, vectors, groups, True, -1,
            self._hit, self._distance, self._normal, count, self._reach,
        )  # fmt: skip
        return np.where(self._hit >= 0, self._distance, np.inf)

    def echoes(
        self, model: Any, data: Any, position: NDArray[np.float64], rotation: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """`cast` for sound: a surface that it strikes too flatly throws it away from the sensor, inf."""
        ranges = self.cast(model, data, position, rotation)
        upright = np.abs(np.sum(self._normal.reshape(-1, 3) * (self._rays @ rotation.T), axis=1))
        return np.where(upright > math.cos(FLATTEST_ECHO), ranges, np.inf)


def within(ranges: NDArray[np.float64], range_min: float, range_max: float) -> NDArray[np.float32]:
    """Ranges as REP-117 wants them: inf for nothing seen, -inf for too close to measure."""
    far = np.where(ranges > range_max, np.inf, ranges)
    return np.where(far < range_min, -np.inf, far).astype(np.float32)
