"""The odometry motion model: the motion between two processed scans and its covariance."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import IDENTITY, SE2

LATERAL_NOISE_FACTOR = 0.3
"""Noise across the direction of travel as a fraction of that along it: `sxy` in motionmodel.cpp of
openslam_gmapping."""


STANDS, STANDS_TURNED = 0.001, 0.002
"""Motion between two scans below which the robot stands, m and rad."""


class MotionNoise(Protocol):
    """Parameters of a mapper, of which these describe the noise of odometry."""

    @property
    def odometry_noise(self) -> OdometryNoise:
        """Noise per metre and per radian."""

    @property
    def min_translation_noise(self) -> float:
        """Minimum of a step, m (standard deviation)."""

    @property
    def min_rotation_noise(self) -> float:
        """Minimum of a step, rad (standard deviation)."""


class UpdateThresholds(Protocol):
    """Parameters of a mapper, of which these say after how much motion it processes a scan."""

    @property
    def linear_update(self) -> float:
        """Travel after which it does, m."""

    @property
    def angular_update(self) -> float:
        """Rotation after which it does, rad."""

    @property
    def standing_update(self) -> float:
        """Share of these that is enough where the robot stands."""


class OdometryStep:
    """The motion since the last processed scan, and the length of the path it took."""

    def __init__(self) -> None:
        self.motion = self._newest = IDENTITY
        self.travel = 0.0
        """Path length in m, back and forth added up."""
        self.rotation = 0.0
        """Total rotation in rad, left and right added up."""

    def add(self, part: SE2) -> None:
        """Append a motion given in the frame of the pose reached so far."""
        self.motion, self._newest = self.motion @ part, part
        self.travel += math.hypot(part.x, part.y)
        self.rotation += abs(part.yaw)

    def is_enough(self, thresholds: UpdateThresholds) -> bool:
        """Return whether the next scan is to be processed."""
        stands = math.hypot(self._newest.x, self._newest.y) < STANDS and abs(self._newest.yaw) < STANDS_TURNED
        share = thresholds.standing_update if stands else 1.0
        distance, angle = math.hypot(self.motion.x, self.motion.y), abs(self.motion.yaw)
        return distance >= share * thresholds.linear_update or angle >= share * thresholds.angular_update

    def variance(self, params: MotionNoise) -> NDArray[np.float64]:
        """Return the variances (3,) of the error in x, y (m^2) and heading (rad^2).

        As in gmapping's motion model, standard deviations grow linearly with travel and rotation; errors
        across the direction of travel are LATERAL_NOISE_FACTOR times those along it.
        """
        noise, t, r = params.odometry_noise, self.travel, self.rotation
        forward, lateral = abs(self.motion.x), abs(self.motion.y)
        # Path length in excess of the net displacement: it adds error in both directions
        detour = t - math.hypot(forward, lateral)
        lateral_noise = LATERAL_NOISE_FACTOR * noise.translation_from_translation
        std = [
            noise.translation_from_translation * (forward + detour)
            + noise.translation_from_rotation * r
            + lateral_noise * lateral,
            noise.translation_from_translation * (lateral + detour)
            + noise.translation_from_rotation * r
            + lateral_noise * forward,
            noise.rotation_from_rotation * r + noise.rotation_from_translation * t,
        ]
        # Minimum noise, since the stamps of scan and odometry differ
        min_xy, min_yaw = params.min_translation_noise, params.min_rotation_noise
        min_std = np.array([min_xy, min_xy, min_yaw])
        return np.square(std) + np.square(min_std)


def compose(poses: NDArray[np.float64], motions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compose poses (p, 3) with motions (p, 3) or one motion (3,); headings are not wrapped."""
    motions = np.broadcast_to(motions, poses.shape)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    # x' = x + R(yaw) dx
    return np.column_stack(
        [
            poses[:, 0] + c * motions[:, 0] - s * motions[:, 1],
            poses[:, 1] + s * motions[:, 0] + c * motions[:, 1],
            poses[:, 2] + motions[:, 2],
        ]
    )
