"""Tests the filter on the two recordings of robot_localization's tests."""

import numpy as np
import pytest
from robot_localization_bags import BODY, load

from chefbot.odometry.ekf import Ekf
from chefbot.odometry.sensor_health import Condition, Source


@pytest.mark.rotated
@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_the_final_pose_agrees_with_robot_localization(shared, number):
    """The error is less than half of the tolerance of robot_localization's own tests."""
    recording = load(shared("data/ekf/test1.bag").parent, number)
    ekf = Ekf(BODY)
    for reading in recording.readings:
        ekf.add(reading)
    end = ekf.belief.state[:3]
    off = float(np.linalg.norm(end - recording.end))
    assert off < recording.tolerance / 2
    assert np.linalg.eigvalsh(ekf.belief.covariance).min() > -1e-12
    assert ekf.too_late == 0
    last = max(reading.stamp_ns for reading in recording.readings)
    for source in (Source.WHEELS, Source.GYRO, Source.ACCELEROMETER, Source.ATTITUDE):
        assert ekf.condition(source, last) in (Condition.FRESH, Condition.LATE)
