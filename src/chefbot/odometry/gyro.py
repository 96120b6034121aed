"""Gyro update of the yaw increment, with fault detection against the wheels.

If gyro and wheels agree within the gate, both are used. Otherwise a healthy gyro is right and a wheel slips,
unless the gyro shows a fault: it is stuck if its readings are bit-identical, saturated at the end of its
range, reversed if it measures the opposite of the wheels, and a single reading that jumps away and back is
damaged. A contact makes rates jump and oppose the wheels as well, for fewer readings than a reversed gyro; the
heading follows them, and is corrected when the gyro turns out to be reversed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from chefbot.odometry.kalman_update import ALL, CHI2_GATE, forget, innovation_covariance
from chefbot.odometry.motion_model import DELTA_YAW_GYRO, GYRO_BIAS_Z, GYRO_SCALE, SIZE, Array
from chefbot.odometry.propagation import (
    GYRO_TIMEOUT_NS,
    PropagationInterval,
    add_heading,
    apply_update,
    inflate_heading,
    slip,
)
from chefbot.odometry.sensor_health import (
    GYRO,
    NEVER_NS,
    REVERSED,
    SATURATED,
    STUCK,
    Record,
    note_fault,
    note_reading,
    note_rejection,
    note_use,
)

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


@njit(cache=True, nogil=True)
def update_gyro(interval: PropagationInterval, reading: Record) -> None:
    """Update the state with the gyro's rotation about z since its last reading, a record of type `IMU`."""
    monitor = interval.monitors[GYRO]
    last_ns, last_rate = monitor["last_ns"], monitor["value"][2]
    note_reading(monitor, reading["stamp_ns"], reading["rates"], STUCK_TURN)
    if not math.isinf(reading["rates_variance"][2]):
        _check_and_update(interval, reading, last_ns, last_rate)
    interval.memory[0]["gyro_ns"] = reading["stamp_ns"]
    interval.state[:], interval.covariance[:] = forget(interval.state, interval.covariance, DELTA_YAW_GYRO)


@njit(cache=True, nogil=True)
def _check_and_update(interval: PropagationInterval, reading: Record, last_ns: int, last_rate: float) -> None:
    """Update with a reading, or reject it; last_ns, last_rate: stamp and rate of the one before."""
    rate, stamp_ns, body = reading["rates"][2], reading["stamp_ns"], interval.body
    monitor, memory = interval.monitors[GYRO], interval.memory[0]
    spikes, spike_angle = memory["spikes"], memory["spike_angle"]
    memory["spikes"], memory["spike_angle"] = 0, 0.0
    # Saturated: the heading may have changed by the measured angle or more
    if body.gyro_range <= abs(rate) <= DAMAGED_RANGE_FACTOR * body.gyro_range:
        period = 0.0 if last_ns == NEVER_NS else min(stamp_ns - last_ns, GYRO_TIMEOUT_NS) / 1e9
        inflate_heading(interval, (rate * period) ** 2)
        note_fault(monitor, SATURATED)
        return
    # Damaged: faster than the robot can turn
    if not abs(rate) <= min(body.max_yaw_rate, DAMAGED_RANGE_FACTOR * body.gyro_range):  # true for NaN
        note_rejection(monitor)
        return
    if memory["gyro_ns"] == NEVER_NS or not 0 < stamp_ns - memory["gyro_ns"] <= GYRO_TIMEOUT_NS:
        return  # the period of the rate is unknown
    rotation = gyro_rotation(interval, reading)
    is_jump = last_ns != NEVER_NS and _is_jump(body.max_yaw_acceleration, rotation, last_rate)
    _update_or_reject(interval, rotation, is_jump, spikes, spike_angle)


class GyroRotation(NamedTuple):
    """A rotation measured by the gyro, with its innovation against the yaw increment of the wheels."""

    rate: float
    period: float
    noise: float
    """Variance R of the measured angle, rad^2."""
    unbiased: float
    """Measured angle without the gyro's bias, rad."""
    by_wheels: float
    """Angle by the yaw increment `DELTA_YAW_GYRO` of the wheels, as the gyro would measure it, rad."""
    innovation: float
    """y = z - h(x), rad."""
    H: Array
    """Jacobian (1, n)."""
    variance: float
    """Innovation variance S = H P H^T + R, rad^2."""


