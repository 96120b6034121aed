"""The pose and twist that the odometry publishes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.motion_model import DELTA_S, DELTA_YAW, PITCH, ROLL, SIZE, YAW, X, Y, Z


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


_PLANE = SIZE * np.array([[X], [Y], [YAW]]) + np.array([X, Y, YAW])
"""Indices (3, 3) of the covariance of x, y and yaw among the elements of the whole covariance."""


def estimate_of(belief: FilterState) -> MotionEstimate:
    """Return pose and twist with their covariances from a belief."""
    state, covariance = belief.state.tolist(), belief.covariance
    dt = belief.interval or 1.0
    return MotionEstimate(
        SE2(state[X], state[Y], wrap(state[YAW])),
        covariance.take(_PLANE),
        state[DELTA_S] / dt,
        state[DELTA_YAW] / dt,
        covariance[DELTA_S : DELTA_YAW + 1, DELTA_S : DELTA_YAW + 1] / dt**2,
        state[Z],
        state[ROLL],
        state[PITCH],
    )
