"""What odometry says about a step, and how far it may be wrong."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.params import GmappingParams


class Step:
    """The motion since the last processed scan, and the way it took."""

    def __init__(self) -> None:
        self.motion = IDENTITY
        self.travel = 0.0
        """Metres driven, forth and back."""
        self.rotation = 0.0
        """Radians turned, left and right."""

    def add(self, part: SE2) -> None:
        """Go on by `part`, seen from the pose reached so far."""
        self.motion = self.motion @ part
        self.travel += math.hypot(part.x, part.y)
        self.rotation += abs(part.yaw)

    def variance(self, params: GmappingParams) -> NDArray[np.float64]:
        """Of the error along x, y (m^2) and in heading (rad^2), as drawn by gmapping's motion model.

        Standard deviations grow linearly with travel and rotation; a third as much sideways as along.
        """
        p, t, r = params, self.travel, self.rotation
        ahead, aside = abs(self.motion.x), abs(self.motion.y)
        wander = t - math.hypot(ahead, aside)
        sideways = 0.3 * p.srr
        sd = [
            p.srr * (ahead + wander) + p.str * r + sideways * aside,
            p.srr * (aside + wander) + p.str * r + sideways * ahead,
            p.stt * r + p.srt * t,
        ]
        least = np.array([p.least_shift, p.least_shift, p.least_turn])
        return np.square(sd) + np.square(least)


def compose(poses: NDArray[np.float64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """poses (p, 3) each moved by its step (p, 3) or by one step (3,); headings are not wrapped."""
    steps = np.broadcast_to(steps, poses.shape)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack(
        [
            poses[:, 0] + c * steps[:, 0] - s * steps[:, 1],
            poses[:, 1] + s * steps[:, 0] + c * steps[:, 1],
            poses[:, 2] + steps[:, 2],
        ]
    )
