"""The initial pose of a launch reaches localization, also where that subscribes after it was published."""

from __future__ import annotations

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, PoseWithCovarianceStamped, covariance_36
from chefbot.msgs.std_msgs import Header

START = SE2(2.0, 2.0, 0.5)


def estimate(pose: SE2, deviation: float) -> PoseWithCovarianceStamped:
    covariance = covariance_36(np.diag([deviation**2, deviation**2, 0.1]))
    return PoseWithCovarianceStamped(Header.of(0, "map"), PoseWithCovariance(Pose.of(pose), covariance))


@pytest.mark.parametrize(
    ("pose", "deviation", "times"),
    [(SE2(2.1, 1.9, 0.4), 0.4, 1), (SE2(5.0, 2.0, 0.5), 0.3, 2), (SE2(2.2, 2.0, 0.0), 2.1, 2)],
    ids=["received", "elsewhere", "unsure"],
)
def test_the_initial_pose_is_repeated_until_received(pose: SE2, deviation: float, times: int) -> None:
    """And only for its first estimate: later the robot has moved."""
    params = {"initial_pose": {"x": START.x, "y": START.y, "yaw": START.yaw}}
    runner = NodeRunner({"initial_pose": "chefbot.devices.initial_pose:InitialPoseDevice"}, {}, params)
    runner.run(0.1)
    for message in (estimate(pose, deviation), estimate(SE2(9.0, 9.0, 0.0), 3.0)):
        runner.loop.publish("amcl_pose", message, "amcl")
        runner.run(0.1)
    poses = [one.pose.pose.se2 for one in runner.messages("initialpose")]
    assert len(poses) == times
    assert all(one == pytest.approx(START) for one in poses)
