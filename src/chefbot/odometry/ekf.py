"""Wheels, gyro, accelerometer and matched scans together: an extended Kalman filter.

Wheels know that they stand, a gyro knows that it turns. A wheel slips and its diameter is a little wrong, a
gyro has an offset; each sees the fault of the other. At standstill the offset shows itself: the zero-velocity
update (Foxlin 2005) is the ordinary update with wheels that are sure. The accelerometer feels the slope that
the robot stands on, which tells how much of the way leads ahead and how much up.

The wheels drive the motion model and are not one measurement among others: counters lose nothing between two
readings, whatever comes late or never. It needs no guess of how the robot may accelerate, which filters of
free bodies do (Moore & Stouch 2014, "A generalized extended Kalman filter implementation for the Robot
Operating System").
"""

from __future__ import annotations

from functools import partial

import numpy as np

from chefbot.errors import UserError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.drive_model import Body
from chefbot.odometry.estimate import MotionEstimate, estimate_of
from chefbot.odometry.filter_state import Belief
from chefbot.odometry.fusion import blind, fold
from chefbot.odometry.motion_model import YAW, X, Y
from chefbot.odometry.out_of_sequence import History
from chefbot.odometry.readings import ImuReading, PoseReading, Reading, WheelCounts, WheelTwist
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.odometry.wheel_travel import Counters

HORIZON_NS = 1_000_000_000
"""So late a reading may come: longer than matching a scan takes, and short enough to work it all in again."""
LATE_NS = 50_000_000
"""Who lags behind the others by more than this is late."""
FARTHEST_STEP = 100.0
"""Metres that no robot drives between two readings."""
STEPPED_BACK = 5
"""So many readings of the wheels in a row, all too late, say that the clock was set back."""
LOST_NS = {
    Source.WHEELS: 300_000_000,
    Source.GYRO: 200_000_000,
    Source.ACCELEROMETER: 200_000_000,
    Source.ATTITUDE: 300_000_000,
    Source.SCANS: 2_000_000_000,
}
"""Without a reading for so long a source is lost: a few of its periods. The estimate goes without it at once."""


class Ekf:
    """Odometry from stamped readings in any order of arrival, if none is later than `HORIZON_NS`.

    A source that falls silent, sticks, saturates or is reversed is left out, its `condition` says so, and the
    covariance grows by what it no longer tells.
    """

    def __init__(self, body: Body, start: SE2 = IDENTITY) -> None:
        belief = Belief.begin(body)
        belief.state[[X, Y, YAW]] = start
        self._body, self._lag_ns = body, dict.fromkeys(Source, 0)
        self._history: History[Belief] = History(partial(fold, body), belief, HORIZON_NS)
        self._too_late = self._back = 0

    def add(self, reading: Reading) -> bool:
        """Work in a reading; False if it was too late or here already.

        UserError for a reading after which the robot would be nowhere, or far from where it was; it is left out.
        """
        newest = self._history.newest_ns
        lag = 0 if newest is None else max(newest - reading.stamp_ns, 0)
        for source in _sources(reading):
            self._lag_ns[source] = lag
        too_late = lag >= HORIZON_NS
        self._too_late += too_late
        if isinstance(reading, WheelCounts | WheelTwist):
            self._back = self._back + 1 if too_late else 0
            if self._back >= STEPPED_BACK:
                self._begin_anew(reading.stamp_ns)
        before = self.belief
        added = self._history.add(reading)
        if not _is_near(before, self.belief):
            self._leave_out(before)
            raise UserError(
                f"a reading of {_sources(reading)[0].name.lower()} takes the odometry out of any place"
            )
        return added

    def _leave_out(self, before: Belief) -> None:
        """Go on from the belief before, without what waits to be used; the wheels are counted afresh."""
        belief = before._replace(pending=(), counters=Counters(), gyro_ns=None, doubted=(), tilting=None)
        self._history = History(partial(fold, self._body), belief, HORIZON_NS)

    def _begin_anew(self, stamp_ns: int) -> None:
        """Go on from the same belief on a clock that was set back; the counters have lost nothing."""
        pace = self.belief.pace
        missed_ns = round(STEPPED_BACK * pace.dt * 1e9) if pace else 1
        belief = self.belief._replace(
            stamp_ns=stamp_ns - missed_ns, pending=(), gyro_ns=None, doubted=(), tilting=None
        )
        self._history = History(partial(fold, self._body), belief, HORIZON_NS)
        self._back, self._lag_ns = 0, dict.fromkeys(Source, 0)

    @property
    def belief(self) -> Belief:
        """All that is known after the newest reading."""
        return self._history.latest

    @property
    def estimate(self) -> MotionEstimate:
        """At the last reading of the wheels."""
        return estimate_of(self.belief)

    def at(self, stamp_ns: int) -> MotionEstimate:
        """At an instant up to which the wheels have said nothing: no travel, the turn by the gyro.

        The covariance grows by what the wheels may have done.
        """
        return estimate_of(blind(self._body, self.belief, stamp_ns))

    @property
    def too_late(self) -> int:
        """Readings so far that came too late to be used."""
        return self._too_late

    def condition(self, source: Source, now_ns: int) -> Condition:
        """How a source is at an instant on the clock of the stamps."""
        watch = self.belief.watches[source]
        last = max([r.stamp_ns for r in self.belief.pending if source in _sources(r)], default=watch.last_ns)
        if last is None:
            return Condition.ABSENT
        if now_ns - last > LOST_NS[source]:
            return Condition.LOST
        if watch.flaw is not Condition.FRESH:
            return watch.flaw
        return Condition.LATE if self._lag_ns[source] > LATE_NS else Condition.FRESH

    def silent_for(self, source: Source, now_ns: int) -> float:
        """Seconds since its last reading went into the estimate; infinite if none ever did."""
        used = self.belief.watches[source].used_ns
        return float("inf") if used is None else (now_ns - used) / 1e9

    @property
    def slipping(self) -> bool:
        """Whether wheels and gyro contradicted each other at last."""
        return self.belief.contradicted_ns is not None


def _is_near(before: Belief, after: Belief) -> bool:
    """Whether the robot can have come from one to the other between two readings, and both are numbers."""
    finite = np.isfinite(after.state).all() and np.isfinite(after.covariance).all()
    return bool(finite and np.abs(after.state[[X, Y]] - before.state[[X, Y]]).max() < FARTHEST_STEP)


def _sources(reading: Reading) -> tuple[Source, ...]:
    if isinstance(reading, ImuReading):
        told = (
            (Source.GYRO, reading.rates_variance),
            (Source.ACCELEROMETER, reading.force_variance),
            (Source.ATTITUDE, reading.attitude_variance),
        )
        return tuple(source for source, variance in told if min(variance) != float("inf"))
    return (Source.SCANS,) if isinstance(reading, PoseReading) else (Source.WHEELS,)
