"""The true pose and twist of the simulated robot."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2


class GroundTruth(NamedTuple):
    """Ground truth: pose of base_link in the world and twist, m/s forward and rad/s to the left."""

    pose: SE2
    v: float
    w: float


def ground_truth(qpos: NDArray[np.float64], qvel: NDArray[np.float64]) -> GroundTruth:
    """Return the ground truth from MuJoCo's state, which begins with the robot's free joint."""
    x, y, _, qw, qx, qy, qz = qpos[:7].tolist()
    # Yaw from the quaternion; forward speed from the world-frame velocity.
    yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    vx, vy = qvel[:2].tolist()
    return GroundTruth(SE2(x, y, yaw), vx * math.cos(yaw) + vy * math.sin(yaw), float(qvel[5]))
