"""What odometry says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2


@dataclass(frozen=True, eq=False)
class MotionEstimate:
    """Where the axle's middle is in the odom frame, how it moves, and how sure that is.

    pose: odom_T_base, metres and radians.
    covariance: (3, 3) of (x, y, yaw), m^2, m rad, rad^2.
    v, w: mean speed forward (m/s) and mean turn rate (rad/s) over the last step, in base_link.
    twist_covariance: (2, 2) of (v, w).
    """

    pose: SE2
    covariance: NDArray[np.float64]
    v: float
    w: float
    twist_covariance: NDArray[np.float64]
