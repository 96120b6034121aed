"""robot_localization's own two recordings."""

import numpy as np
import pytest
from bags import BODY, load

from chefbot.odometry.ekf import Ekf
from chefbot.odometry.sensor_health import Condition, Source


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_the_final_pose_agrees_with_robot_localization(shared, number):
    """Within half of the tolerance that robot_localization allows itself around its own published end."""
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
