"""Tests that readings which are impossible or make the filter diverge are rejected and leave it running."""

import math
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from sensor_readings import BODY, PERIOD, filter_readings, simulate_readings, slalom_commands

from chefbot.errors import OdometryError
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.out_of_sequence import History
from chefbot.odometry.readings import ImuReading, WheelCounts
from chefbot.robot.spec import GRAVITY

READINGS, _ = simulate_readings(slalom_commands(12.0))


def impossible_imu(stamp_ns: int) -> ImuReading:
    unmeasured = (math.nan,) * 3
    return ImuReading(stamp_ns, (0.1,) * 3, unmeasured, (0.0, 0.0, GRAVITY), unmeasured)


def test_a_diverging_reading_is_rejected_and_the_filter_runs_on():
    """Without the check such a reading makes the pose permanently NaN."""
    ekf = filter_readings(READINGS[:200])
    with suppress(OdometryError):
        ekf.add(impossible_imu(READINGS[200].stamp_ns - 1))
    with pytest.raises(OdometryError, match="makes the odometry diverge"):
        filter_readings(READINGS[200:210], ekf=ekf)
    moved = ekf.estimate.pose
    end = filter_readings(READINGS[210:300], ekf=ekf).estimate.pose
    assert 0.0 < end.distance(moved) < 10.0


WILD_COUNTS = st.sampled_from([0, -(2**53), 2**53, 2**40, -(2**40), 2**31, -(2**31), 10**6, -(10**6), 50_000])


@given(st.lists(st.tuples(st.integers(0, 59), WILD_COUNTS, WILD_COUNTS), min_size=1, max_size=8))
@example([(4, 0, -(2**53)), (5, 2**53, 0)])
def test_wild_counts_leave_a_filter_that_runs_on(wild):
    """Without the check of the covariance a jump of one wheel made every later reading diverge."""
    ekf = filter_readings(READINGS[:200])
    for k, reading in enumerate(READINGS[200:260]):
        for _, left, right in (one for one in wild if one[0] == k):
            with suppress(OdometryError):
                ekf.add(WheelCounts(reading.stamp_ns + 1, left, right))
        with suppress(OdometryError):
            ekf.add(reading)
    filter_readings(READINGS[260:262], ekf=ekf)
    moved = ekf.estimate.pose
    end = filter_readings(READINGS[262:362], ekf=ekf).estimate.pose
    assert np.diag(ekf.belief.covariance).min() > -1e-9
    assert 0.02 < end.distance(moved) < 2.0


def test_a_rejected_reading_keeps_the_count_of_restarts():
    ekf = Ekf(BODY)
    for k, ticks in enumerate((50_000, 50_000, 0, 0)):
        ekf.add(WheelCounts((k + 1) * PERIOD, ticks, ticks))
    assert ekf.belief.counters.restarts == 1
    ekf._revert_to(ekf.belief)
    assert ekf.belief.counters.restarts == 1


def test_a_rejected_reading_changes_nothing():
    def fold(belief, reading):
        if reading.stamp_ns == 2:
            raise ZeroDivisionError
        return (*belief, reading.stamp_ns)

    history = History(fold, (), 100)
    for stamp in (1, 3, 4):
        history.add(WheelCounts(stamp, 0, 0))
    with pytest.raises(ZeroDivisionError):
        history.add(WheelCounts(2, 0, 0))
    assert history.latest == (1, 3, 4)
    history.add(WheelCounts(5, 0, 0))
    assert history.latest == (1, 3, 4, 5)
