"""Extended Kalman filter over wheels, gyro, accelerometer and attitude.

Wheels measure standstill well, a gyro measures rotation well. A wheel slips and has a diameter error, a gyro
has a bias; each makes the error of the other observable. At standstill the bias is observed directly: the
zero-velocity update (Foxlin 2005) is the ordinary update with wheels of zero variance. The accelerometer
measures the slope under the robot, which splits the travel into a horizontal and a vertical part.

The wheels are the input of the motion model and not one measurement among others: counters lose nothing
between two readings, even if readings are late or lost. No assumption about the robot's acceleration is
needed, unlike in filters of free bodies (Moore & Stouch 2014, "A generalized extended Kalman filter
implementation for the Robot Operating System").
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit

from chefbot.errors import OdometryError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.estimate import MotionEstimate, estimate_of
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.fusion import predict_without_wheels, process_reading, without_counts
from chefbot.odometry.motion_model import PITCH, ROLL, YAW, Array, X, Y
from chefbot.odometry.out_of_sequence import History
from chefbot.odometry.readings import ImuReading, Reading
from chefbot.odometry.sensor_health import IMU_SOURCES, Condition, Source
from chefbot.odometry.tilt_detector import TiltDetector

HORIZON_NS = 1_000_000_000
"""Maximum delay of a reading, ns: longer than any transport takes, and short enough to reprocess."""
LATE_NS = 50_000_000
"""Lag behind the newest reading from which a source counts as late, ns."""
MAX_STEP = 100.0
"""Maximum plausible distance between two readings, and growth of its standard deviation, m."""
MAX_ROUNDING = 1e-9
"""Amount by which a variance may be below zero by rounding, in its own unit."""
CLOCK_RESET_READINGS = 5
"""Number of consecutive wheel readings beyond the horizon from which the clock counts as set back."""
LOST_NS = {
    Source.WHEELS: 300_000_000,
    Source.GYRO: 200_000_000,
    Source.ACCELEROMETER: 200_000_000,
    Source.ATTITUDE: 300_000_000,
}
"""Timeout of each source, ns, a few of its periods. The estimate continues without the source immediately."""
MAX_SLOPE = math.radians(60.0)
"""Roll or pitch that no robot on a floor has, rad; near 90 degrees the Euler angles are singular."""
LEVEL_NS = 500_000_000
"""Minimum age of the belief of an upright robot to which the filter returns, ns: a fall begins after it."""
SET_UPRIGHT = 1.0
"""Standard deviation of where a robot is set upright that has tipped over, along x and y, m."""
_WHEELS = (Source.WHEELS,)


class Ekf:
    """An extended Kalman filter for odometry that accepts stamped readings in any order within `HORIZON_NS`.

    A source that is lost, stuck, saturated or reversed is left out, `condition` reports it, and the
    covariance grows accordingly. So is the IMU of a robot that has tipped over, until it stands upright: the model is
    that of a robot on a floor. Nobody knows its heading then, and the biases are those from before.
    """

    def __init__(self, body: DriveModel, start: SE2 = IDENTITY) -> None:
        belief = FilterState.initial(body)
        belief.state[[X, Y, YAW]] = start
        self._body, self._lag_ns = body, dict.fromkeys(Source, 0)
        self._history: History[FilterState] = History(partial(process_reading, body), belief, HORIZON_NS)
        self._too_late = self._late_in_a_row = 0
        self._tilt, self._level, self._newest_level = TiltDetector(), belief, belief

    def add(self, reading: Reading) -> bool:
        """Process a reading; return False if it was too late, a duplicate, or the IMU's of a tilted robot.

        Raise OdometryError for a reading that makes the pose infinite, or moves it or its standard deviation
        implausibly far; it is left out.
        """
        newest = self._history.newest_ns
        lag = 0 if newest is None else max(newest - reading.stamp_ns, 0)
        sources = _sources(reading)
        for source in sources:
            self._lag_ns[source] = lag
        # Several wheel readings beyond the horizon: the clock was set back
        too_late = lag >= HORIZON_NS
        self._too_late += too_late
        if not isinstance(reading, ImuReading):
            self._late_in_a_row = self._late_in_a_row + 1 if too_late else 0
            if self._late_in_a_row >= CLOCK_RESET_READINGS:
                self._restart_clock(reading.stamp_ns)
        if isinstance(reading, ImuReading) and self._is_tilted_at(reading):
            return False
        # Insert the reading at its stamp and reprocess the later ones
        before = self.belief
        added = self._history.add(reading)
        after = self.belief
        if not _is_plausible(before.state, before.covariance, after.state, after.covariance):
            self._revert_to(before)
            raise OdometryError(
                f"a reading of {sources[0].name.lower()} makes the odometry diverge; it is left out"
            )
        if np.abs(after.state[[ROLL, PITCH]]).max() > MAX_SLOPE:
            self._continue_level()
        return added

    def _is_tilted_at(self, reading: ImuReading) -> bool:
        if self._tilt.process(reading):
            self._continue_level()
        elif self._tilt.upright and abs(reading.stamp_ns - (self._newest_level.stamp_ns or 0)) > LEVEL_NS:
            self._level, self._newest_level = self._newest_level, self.belief
        return self._tilt.tilted

    def _continue_level(self) -> None:
        """Continue from where the robot is, with the attitude, biases and wheel errors of when it last was upright.

        It may be set upright with any heading, somewhere near.
        """
        state, covariance = self._level.state.copy(), self._level.covariance.copy()
        state[[X, Y, YAW]] = self.belief.state[[X, Y, YAW]]
        for i, deviation in ((X, SET_UPRIGHT), (Y, SET_UPRIGHT), (YAW, math.pi)):
            covariance[i], covariance[:, i] = 0.0, 0.0
            covariance[i, i] = max(self.belief.covariance[i, i], deviation**2)
        self._revert_to(self.belief._replace(state=state, covariance=covariance))

    def _revert_to(self, before: FilterState) -> None:
        """Return to the belief before a reading, without pending readings or counts; the number of restarts stays."""
        belief = before.without_readings()._replace(counters=without_counts(before.counters))
        self._history = History(partial(process_reading, self._body), belief, HORIZON_NS)

    def _restart_clock(self, stamp_ns: int) -> None:
        """Continue from the same belief on a clock that was set back; the counters stay valid."""
        pace = self.belief.velocity
        missed_ns = round(CLOCK_RESET_READINGS * pace.dt * 1e9) if pace else 1
        belief = self.belief.without_readings()._replace(stamp_ns=stamp_ns - missed_ns)
        self._history = History(partial(process_reading, self._body), belief, HORIZON_NS)
        self._late_in_a_row, self._lag_ns = 0, dict.fromkeys(Source, 0)

    @property
    def belief(self) -> FilterState:
        """Belief after the newest reading."""
        return self._history.latest

    @property
    def estimate(self) -> MotionEstimate:
        """Estimate at the last wheel reading."""
        return estimate_of(self.belief)

    def at(self, stamp_ns: int) -> MotionEstimate:
        """Return the estimate at a stamp after the last wheel reading: no travel, rotation by the gyro.

        The covariance grows by the possible travel of the wheels.
        """
        return estimate_of(predict_without_wheels(self._body, self.belief, stamp_ns))

    @property
    def too_late(self) -> int:
        """Number of readings that came too late to be used."""
        return self._too_late

    def condition(self, source: Source, now_ns: int) -> Condition:
        """Return the condition of a source at a time on the clock of the stamps."""
        watch = self.belief.monitors[source]
        last = max([r.stamp_ns for r in self.belief.pending if source in _sources(r)], default=watch.last_ns)
        if last is None:
            return Condition.ABSENT
        if now_ns - last > LOST_NS[source]:
            return Condition.LOST
        if watch.fault is not Condition.FRESH:
            return watch.fault
        return Condition.LATE if self._lag_ns[source] > LATE_NS else Condition.FRESH

    def time_since_used(self, source: Source, now_ns: int) -> float:
        """Return the time since the last used reading of a source, s; infinite if none was used."""
        used = self.belief.monitors[source].used_ns
        return float("inf") if used is None else (now_ns - used) / 1e9

    @property
    def tilted(self) -> bool:
        """Whether the robot has tipped over and has not stood upright since."""
        return self._tilt.tilted

    @property
    def slipping(self) -> bool:
        """Whether wheels and gyro contradicted each other in the last update."""
        return self.belief.contradicted


@njit(cache=True, nogil=True)
def _is_plausible(before: Array, covariance_before: Array, state: Array, covariance: Array) -> bool:
    """Return whether a state (n,) and its covariance (n, n) are finite, and close to those before."""
    if not (np.isfinite(state).all() and np.isfinite(covariance).all()):
        return False
    # a variance below zero: a huge one has left no digits for the others
    if np.diag(covariance).min() < -MAX_ROUNDING:
        return False
    for i in (X, Y):
        growth = math.sqrt(max(covariance[i, i], 0.0)) - math.sqrt(max(covariance_before[i, i], 0.0))
        if not (abs(state[i] - before[i]) < MAX_STEP and growth < MAX_STEP):
            return False
    return True


def _sources(reading: Reading) -> tuple[Source, ...]:
    if not isinstance(reading, ImuReading):
        return _WHEELS
    variances = reading.rates_variance, reading.force_variance, reading.attitude_variance
    return tuple([source for source, v in zip(IMU_SOURCES, variances, strict=True) if min(v) != math.inf])
