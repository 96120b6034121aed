"""The chapter's odometry: wheels alone."""

from __future__ import annotations

import numpy as np

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.motion import LEFT, RIGHT, SEPARATION, STEP, TURN, YAW, Array, predict
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.wheels import Wheels
from chefbot.robot.spec import Robot


def start_state(start: SE2, params: OdometryParams, size: int) -> tuple[Array, Array]:
    """State and covariance at `start`, which is exact by definition of the odom frame."""
    state = np.zeros(size)
    state[: YAW + 1] = start
    covariance = np.zeros((size, size))
    covariance[LEFT, LEFT] = covariance[RIGHT, RIGHT] = params.diameter_error**2
    covariance[SEPARATION, SEPARATION] = params.separation_error**2
    return state, covariance


def to_estimate(state: Array, covariance: Array, dt: float) -> MotionEstimate:
    """The part of state and covariance that others want; `dt` is the length of the last step, s."""
    return MotionEstimate(
        SE2(float(state[0]), float(state[1]), wrap(float(state[YAW]))),
        covariance[: YAW + 1, : YAW + 1].copy(),
        float(state[STEP]) / dt,
        float(state[TURN]) / dt,
        covariance[STEP : TURN + 1, STEP : TURN + 1] / dt**2,
    )


class DeadReckoning:
    """Pose from encoder counts. The covariance grows with distance and turning and never shrinks.

    It is of first order: once the heading is uncertain by more than some 5 degrees (5 m with wheels of 0.3 %
    error), the true positions lie on a banana longer than the ellipse is wide.

    counter_bits: width of the board's counters, which may wrap.
    """

    def __init__(
        self,
        robot: Robot,
        params: OdometryParams | None = None,
        counter_bits: int = 64,
        start: SE2 = IDENTITY,
    ) -> None:
        params = params or OdometryParams()
        self.wheels = Wheels(robot, params, counter_bits)
        self._separation = robot.wheels.separation
        self._state, self._covariance = start_state(start, params, SEPARATION + 1)

    def update(self, ticks_left: int, ticks_right: int, dt: float) -> MotionEstimate:
        """Counts as the board tells them, read `dt` > 0 seconds after those of the last call."""
        step = self.wheels.step(ticks_left, ticks_right, dt)
        variance = np.array([step.variance_left, step.variance_right])
        self._state, self._covariance = predict(
            self._state, self._covariance, step.left, step.right, variance, self._separation
        )
        return to_estimate(self._state, self._covariance, dt)
