"""Relative poses of many pairs at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def relative(a: Array, b: Array) -> Array:
    """Return the poses b (m, 3) in the frames of the poses a (m, 3); headings are not wrapped."""
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    dx, dy = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1]
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, b[:, 2] - a[:, 2]])


def inverted(poses: Array) -> Array:
    """Return the inverse of each pose (m, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = poses[:, 0], poses[:, 1]
    return np.column_stack([-c * x - s * y, s * x - c * y, -poses[:, 2]])
