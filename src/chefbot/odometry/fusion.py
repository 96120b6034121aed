"""Sequential sensor fusion: the pure function that applies one reading to a belief."""

from __future__ import annotations

from chefbot.odometry.drive_model import Body
from chefbot.odometry.filter_state import Belief
from chefbot.odometry.measurement_updates import hear_imu, hear_pose
from chefbot.odometry.propagation import Leg
from chefbot.odometry.readings import ImuReading, Reading, WheelCounts, WheelTwist
from chefbot.odometry.sensor_health import Source
from chefbot.odometry.wheel_travel import Counters, Rolled, ambiguous, count, of_twist, unknown

BRIDGE_NS = 10_000_000_000
"""Longest gap in the wheel readings that the counter difference bridges, ns; after it the counts are
discarded."""


def fold(body: Body, belief: Belief, reading: Reading) -> Belief:
    """Return the belief after a reading; readings must be sorted by `readings.order`.

    Readings between two wheel readings are kept until the second one, which gives the motion of the robot.
    """
    if isinstance(reading, WheelCounts | WheelTwist):
        return _process_wheels(body, belief, reading)
    if belief.stamp_ns is not None and reading.stamp_ns - belief.stamp_ns > BRIDGE_NS:
        belief = blind(body, belief, reading.stamp_ns)._replace(counters=_without_counts(belief.counters))
    return belief._replace(pending=(*belief.pending, reading))


def blind(body: Body, belief: Belief, stamp_ns: int) -> Belief:
    """Return the belief propagated to a stamp without wheel readings.

    The mean stays, except for the rotation measured by the gyro; the covariance grows by the distance that
    the wheels can have travelled.
    """
    if belief.stamp_ns is None or stamp_ns <= belief.stamp_ns:
        return belief
    dt_ns = stamp_ns - belief.stamp_ns
    return _propagate(body, belief, unknown(body, dt_ns / 1e9), stamp_ns, belief.counters)


def _without_counts(counters: Counters) -> Counters:
    return Counters(restarts=counters.restarts)


def _process_wheels(body: Body, belief: Belief, reading: WheelCounts | WheelTwist) -> Belief:
    stamp_ns = reading.stamp_ns
    watches = dict(belief.watches)
    values = tuple(float(v) for v in reading[1:3])
    watches[Source.WHEELS] = watches[Source.WHEELS].heard(stamp_ns, values, float("inf")).used()
    belief = belief._replace(watches=watches)
    if belief.stamp_ns is None:
        return _initialise(belief, reading)
    if isinstance(reading, WheelTwist):
        if stamp_ns == belief.stamp_ns:
            return belief  # a duplicate
        rolled = of_twist(body, reading, (stamp_ns - belief.stamp_ns) / 1e9)
        return _propagate(body, belief, rolled, stamp_ns, belief.counters)
    # First counts after a long gap: no travel can be computed from them
    if belief.counters.counts is None:
        propagated = blind(body, belief, stamp_ns)
        return propagated._replace(counters=belief.counters._replace(counts=(reading.left, reading.right)))
    if stamp_ns == belief.stamp_ns:
        return belief
    # Wheel travel from the counter differences
    counters, rolled = count(body, belief.counters, reading, stamp_ns - belief.stamp_ns)
    if belief.silent_side is not None:
        ticks = counters.alone[belief.silent_side] - belief.counters.alone[belief.silent_side]
        rolled = ambiguous(body, rolled, belief.counters.alone[belief.silent_side], max(ticks, 0))
    return _propagate(body, belief, rolled, stamp_ns, counters)


def _initialise(belief: Belief, reading: WheelCounts | WheelTwist) -> Belief:
    """Set the origin of odom at the first wheel reading; discard the readings before it."""
    counts = (reading.left, reading.right) if isinstance(reading, WheelCounts) else None
    counters = belief.counters._replace(counts=counts)
    imu_stamps = [r.stamp_ns for r in belief.pending if isinstance(r, ImuReading)]
    gyro_ns = reading.stamp_ns if imu_stamps else None
    return belief._replace(stamp_ns=reading.stamp_ns, counters=counters, pending=(), gyro_ns=gyro_ns)


def _propagate(body: Body, belief: Belief, rolled: Rolled, stamp_ns: int, counters: Counters) -> Belief:
    assert belief.stamp_ns is not None
    interval = Leg(body, belief, rolled, stamp_ns - belief.stamp_ns, counters.standing)
    # Prediction to each pending reading and its measurement update, in order of the stamps
    for reading in belief.pending:
        if isinstance(reading, ImuReading):
            hear_imu(interval, reading)
        else:
            hear_pose(interval, reading)
    # Prediction over the remaining part of the interval
    interval.move_to(stamp_ns)
    since = belief.contradicted_ns if belief.contradicted_ns is not None else stamp_ns
    # An encoder fault is assumed only if the gyro contradicts the wheels as well
    silent_wheel = counters.silent_side
    encoder_fault = silent_wheel is not None and (interval.contradicted or belief.silent_side == silent_wheel)
    return belief._replace(
        state=interval.state,
        covariance=interval.covariance,
        stamp_ns=stamp_ns,
        counters=counters,
        pending=(),
        pace=interval.pace,
        gyro_ns=interval.gyro_ns,
        doubted=interval.doubted,
        tilting=interval.tilting,
        watches=interval.watches,
        contradicted_ns=since if interval.contradicted else None,
        silent_side=silent_wheel if encoder_fault else None,
    )
