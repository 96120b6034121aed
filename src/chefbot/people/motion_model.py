"""The Kalman filter of one person: constant velocity with white noise acceleration.

Bar-Shalom, Li and Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", section 6.2.2; Thrun,
Burgard and Fox 2005, "Probabilistic Robotics", section 3.2. Measurement noise is the same in all directions, so x and
y share one covariance and have no correlation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MIN_VARIANCE = 1e-8
"""Lower bound of a variance, so that rounding cannot make a covariance singular."""


class MotionState(NamedTuple):
    """Mean and covariance of position (m) and velocity (m/s) in the tracking frame.

    variance: of x and of y, m^2. cross: covariance of x and vx, and of y and vy, m^2/s. speed_variance: of vx and of
    vy, m^2/s^2.
    """

    x: float
    y: float
    vx: float
    vy: float
    variance: float
    cross: float
    speed_variance: float

    @property
    def speed(self) -> float:
        """Speed of the mean, m/s."""
        return math.hypot(self.vx, self.vy)

    @property
    def deviation(self) -> float:
        """Standard deviation of the position along each axis, m."""
        return math.sqrt(self.variance)

    def covariance(self) -> NDArray[np.float64]:
        """Return the covariance of x, y, vx, vy, (4, 4)."""
        block = np.array([[self.variance, self.cross], [self.cross, self.speed_variance]])
        return np.kron(block, np.eye(2))

    def distance(self, x: float, y: float) -> float:
        """Return the distance of the mean from a point, m."""
        return math.hypot(self.x - x, self.y - y)


def propagate(state: MotionState, seconds: float, density: float, decay: float = math.inf) -> MotionState:
    """Return the state `seconds` later, at least 0.

    density: power spectral density of the acceleration, m^2/s^3. decay: time constant with which the velocity goes to
    zero, s; inf for constant velocity.
    """
    t = max(seconds, 0.0)
    # transition [[1, a], [0, f]] of each axis
    f = 1.0 if math.isinf(decay) else math.exp(-t / decay)
    a = t if math.isinf(decay) else decay * (1.0 - f)
    p, c, q = state.variance, state.cross, state.speed_variance
    return MotionState(
        state.x + a * state.vx,
        state.y + a * state.vy,
        f * state.vx,
        f * state.vy,
        p + 2.0 * a * c + a * a * q + density * t**3 / 3.0,
        f * (c + a * q) + density * t * t / 2.0,
        f * f * q + density * t,
    )


def measurement_update(state: MotionState, x: float, y: float, variance: float) -> MotionState:
    """Return the state after a measurement of the position with this variance of each axis, m^2, above 0."""
    innovation = state.variance + variance
    gain, speed_gain = state.variance / innovation, state.cross / innovation
    dx, dy = x - state.x, y - state.y
    # (I - K H) P, with 1 - K written without cancellation
    rest = variance / innovation
    return MotionState(
        state.x + gain * dx,
        state.y + gain * dy,
        state.vx + speed_gain * dx,
        state.vy + speed_gain * dy,
        max(rest * state.variance, MIN_VARIANCE),
        rest * state.cross,
        max(state.speed_variance - speed_gain * state.cross, MIN_VARIANCE),
    )
