"""Gyro update of the yaw increment, with fault detection against the wheels.

If gyro and wheels agree within the gate, both are used. Otherwise a healthy gyro is right and a wheel slips,
unless the gyro shows a fault: it is stuck if its readings are bit-identical, saturated at the end of its
range, reversed if it measures the opposite of the wheels, and a single reading that jumps away and back is
damaged.
"""

from __future__ import annotations

import math

import numpy as np

from chefbot.odometry.kalman_update import CHI2_GATE, forget
from chefbot.odometry.motion_model import DELTA_YAW_GYRO, GYRO_BIAS_Z, GYRO_SCALE, SIZE
from chefbot.odometry.propagation import GYRO_TIMEOUT_NS, PropagationInterval
from chefbot.odometry.readings import ImuReading
from chefbot.odometry.sensor_health import Condition, SensorMonitor, Source

MIN_GYRO_NOISE = 1e-5
"""Minimum standard deviation of a gyro rate, rad/s; a variance of zero has no inverse."""
STUCK_TURN = 0.01
"""Accumulated difference to the wheels from which a repeating gyro is stuck, rad: half a degree, or 100
ticks."""
DAMAGED_RANGE_FACTOR = 1.05
"""Factor on the gyro's range beyond which a reading is damaged rather than saturated."""
MAX_SPIKE_READINGS = 3
"""Maximum number of jumping readings in a row that are left out as a spike; a push lasts longer."""
REVERSED_TOLERANCE = 0.2
"""Relative tolerance between the turn of a reversed gyro and that of the wheels."""
REVERSED_COUNT = 5
"""Surplus of readings with the wrong sign from which the gyro counts as mounted upside down."""


def update_gyro(interval: PropagationInterval, reading: ImuReading) -> None:
    """Update the state with the gyro's rotation about z since its last reading."""
    before = interval.monitors[Source.GYRO]
    monitor = before.with_reading(reading.stamp_ns, reading.rates, STUCK_TURN)
    if not math.isinf(reading.rates_variance[2]):
        monitor = _check_and_update(interval, reading, before, monitor)
    interval.monitors[Source.GYRO] = monitor
    interval.gyro_ns = reading.stamp_ns
    interval.state, interval.covariance = forget(interval.state, interval.covariance, DELTA_YAW_GYRO)


def _check_and_update(
    interval: PropagationInterval, reading: ImuReading, before: SensorMonitor, monitor: SensorMonitor
) -> SensorMonitor:
    rate, body = reading.rates[2], interval.model
    doubted, interval.spike_candidates = interval.spike_candidates, ()
    # Saturated: the heading may have changed by the measured angle or more
    if body.gyro_range <= abs(rate) <= DAMAGED_RANGE_FACTOR * body.gyro_range:
        last_ns = reading.stamp_ns if before.last_ns is None else before.last_ns
        period = min(reading.stamp_ns - last_ns, GYRO_TIMEOUT_NS) / 1e9
        interval.inflate_heading((rate * period) ** 2)
        return monitor.with_rejected(Condition.SATURATED)
    # Damaged: faster than the robot can turn
    if not abs(rate) <= min(body.max_yaw_rate, DAMAGED_RANGE_FACTOR * body.gyro_range):  # true for NaN
        return monitor.with_rejected()
    if interval.gyro_ns is None or not 0 < reading.stamp_ns - interval.gyro_ns <= GYRO_TIMEOUT_NS:
        return monitor  # the period of the rate is unknown
    return _update_or_reject(interval, GyroRotation(interval, reading), before, monitor, doubted)


