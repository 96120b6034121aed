"""The pose and twist that the odometry publishes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.motion_model import DELTA_S, DELTA_YAW, PITCH, ROLL, YAW, X, Y, Z


@dataclass(frozen=True, eq=False)
class MotionEstimate:
    """The estimated pose and twist of the axle midpoint in odom, with covariances.

    pose: odom_T_base seen from above, metres and radians.
    covariance: (3, 3) of (x, y, yaw), m^2, m rad, rad^2.
    v, w: mean forward speed (m/s) and mean yaw rate (rad/s) over the last step, in base_link.
    twist_covariance: (2, 2) of (v, w).
    height, roll, pitch: the remaining coordinates of the pose, m and rad; zero on a level floor.
    """

    pose: SE2
    covariance: NDArray[np.float64]
    v: float
    w: float
    twist_covariance: NDArray[np.float64]
    height: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0


_PLANE = np.ix_([X, Y, YAW], [X, Y, YAW])


def estimate_of(belief: FilterState) -> MotionEstimate:
    """Return pose and twist with their covariances from a belief."""
    state, covariance = belief.state, belief.covariance
    dt = belief.velocity.dt if belief.velocity else 1.0
    return MotionEstimate(
        SE2(float(state[X]), float(state[Y]), wrap(float(state[YAW]))),
        covariance[_PLANE],
        float(state[DELTA_S]) / dt,
        float(state[DELTA_YAW]) / dt,
        covariance[DELTA_S : DELTA_YAW + 1, DELTA_S : DELTA_YAW + 1] / dt**2,
        float(state[Z]),
        float(state[ROLL]),
        float(state[PITCH]),
    )
