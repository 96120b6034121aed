"""One reading after the other into a belief: the pure function that the filter is."""

from __future__ import annotations

from chefbot.odometry.drive_model import Body
from chefbot.odometry.filter_state import Belief
from chefbot.odometry.measurement_updates import hear_imu, hear_pose
from chefbot.odometry.propagation import Leg
from chefbot.odometry.readings import ImuReading, Reading, WheelCounts, WheelTwist
from chefbot.odometry.sensor_health import Source
from chefbot.odometry.wheel_travel import Counters, Rolled, ambiguous, count, of_twist, unknown

BRIDGE_NS = 10_000_000_000
"""Counters that come back within so long tell what the wheels did meanwhile; later nobody knows who moved."""


def fold(body: Body, belief: Belief, reading: Reading) -> Belief:
    """The belief after a reading; readings must come in `readings.order`.

    What is sensed between two readings of the wheels waits for the second one, which says how the robot moved.
    """
    if isinstance(reading, WheelCounts | WheelTwist):
        return _on_wheels(body, belief, reading)
    if belief.stamp_ns is not None and reading.stamp_ns - belief.stamp_ns > BRIDGE_NS:
        belief = blind(body, belief, reading.stamp_ns)._replace(counters=_nothing(belief.counters))
    return belief._replace(pending=(*belief.pending, reading))


def blind(body: Body, belief: Belief, stamp_ns: int) -> Belief:
    """The belief at an instant up to which the wheels have said nothing.

    The mean stays where it was, but for the turn that the gyro tells, and the covariance grows by how far the
    wheels can have gone.
    """
    if belief.stamp_ns is None or stamp_ns <= belief.stamp_ns:
        return belief
    dt_ns = stamp_ns - belief.stamp_ns
    return _go(body, belief, unknown(body, dt_ns / 1e9), stamp_ns, belief.counters)


def _nothing(counters: Counters) -> Counters:
    return Counters(restarts=counters.restarts)


def _on_wheels(body: Body, belief: Belief, reading: WheelCounts | WheelTwist) -> Belief:
    stamp_ns = reading.stamp_ns
    watches = dict(belief.watches)
    values = tuple(float(v) for v in reading[1:3])
    watches[Source.WHEELS] = watches[Source.WHEELS].heard(stamp_ns, values, float("inf")).used()
    belief = belief._replace(watches=watches)
    if belief.stamp_ns is None:
        return _begin(belief, reading)
    if isinstance(reading, WheelTwist):
        if stamp_ns == belief.stamp_ns:
            return belief  # told twice
        rolled = of_twist(body, reading, (stamp_ns - belief.stamp_ns) / 1e9)
        return _go(body, belief, rolled, stamp_ns, belief.counters)
    if belief.counters.counts is None:  # back after a long silence
        since = blind(body, belief, stamp_ns)
        return since._replace(counters=belief.counters._replace(counts=(reading.left, reading.right)))
    if stamp_ns == belief.stamp_ns:
        return belief
    counters, rolled = count(body, belief.counters, reading, stamp_ns - belief.stamp_ns)
    if belief.silent_side is not None:
        ticks = counters.alone[belief.silent_side] - belief.counters.alone[belief.silent_side]
        rolled = ambiguous(body, rolled, belief.counters.alone[belief.silent_side], max(ticks, 0))
    return _go(body, belief, rolled, stamp_ns, counters)


def _begin(belief: Belief, reading: WheelCounts | WheelTwist) -> Belief:
    """The first reading of the wheels is where odom begins; what was sensed before says nothing of it."""
    counts = (reading.left, reading.right) if isinstance(reading, WheelCounts) else None
    counters = belief.counters._replace(counts=counts)
    started = [r.stamp_ns for r in belief.pending if isinstance(r, ImuReading)]
    gyro_ns = reading.stamp_ns if started else None
    return belief._replace(stamp_ns=reading.stamp_ns, counters=counters, pending=(), gyro_ns=gyro_ns)


def _go(body: Body, belief: Belief, rolled: Rolled, stamp_ns: int, counters: Counters) -> Belief:
    assert belief.stamp_ns is not None
    leg = Leg(body, belief, rolled, stamp_ns - belief.stamp_ns, counters.standing)
    for reading in belief.pending:
        if isinstance(reading, ImuReading):
            hear_imu(leg, reading)
        else:
            hear_pose(leg, reading)
    leg.move_to(stamp_ns)
    since = belief.contradicted_ns if belief.contradicted_ns is not None else stamp_ns
    silent = counters.silent_side
    doubtful = silent is not None and (leg.contradicted or belief.silent_side == silent)
    return belief._replace(
        state=leg.state,
        covariance=leg.covariance,
        stamp_ns=stamp_ns,
        counters=counters,
        pending=(),
        pace=leg.pace,
        gyro_ns=leg.gyro_ns,
        doubted=leg.doubted,
        tilting=leg.tilting,
        watches=leg.watches,
        contradicted_ns=since if leg.contradicted else None,
        silent_side=silent if doubtful else None,
    )
