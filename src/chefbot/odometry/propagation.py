"""The way between two readings of the wheels, cut where something else was sensed."""

from __future__ import annotations

import math

import numpy as np

from chefbot.odometry.drive_model import Body
from chefbot.odometry.filter_state import Belief, Pace
from chefbot.odometry.kalman_update import ALL, GATE, Flags, correct, distance, forget
from chefbot.odometry.motion_model import (
    BIAS_X,
    BIAS_Y,
    BIAS_Z,
    INPUTS,
    SIZE,
    STEP,
    TURN,
    YAW,
    Array,
    predict,
)
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.odometry.wheel_travel import Rolled

GYRO_TIMEOUT_NS = 100_000_000
"""A reading of the gyro says nothing of a longer time before or after it."""
SETTLING = 1.0
"""Seconds in which a driving robot without a gyro meets another slope: a tile or two at walking pace."""
PATIENCE = {Source.ATTITUDE: 5, Source.SCANS: 5, Source.ACCELEROMETER: 50}
"""Who is refused so many times in a row has the right to be heard: then the estimate is what is wrong. The
accelerometer tells the attitude only by the way, and a push lasts longer than an outlier."""

NOTHING = 25.0
"""Squared standard deviations of a slipping wheel in units of what it is known to have slipped: so uncertain
that its contradiction is no surprise, and draws nothing with it that was estimated from better days."""


def selecting(states: tuple[int, ...]) -> Array:
    """H (m, n) of a reading that tells these states themselves."""
    H = np.zeros((len(states), SIZE))
    H[range(len(states)), states] = 1.0
    return H


