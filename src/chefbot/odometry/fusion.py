"""Sequential sensor fusion: the pure function that applies one reading to a belief."""

from __future__ import annotations

import numpy as np
from numba import njit

from chefbot.errors import OdometryError
from chefbot.odometry.drive_model import DriveModel, FilterParameters
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.measurement_updates import update_imu
from chefbot.odometry.motion_model import Array
from chefbot.odometry.propagation import begin_interval, end_interval, move_to
from chefbot.odometry.readings import IMU, ImuReading, Reading, WheelCounts, WheelTwist
from chefbot.odometry.sensor_health import NEVER_NS, Records
from chefbot.odometry.wheel_travel import (
    EncoderState,
    WheelTravel,
    travel_from_counts,
    travel_from_twist,
    unknown_travel,
    with_encoder_ambiguity,
)

BRIDGE_NS = 10_000_000_000
"""Longest gap in the wheel readings that a counter difference or a twist bridges, ns; after it the distance
travelled is unknown."""


def process_reading(body: DriveModel, belief: FilterState, reading: Reading) -> FilterState:
    """Return the belief after a reading; readings must be sorted by `readings.order`.

    Readings between two wheel readings are kept until the second one, which gives the motion of the robot.
    """
    if isinstance(reading, ImuReading):
        belief = _after_gap(body, belief, reading.stamp_ns)
        return belief._replace(pending=(*belief.pending, reading))
    return _process_wheels(body, belief, reading)


def _after_gap(body: DriveModel, belief: FilterState, stamp_ns: int) -> FilterState:
    if belief.stamp_ns is None or stamp_ns - belief.stamp_ns <= BRIDGE_NS:
        return belief
    counters = without_counts(belief.counters)
    return predict_without_wheels(body, belief, stamp_ns)._replace(counters=counters)


def predict_without_wheels(body: DriveModel, belief: FilterState, stamp_ns: int) -> FilterState:
    """Return the belief propagated to a stamp without wheel readings.

    The mean stays, except for the rotation measured by the gyro; the covariance grows by the distance that
    the wheels can have travelled.
    """
    if belief.stamp_ns is None or stamp_ns <= belief.stamp_ns:
        return belief
    dt_ns = stamp_ns - belief.stamp_ns
    return _propagate(body, belief, unknown_travel(body, dt_ns / 1e9), stamp_ns, belief.counters)


def without_counts(counters: EncoderState) -> EncoderState:
    """Return the counters as after a gap: without counts to subtract, but with the number of restarts."""
    return EncoderState(restarts=counters.restarts)


def _process_wheels(body: DriveModel, belief: FilterState, reading: WheelCounts | WheelTwist) -> FilterState:
    stamp_ns = reading.stamp_ns
    belief = _after_gap(body, belief._replace(wheels_ns=stamp_ns), stamp_ns)
    if belief.stamp_ns is None:
        return _initialise(belief, reading)
    if isinstance(reading, WheelTwist):
        if stamp_ns == belief.stamp_ns:
            return belief  # a duplicate
        rolled = travel_from_twist(body, reading, (stamp_ns - belief.stamp_ns) / 1e9)
        return _propagate(body, belief, rolled, stamp_ns, belief.counters)
    # First counts after a long gap: no travel can be computed from them
    if belief.counters.counts is None:
        propagated = predict_without_wheels(body, belief, stamp_ns)
        return propagated._replace(counters=belief.counters._replace(counts=(reading.left, reading.right)))
    if stamp_ns == belief.stamp_ns:
        return belief
    # Wheel travel from the counter differences
    counters, rolled = travel_from_counts(body, belief.counters, reading, stamp_ns - belief.stamp_ns)
    if belief.dead_encoder_side is not None:
        ticks = (
            counters.other_wheel_ticks[belief.dead_encoder_side]
            - belief.counters.other_wheel_ticks[belief.dead_encoder_side]
        )
        rolled = with_encoder_ambiguity(
            body, rolled, belief.counters.other_wheel_ticks[belief.dead_encoder_side], max(ticks, 0)
        )
    return _propagate(body, belief, rolled, stamp_ns, counters)


def _initialise(belief: FilterState, reading: WheelCounts | WheelTwist) -> FilterState:
    """Set the origin of odom at the first wheel reading; discard the readings before it."""
    counts = (reading.left, reading.right) if isinstance(reading, WheelCounts) else None
    counters = belief.counters._replace(counts=counts)
    timed = belief.with_gyro_since(reading.stamp_ns if belief.pending else NEVER_NS)
    return timed._replace(stamp_ns=reading.stamp_ns, counters=counters, pending=())


@njit(cache=True, nogil=True)
def propagate(
    state: Array,
    covariance: Array,
    monitors: Records,
    memory: Records,
    body: FilterParameters,
    rolled: WheelTravel,
    begin_ns: int,
    end_ns: int,
    standing: bool,
    readings: Records,
) -> tuple[Array, Array, Records, Records]:
    """Return state (n,), covariance (n, n), monitors (3,) and memory (1,) after an interval between wheel readings.

    body: parameters of the drive. rolled: travel of the wheels from begin_ns to end_ns > begin_ns. standing:
    whether the encoders show standstill. readings: records (m,) of type `IMU`, in order of their stamps.
    """
    interval = begin_interval(state, covariance, monitors, memory, body, rolled, begin_ns, end_ns, standing)
    # Prediction to each pending reading and its measurement update, in order of the stamps
    for i in range(readings.size):
        update_imu(interval, readings[i])
    # Prediction over the remaining part of the interval
    move_to(interval, end_ns)
    end_interval(interval)
    return interval.state, interval.covariance, interval.monitors, interval.memory


def _propagate(
    body: DriveModel, belief: FilterState, rolled: WheelTravel, stamp_ns: int, counters: EncoderState
) -> FilterState:
    if belief.stamp_ns is None:
        raise OdometryError("the belief has no stamp to propagate from")
    before = belief.state, belief.covariance, belief.monitor_records, belief.memory
    stamps, readings = (belief.stamp_ns, stamp_ns), np.array(list(belief.pending), IMU)
    state, covariance, monitors, memory = propagate(
        *before, body.parameters, rolled, *stamps, counters.standing, readings
    )
    after = FilterState(state, covariance, monitors, memory, stamp_ns, belief.wheels_ns, counters)
    # An encoder fault is assumed only if the gyro contradicts the wheels as well
    silent_wheel = counters.dead_encoder_side
    if silent_wheel is None or not (after.contradicted or belief.dead_encoder_side == silent_wheel):
        return after
    return after._replace(dead_encoder_side=silent_wheel)
