"""Pose tracking of a sensor by its own scans, accurate enough to return to a place."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import SE2
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams

TRACKER_PARAMS = GmappingParams(
    particles=1, linear_update=0.0, angular_update=0.0, sigma=0.03, iterations=8, independent_beams=100.0,
    odometry_noise=OdometryNoise(
        translation_from_translation=0.02, translation_from_rotation=0.003,
        rotation_from_translation=0.01, rotation_from_rotation=0.02,
    ),
    min_translation_noise=0.002, min_rotation_noise=0.001,
)  # fmt: skip
"""One particle, every scan, small steps: the room is small and odometry errors between scans are small."""


class ScanTracker:
    """Tracks the pose of a sensor in its own frame at the first scan; its mount on the robot is not needed."""

    def __init__(self, max_range: float) -> None:
        self._slam = Gmapping(msgspec.structs.replace(TRACKER_PARAMS, max_range=max_range))

    def add(self, angles: NDArray[np.float32], ranges: NDArray[np.float32], moved: SE2, limit: float) -> SE2:
        """Return the sensor's pose at a scan.

        moved: the sensor's pose by odometry. limit: ranges from here on (m) count as no return.
        """
        self._slam.update(angles, ranges, moved, limit)
        return self._slam.pose