class GyroRotation:
    """A rotation measured by the gyro, with its innovation against the yaw increment `DELTA_YAW_GYRO` of the
    wheels."""

    def __init__(self, interval: PropagationInterval, reading: ImuReading) -> None:
        self.interval, self.rate = interval, reading.rates[2]
        assert interval.gyro_ns is not None
        self.period = (reading.stamp_ns - interval.gyro_ns) / 1e9
        deviation = max(math.sqrt(max(reading.rates_variance[2], 0.0)), MIN_GYRO_NOISE)
        # Measurement z = rate * T with variance R = (sigma T)^2
        self.noise = (deviation * self.period) ** 2
        self.angle = self.rate * self.period
        # h(x) = (1 + e_gain) * swing + bias * T and its Jacobian
        swing, gain = float(interval.state[DELTA_YAW_GYRO]), 1.0 + float(interval.state[GYRO_SCALE])
        self.H = np.zeros((1, SIZE))
        self.H[0, [DELTA_YAW_GYRO, GYRO_BIAS_Z, GYRO_SCALE]] = gain, self.period, swing
        self.offset, self.by_wheels = float(interval.state[GYRO_BIAS_Z]) * self.period, gain * swing

    @property
    def innovation(self) -> float:
        """Innovation y = z - h(x), rad."""
        return self.angle - self.offset - self.by_wheels

    def _innovation_variance(self) -> float:
        """Return the innovation variance S = H P H^T + R, rad^2."""
        return float(self.interval.distance(np.zeros(1), self.H, np.array([[self.noise]]))[1][0, 0])

    def excess(self, innovation: float) -> float:
        """Return the variance missing from S for the innovation to pass the gate, rad^2; negative if it
        does."""
        return innovation**2 / CHI2_GATE - self._innovation_variance()

    @property
    def mirrored(self) -> int:
        """Sign check: +1 if the gyro agrees only with the reversed wheels, -1 if only with the wheels, or 0.

        The magnitudes must agree within `REVERSED_TOLERANCE`, because a skidding robot may turn against its
        wheels by chance.
        """
        opposite = self.angle - self.offset + self.by_wheels
        fits = abs(opposite) < REVERSED_TOLERANCE * abs(self.by_wheels) and self.excess(opposite) <= 0.0
        agrees = self.excess(self.innovation) <= 0.0
        return int(fits and not agrees) - int(agrees and self.excess(opposite) > 0.0)

    def apply(self) -> None:
        """Apply the measurement update with this rotation."""
        self.interval.correct(np.array([self.innovation]), self.H, np.array([[self.noise]]))


def _update_or_reject(
    interval: PropagationInterval,
    rotation: GyroRotation,
    before: SensorMonitor,
    monitor: SensorMonitor,
    doubted: tuple[float, ...],
) -> SensorMonitor:
    # Fault detection: stuck, reversed
    monitor = monitor.with_expected_change(rotation.innovation)._replace(
        mirrored=_limit_count(monitor.mirrored + rotation.mirrored)
    )
    if monitor.fault is Condition.STUCK:
        return monitor.with_rejected()
    if monitor.mirrored >= REVERSED_COUNT:
        return monitor.with_rejected(Condition.REVERSED)
    # Outside the gate: reversed, repeating or a spike is left out; otherwise a wheel slips
    if rotation.excess(rotation.innovation) > 0.0:
        if rotation.mirrored > 0 or monitor.repeating:
            return monitor.with_rejected()
        if len(doubted) < MAX_SPIKE_READINGS and _is_jump(interval, rotation, before.value):
            interval.spike_candidates = (*doubted, rotation.innovation)
            return monitor.with_rejected()
        interval.contradicted = True
        interval.slip(rotation.innovation)
        interval.add_heading(sum(doubted))  # the readings left out before were no spike
    # Measurement update
    rotation.apply()
    return monitor.used()


def _limit_count(mirrored: int) -> int:
    return min(max(mirrored, 0), 2 * REVERSED_COUNT)


def _is_jump(interval: PropagationInterval, rotation: GyroRotation, before: tuple[float, ...]) -> bool:
    """Return whether the rate changed faster than motors, slip or a push can change it."""
    if not before:
        return False
    noise_margin = math.sqrt(2.0 * CHI2_GATE * rotation.noise) / rotation.period
    # "not <=" is true for NaN
    return (
        not abs(rotation.rate - before[2])
        <= interval.model.max_yaw_acceleration * rotation.period + noise_margin
    )
