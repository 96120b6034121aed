"""Sequential sensor fusion: the pure function that applies one reading to a belief."""

from __future__ import annotations

from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.measurement_updates import update_imu
from chefbot.odometry.propagation import PropagationInterval
from chefbot.odometry.readings import Reading, WheelCounts, WheelTwist
from chefbot.odometry.sensor_health import Source
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
    if isinstance(reading, WheelCounts | WheelTwist):
        return _process_wheels(body, belief, reading)
    belief = _after_gap(body, belief, reading.stamp_ns)
    return belief._replace(pending=(*belief.pending, reading))


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
    watches = dict(belief.monitors)
    values = tuple(float(v) for v in reading[1:3])
    watches[Source.WHEELS] = watches[Source.WHEELS].with_reading(stamp_ns, values, float("inf")).used()
    belief = _after_gap(body, belief._replace(monitors=watches), stamp_ns)
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
    gyro_ns = reading.stamp_ns if belief.pending else None
    return belief._replace(stamp_ns=reading.stamp_ns, counters=counters, pending=(), gyro_ns=gyro_ns)


def _propagate(
    body: DriveModel, belief: FilterState, rolled: WheelTravel, stamp_ns: int, counters: EncoderState
) -> FilterState:
    assert belief.stamp_ns is not None
    interval = PropagationInterval(body, belief, rolled, stamp_ns - belief.stamp_ns, counters.standing)
    # Prediction to each pending reading and its measurement update, in order of the stamps
    for reading in belief.pending:
        update_imu(interval, reading)
    # Prediction over the remaining part of the interval
    interval.move_to(stamp_ns)
    since = belief.contradicted_ns if belief.contradicted_ns is not None else stamp_ns
    # An encoder fault is assumed only if the gyro contradicts the wheels as well
    silent_wheel = counters.dead_encoder_side
    encoder_fault = silent_wheel is not None and (
        interval.contradicted or belief.dead_encoder_side == silent_wheel
    )
    return belief._replace(
        state=interval.state,
        covariance=interval.covariance,
        stamp_ns=stamp_ns,
        counters=counters,
        pending=(),
        velocity=interval.velocity,
        gyro_ns=interval.gyro_ns,
        spike_candidates=interval.spike_candidates,
        tilt_reading=interval.tilt_reading,
        monitors=interval.monitors,
        contradicted_ns=since if interval.contradicted else None,
        dead_encoder_side=silent_wheel if encoder_fault else None,
    )
