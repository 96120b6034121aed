"""What odometry says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.odometry.filter_state import Belief
from chefbot.odometry.motion_model import PITCH, ROLL, STEP, TURN, YAW, X, Y, Z


@dataclass(frozen=True, eq=False)
class MotionEstimate:
    """Where the axle's middle is in the odom frame, how it moves, and how sure that is.

    pose: odom_T_base seen from above, metres and radians.
    covariance: (3, 3) of (x, y, yaw), m^2, m rad, rad^2.
    v, w: mean speed forward (m/s) and mean turn rate (rad/s) over the last step, in base_link.
    twist_covariance: (2, 2) of (v, w).
    height, roll, pitch: the rest of the six, m and rad; level floor gives zeros.
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


def estimate_of(belief: Belief) -> MotionEstimate:
    """The part of state and covariance that others want."""
    state, covariance = belief.state, belief.covariance
    dt = belief.pace.dt if belief.pace else 1.0
    return MotionEstimate(
        SE2(float(state[X]), float(state[Y]), wrap(float(state[YAW]))),
        covariance[_PLANE],
        float(state[STEP]) / dt,
        float(state[TURN]) / dt,
        covariance[STEP : TURN + 1, STEP : TURN + 1] / dt**2,
        float(state[Z]),
        float(state[ROLL]),
        float(state[PITCH]),
    )
