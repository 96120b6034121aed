"""Rotation matrices as MuJoCo calculates them."""

from __future__ import annotations

import mujoco
import numpy as np


def matrix(quat: list[float]) -> np.ndarray:
    """(3, 3) of w, x, y, z."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, np.array(quat))
    return turn.reshape(3, 3)