class Leg:
    """Works a stretch of `dt_ns` > 0 into a belief; the wheels went at steady speeds, `rolled` in all."""

    def __init__(self, body: Body, belief: Belief, rolled: Rolled, dt_ns: int, standing: bool) -> None:
        if belief.stamp_ns is None:
            raise ValueError("a way needs a beginning")
        self.body, self.last, self.standing = body, belief.pace, standing
        self.watches = dict(belief.watches)
        self.gyro_ns, self.doubted, self.tilting = belief.gyro_ns, belief.doubted, belief.tilting
        self.contradicted = False
        self._rolled, self._dt, self._now_ns = rolled, dt_ns / 1e9, belief.stamp_ns
        turn = (rolled.right - rolled.left) / body.separation
        self.pace = Pace(0.5 * (rolled.left + rolled.right) / self._dt, turn / self._dt, self._dt)
        self.state, self.covariance = forget(*forget(belief.state, belief.covariance, STEP), TURN)
        for bias in (BIAS_X, BIAS_Y, BIAS_Z):
            self.covariance[bias, bias] += body.gyro_bias_walk**2 * self._dt
        self._before, self._seconds = (self.state, self.covariance), 0.0

    @property
    def speed_variance(self) -> float:
        """Of the mean speed by the wheels, (m/s)^2."""
        rolled = self._rolled
        return 0.25 * (rolled.variance_left + rolled.variance_right + 2.0 * rolled.shared) / self._dt**2

    def move_to(self, stamp_ns: int) -> None:
        """Go on to this instant by the wheels."""
        self._before, self._seconds = (self.state, self.covariance), 0.0
        if stamp_ns <= self._now_ns:
            return
        if self.tilting is not None and stamp_ns - self.tilting.stamp_ns > GYRO_TIMEOUT_NS:
            self.tilting = None
        self._seconds, self._now_ns = (stamp_ns - self._now_ns) / 1e9, stamp_ns
        self.state, self.covariance = self._predicted(0.0)
        self._stir()

    def slip(self, error: float) -> None:
        """Go the last part again with wheels whose turn, `error` rad off, says nothing.

        Which of the two slipped is open, so the step is off by half of that to either side.
        """
        self.state, self.covariance = self._predicted(error * self.body.separation)

    def _predicted(self, slip: float) -> tuple[Array, Array]:
        """After the last part of the way, on which one of the wheels slipped by `slip` metres."""
        seconds, settling, by_gyro, angles = self._seconds, 0.0, 0.0, np.zeros(2)
        share, noise = seconds / self._dt, self._noise(slip)
        if self.tilting is not None:
            by_gyro, angles = seconds, np.array(self.tilting.rates[:2]) * seconds
            noise[2, 2], noise[3, 3] = (v * seconds**2 for v in self.tilting.rates_variance[:2])
        elif not self.standing:
            settling = 1.0 - math.exp(-seconds / SETTLING)
        rims = np.array([self._rolled.left, self._rolled.right]) * share
        road = (self.body.separation, settling, self.body.tilt)
        return predict(*self._before, rims, angles, by_gyro, noise, *road)

    def _noise(self, slip: float) -> Array:
        """Covariance (6, 6) of the inputs of `predict` over the last part of the way, as far as wheels go."""
        rolled, share = self._rolled, self._seconds / self._dt
        noise = np.zeros((INPUTS, INPUTS))
        step, turn = 0.25 * slip**2, NOTHING * slip**2
        noise[0, 0] = rolled.variance_left * share + step + turn
        noise[1, 1] = rolled.variance_right * share + step + turn
        noise[0, 1] = noise[1, 0] = rolled.shared * share + step - turn
        noise[4, 4] = noise[5, 5] = rolled.slide * share
        return noise

    def _stir(self) -> None:
        """Tell the watches what the wheels did in the last part, which other sensors have to show."""
        gathered = (self.pace.speed - self.last.speed) / self._dt if self.last else 0.0
        amounts = {
            Source.ATTITUDE: self.pace.turn,
            Source.ACCELEROMETER: gathered,
            Source.SCANS: self.pace.speed,
        }
        for source, rate in amounts.items():
            if self.watches[source].repeating:
                self.watches[source] = self.watches[source].stirred(rate * self._seconds)

    def correct(self, error: Array, H: Array, noise: Array, open_: Flags = ALL) -> None:
        """Believe a reading that is `error` (m,) off what H (m, n) linearises, with covariance `noise`.

        It may change the elements `open_` (n,) of the state.
        """
        self.state, self.covariance = correct(self.state, self.covariance, error, H, noise, open_)

    def distance(self, error: Array, H: Array, noise: Array) -> tuple[float, Array]:
        """Squared Mahalanobis distance of that reading, and the covariance (m, m) of its error."""
        return distance(self.covariance, error, H, noise)

    def weigh(
        self,
        source: Source,
        error: Array,
        H: Array,
        noise: Array,
        wrong: tuple[int, ...],
        open_: Flags = ALL,
    ) -> None:
        """`correct` if the reading can be believed; `wrong` are the states (m,) to blame if it lasts."""
        watch = self.watches[source]
        self.watches[source] = watch.left_out()
        if watch.flaw is Condition.STUCK or not np.isfinite(error).all():
            return
        far, total = self.distance(error, H, noise)
        if far > GATE:
            if watch.refused_run < PATIENCE[source]:
                return
            self._loosen(H[:, list(wrong)], total * (far / GATE), wrong)
        self.correct(error, H, noise, open_)
        self.watches[source] = watch.used()

    def _loosen(self, by_wrong: Array, wanted: Array, wrong: tuple[int, ...]) -> None:
        """Grow the covariance until a lasting contradiction is one of sqrt(GATE) standard deviations."""
        inverse = np.linalg.inv(by_wrong)
        self.covariance = self.covariance.copy()
        self.covariance[np.ix_(wrong, wrong)] += inverse @ wanted @ inverse.T

    def turn_more(self, angle: float) -> None:
        """The heading changed by so much more than the wheels said."""
        self.state = self.state.copy()
        self.state[[YAW, TURN]] += angle

    def blur(self, variance: float) -> None:
        """The heading may have changed by more than anything tells, with this variance, rad^2."""
        self.covariance = self.covariance.copy()
        for i in (YAW, TURN):
            for j in (YAW, TURN):
                self.covariance[i, j] += variance