@njit(cache=True, nogil=True)
def gyro_rotation(interval: PropagationInterval, reading: Record) -> GyroRotation:
    """Return the rotation since the gyro's last reading."""
    state, rate, H = interval.state, reading["rates"][2], np.zeros((1, SIZE))
    period = (reading["stamp_ns"] - interval.memory[0]["gyro_ns"]) / 1e9
    deviation = max(math.sqrt(max(reading["rates_variance"][2], 0.0)), MIN_GYRO_NOISE)
    # Measurement z = rate * T with variance R = (sigma T)^2
    noise = (deviation * period) ** 2
    # h(x) = (1 + e_gain) * swing + bias * T and its Jacobian
    swing, gain = state[DELTA_YAW_GYRO], 1.0 + state[GYRO_SCALE]
    H[0, DELTA_YAW_GYRO], H[0, GYRO_BIAS_Z], H[0, GYRO_SCALE] = gain, period, swing
    unbiased, by_wheels = rate * period - state[GYRO_BIAS_Z] * period, gain * swing
    # S = H P H^T + R
    S = innovation_covariance(interval.covariance, H, np.array([[noise]]))[1]
    return GyroRotation(rate, period, noise, unbiased, by_wheels, unbiased - by_wheels, H, S[0, 0])


@njit(cache=True, nogil=True)
def _excess(rotation: GyroRotation, innovation: float) -> float:
    """Return the variance missing from S for an innovation to pass the gate, rad^2; negative if it does."""
    return innovation**2 / CHI2_GATE - rotation.variance


@njit(cache=True, nogil=True)
def _mirrored(rotation: GyroRotation) -> int:
    """Return +1 if the gyro agrees only with the reversed wheels, -1 if only with the wheels, or 0.

    The magnitudes must agree within `REVERSED_TOLERANCE`, because a skidding robot may turn against its
    wheels by chance.
    """
    opposite = rotation.unbiased + rotation.by_wheels
    similar = abs(opposite) < REVERSED_TOLERANCE * abs(rotation.by_wheels)
    fits, agrees = (
        similar and _excess(rotation, opposite) <= 0.0,
        _excess(rotation, rotation.innovation) <= 0.0,
    )
    return int(fits and not agrees) - int(agrees and _excess(rotation, opposite) > 0.0)


@njit(cache=True, nogil=True)
def _update_or_reject(
    interval: PropagationInterval, rotation: GyroRotation, is_jump: bool, spikes: int, spike_angle: float
) -> None:
    """Update with a rotation, unless the gyro is at fault; spikes: number and sum of the innovations before."""
    monitor, memory, mirrored = interval.monitors[GYRO], interval.memory[0], _mirrored(rotation)
    # Fault detection: stuck, reversed
    monitor["expected_change"] += rotation.innovation
    monitor["mirrored"] = min(max(monitor["mirrored"] + mirrored, -REVERSED_COUNT), 2 * REVERSED_COUNT)
    if mirrored < 0:
        memory["mirrored_angle"] = 0.0
    if monitor["fault"] == STUCK:
        note_rejection(monitor)
        return
    if monitor["mirrored"] >= REVERSED_COUNT:
        # What seemed to be slip was the gyro's sign
        add_heading(interval, -memory["mirrored_angle"])
        memory["mirrored_angle"] = 0.0
        note_fault(monitor, REVERSED)
        return
    # Outside the gate: repeating or a spike is left out; otherwise a wheel slips
    if _excess(rotation, rotation.innovation) > 0.0:
        if monitor["repeats"] > 0:
            note_rejection(monitor)
            return
        if spikes < MAX_SPIKE_READINGS and is_jump:
            memory["spikes"], memory["spike_angle"] = spikes + 1, spike_angle + rotation.innovation
            note_rejection(monitor)
            return
        interval.part[0]["contradicted"] = True
        slip(interval, rotation.innovation)
        memory["mirrored_angle"] += rotation.innovation if mirrored > 0 else 0.0
        add_heading(interval, spike_angle)  # the readings left out before were not a spike
    elif not is_jump:
        add_heading(interval, spike_angle)  # nor were they if this one agrees with them
    # Measurement update
    apply_update(interval, np.array([rotation.innovation]), rotation.H, np.array([[rotation.noise]]), ALL)
    note_use(monitor)


@njit(cache=True, nogil=True)
def _is_jump(max_yaw_acceleration: float, rotation: GyroRotation, last_rate: float) -> bool:
    """Return whether the rate changed faster than motors, slip or a push can change it."""
    noise_margin = math.sqrt(2.0 * CHI2_GATE * rotation.noise) / rotation.period
    # "not <=" is true for NaN
    return not abs(rotation.rate - last_rate) <= max_yaw_acceleration * rotation.period + noise_margin
