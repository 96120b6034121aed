"""The pose and twist that the odometry publishes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.motion_model import DELTA_S, DELTA_YAW, PITCH, ROLL, YAW, Array, X, Y, Z


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


def estimate_of(belief: FilterState) -> MotionEstimate:
    """Return pose and twist with their covariances from a belief."""
    state, dt = belief.state.tolist(), belief.interval or 1.0
    covariance, twist_covariance = _covariances(belief.covariance, dt)
    return MotionEstimate(
        SE2(state[X], state[Y], wrap(state[YAW])),
        covariance,
        state[DELTA_S] / dt,
        state[DELTA_YAW] / dt,
        twist_covariance,
        state[Z],
        state[ROLL],
        state[PITCH],
    )


@njit(cache=True, nogil=True)
def _covariances(covariance: Array, dt: float) -> tuple[Array, Array]:
    """Return those of x, y and yaw (3, 3), and of the mean speed and yaw rate over dt seconds (2, 2)."""
    pose, twist = np.empty((3, 3)), np.empty((2, 2))
    for i, row in enumerate((X, Y, YAW)):
        for j, column in enumerate((X, Y, YAW)):
            pose[i, j] = covariance[row, column]
    for i, row in enumerate((DELTA_S, DELTA_YAW)):
        for j, column in enumerate((DELTA_S, DELTA_YAW)):
            twist[i, j] = covariance[row, column] / dt**2
    return pose, twist
