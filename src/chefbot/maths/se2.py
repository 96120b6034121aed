"""Rigid transforms of the plane, SE(2)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap


class SE2(NamedTuple):
    """The pose of a child frame in a parent frame, metres and radians; `a @ b` composes two poses.

    `map_T_base = map_T_odom @ odom_T_base`: the child frame of the left is the parent frame of the right.
    """

    x: float
    y: float
    yaw: float

    def __matmul__(self, other: SE2) -> SE2:
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap(self.yaw + other.yaw),
        )

    def inverse(self) -> SE2:
        """Return the pose of the parent frame in the child frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap(-self.yaw))

    def between(self, other: SE2) -> SE2:
        """Return `other` relative to `self`: `self @ self.between(other) == other`."""
        return self.inverse() @ other

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points (n, 2) from the child frame to the parent frame, (n, 2)."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return points @ np.array([[c, s], [-s, c]]) + np.array([self.x, self.y])

    def distance(self, other: SE2) -> float:
        """Return the distance in metres between the origins."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def array(self) -> NDArray[np.float64]:
        """Return (x, y, yaw) as an array (3,)."""
        return np.array(self, dtype=np.float64)

    @property
    def text(self) -> str:
        """The pose as people read it."""
        x, y, yaw = (round(value, 2) + 0.0 for value in self)  # no -0.00
        return f"x {x:.2f} m, y {y:.2f} m, yaw {yaw:.2f} rad"

    @staticmethod
    def of(values: Iterable[float]) -> SE2:
        """Create a pose from any three numbers x, y, yaw."""
        x, y, yaw = values
        return SE2(float(x), float(y), float(yaw))


IDENTITY = SE2(0.0, 0.0, 0.0)
