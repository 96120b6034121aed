"""Angles in radians, counter-clockwise (REP-103)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def wrap(angle: float) -> float:
    """Normalize an angle to [-pi, pi)."""
    wrapped = (angle + math.pi) % (2.0 * math.pi) - math.pi
    return -math.pi if wrapped >= math.pi else wrapped  # the remainder may round up to the divisor


def wrap_array(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normalize every angle of an array to [-pi, pi)."""
    wrapped = (angles + np.pi) % (2.0 * np.pi) - np.pi
    return np.where(wrapped >= np.pi, -np.pi, wrapped)


def mean_angle(angles: NDArray[np.float64], weights: NDArray[np.float64] | None = None) -> float:
    """Return the circular mean of the angles (Mardia & Jupp 2000, 2.2); weights need not sum to one."""
    w = np.ones_like(angles) if weights is None else weights
    return math.atan2(float(w @ np.sin(angles)), float(w @ np.cos(angles)))
