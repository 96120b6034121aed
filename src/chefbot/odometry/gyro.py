"""The gyro against the wheels: who is right about a turn?

They agree within what chance explains: both are used. They do not: a live gyro is right and a wheel slips,
unless the gyro gives itself away. It is stuck if it says the same to the last bit, saturated at the end of
its range, reversed if it says the opposite of the wheels, and one reading that jumps away and back is damaged.
"""

from __future__ import annotations

import math

import numpy as np

from chefbot.odometry.kalman_update import GATE, forget
from chefbot.odometry.motion_model import BIAS_Z, GAIN, SIZE, SWING
from chefbot.odometry.propagation import GYRO_TIMEOUT_NS, Leg
from chefbot.odometry.readings import ImuReading
from chefbot.odometry.sensor_health import Condition, Source, Watch

LEAST_GYRO_NOISE = 1e-5
"""rad/s; no gyro is finer, and a variance of zero has no inverse."""
STUCK_TURN = 0.01
"""rad by which wheels and equal readings may differ in sum: half a degree, or a hundred ticks."""
RAIL = 1.05
"""A reading beyond so many times the range was never measured."""
JUMPS = 3
"""So many readings in a row may jump before they are believed: a spike is shorter, a push longer."""
ALIKE = 0.2
"""Share by which a reversed gyro's turn may differ from the wheels'."""
MIRRORED = 5
"""So many turns with the wrong sign more than with the right one, and the gyro is mounted upside down."""


def hear_gyro(leg: Leg, reading: ImuReading) -> None:
    """The turn about z since the last reading."""
    before = leg.watches[Source.GYRO]
    watch = before.heard(reading.stamp_ns, reading.rates, STUCK_TURN)
    if not math.isinf(reading.rates_variance[2]):
        watch = _weigh(leg, reading, before, watch)
    leg.watches[Source.GYRO] = watch
    leg.gyro_ns = reading.stamp_ns
    leg.state, leg.covariance = forget(leg.state, leg.covariance, SWING)


def _weigh(leg: Leg, reading: ImuReading, before: Watch, watch: Watch) -> Watch:
    rate, body = reading.rates[2], leg.body
    doubted, leg.doubted = leg.doubted, ()
    if body.gyro_range <= abs(rate) <= RAIL * body.gyro_range:
        period = min(reading.stamp_ns - (before.last_ns or reading.stamp_ns), GYRO_TIMEOUT_NS) / 1e9
        leg.blur((rate * period) ** 2)  # it turned by that, or by more
        return watch.left_out(Condition.SATURATED)
    if not abs(rate) <= min(body.fastest_turn, RAIL * body.gyro_range):  # true for NaN
        return watch.left_out()
    if leg.gyro_ns is None or not 0 < reading.stamp_ns - leg.gyro_ns <= GYRO_TIMEOUT_NS:
        return watch  # it cannot say since when the robot turns so
    return _compare(leg, Turned(leg, reading), before, watch, doubted)


class Turned:
    """A turn as the gyro has it, and how far that is from the wheels' turn `SWING`."""

    def __init__(self, leg: Leg, reading: ImuReading) -> None:
        self.leg, self.rate = leg, reading.rates[2]
        assert leg.gyro_ns is not None
        self.period = (reading.stamp_ns - leg.gyro_ns) / 1e9
        deviation = max(math.sqrt(max(reading.rates_variance[2], 0.0)), LEAST_GYRO_NOISE)
        self.noise = (deviation * self.period) ** 2
        self.angle = self.rate * self.period
        swing, gain = float(leg.state[SWING]), 1.0 + float(leg.state[GAIN])
        self.H = np.zeros((1, SIZE))
        self.H[0, [SWING, BIAS_Z, GAIN]] = gain, self.period, swing
        self.offset, self.by_wheels = float(leg.state[BIAS_Z]) * self.period, gain * swing

    @property
    def error(self) -> float:
        """Beyond what is expected: (1 + gain error) * turn + offset * period."""
        return self.angle - self.offset - self.by_wheels

    def _expected(self) -> float:
        """Variance of `error`."""
        return float(self.leg.distance(np.zeros(1), self.H, np.array([[self.noise]]))[1][0, 0])

    def excess(self, error: float) -> float:
        """How much more variance of the wheels' turn would explain this error, rad^2; negative for none."""
        return error**2 / GATE - self._expected()

    @property
    def mirrored(self) -> int:
        """+1 if only its sign contradicts the wheels, -1 if it agrees with them and not with the opposite.

        The size has to fit within `ALIKE`, for a skidding robot may turn against its wheels by chance.
        """
        opposite = self.angle - self.offset + self.by_wheels
        fits = abs(opposite) < ALIKE * abs(self.by_wheels) and self.excess(opposite) <= 0.0
        agrees = self.excess(self.error) <= 0.0
        return int(fits and not agrees) - int(agrees and self.excess(opposite) > 0.0)

    def believe(self) -> None:
        """Correct the wheels by it."""
        self.leg.correct(np.array([self.error]), self.H, np.array([[self.noise]]))


def _compare(leg: Leg, turned: Turned, before: Watch, watch: Watch, doubted: tuple[float, ...]) -> Watch:
    watch = watch.stirred(turned.error)._replace(mirrored=_count(watch.mirrored + turned.mirrored))
    if watch.flaw is Condition.STUCK:
        return watch.left_out()
    if watch.mirrored >= MIRRORED:
        return watch.left_out(Condition.REVERSED)
    if turned.excess(turned.error) > 0.0:
        if turned.mirrored > 0 or watch.repeating:
            return watch.left_out()
        if len(doubted) < JUMPS and _jumped(leg, turned, before.value):
            leg.doubted = (*doubted, turned.error)
            return watch.left_out()
        leg.contradicted = True
        leg.slip(turned.error)
        leg.turn_more(sum(doubted))  # it was no spike
    turned.believe()
    return watch.used()


def _count(mirrored: int) -> int:
    return min(max(mirrored, 0), 2 * MIRRORED)


def _jumped(leg: Leg, turned: Turned, before: tuple[float, ...]) -> bool:
    """Whether no motor, slip or push changes a turn so fast."""
    if not before:
        return False
    chance = math.sqrt(2.0 * GATE * turned.noise) / turned.period
    return not abs(turned.rate - before[2]) <= leg.body.hardest_turn * turned.period + chance  # true for NaN
