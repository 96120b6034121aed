"""Rotation matrices by MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np


def matrix(quat: list[float]) -> np.ndarray:
    """Return the matrix (3, 3) of a quaternion w, x, y, z."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, np.array(quat))
    return rotation.reshape(3, 3)
