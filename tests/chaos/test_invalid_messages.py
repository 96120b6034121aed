"""Tests that a launch rejects messages with unusable values from the network, names the topic and continues."""

from __future__ import annotations

import time

import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan, WheelSpeeds
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    TransformStamped,
    covariance_36,
)
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.nav_msgs import MapMetaData, OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.ros2.rmw.node import RmwNode
from tests.chaos.launch_process import run_launch_file, wait_for
from tests.chaos.message_generator import MessageGenerator

RANDOM = 400
PAUSE = 0.005
PUBLISHED_BY_THE_ROBOT = ("/clock", "/wheel_speeds", "/rosout", "/parameter_events")
NINE_ONES = np.ones(9, np.float32)
NEGATIVE_VARIANCE = covariance_36(np.diag([-1.0, 0.1, 0.1]))
FUTURE_TRANSFORM = TransformStamped.of(
    time.time_ns() + 3600 * 10**9, "odom", "base_footprint", SE2(0.0, 0.0, 0.0)
)
CRASHING_MESSAGES: dict[str, tuple[Message, str]] = {
    "/initialpose": (
        PoseWithCovarianceStamped(Header(), PoseWithCovariance(Pose(), NEGATIVE_VARIANCE)),
        "pose.covariance holds the variance -1",
    ),
    "/map": (
        OccupancyGrid(Header(), MapMetaData(resolution=0.05, width=10, height=10), np.zeros(99, np.int8)),
        "data has 99 cells",
    ),
    "/scan": (
        LaserScan(Header(), 0.0, 1.0, 3e38, 0.0, 0.1, 0.1, 12.0, NINE_ONES),
        "angle_increment is 3e+38",
    ),
    "/obstacles": (
        ObstacleScan(Header(), 0.0, 9.0, 4.0, NINE_ONES, np.full(9, -1e9, np.float32), NINE_ONES),
        "span more than a turn",
    ),
    "/tf": (TFMessage((FUTURE_TRANSFORM,)), "ahead of the robot's clock"),
    "/cmd_vel_teleop": (message_type("geometry_msgs/msg/Twist").from_cdr(b"\0\1\0\0" + b"\xff" * 48), "nan"),
}
"""By topic, a message that once crashed or blocked a launch, and a part of the diagnostic that now rejects it."""


def inputs_of(node: RmwNode) -> dict[str, type[Message]]:
    """Return the subscribed topics in the graph with their types, without those of actions."""
    return {
        name: message_type(found.types[0].name)
        for name, found in sorted(node.wire.graph.topics().items())
        if found.consumers and "/_action/" not in name and name not in PUBLISHED_BY_THE_ROBOT
    }


def _is_rejected(diagnostics: list[str], topic: str, rejection: str) -> bool:
    return any(key.startswith(f"{topic}: ") and rejection in key for key in diagnostics)


@pytest.mark.rotated("invalid messages")
@pytest.mark.slow
def test_messages_that_once_crashed_a_launch_are_rejected() -> None:
    with run_launch_file("random_messages.yaml", "headless:=true") as (chefbot, node):
        diagnostics: dict[str, str] = {}
        speeds: list[WheelSpeeds] = []

        def keep(array: DiagnosticArray) -> None:
            diagnostics.update({v.key: v.value for status in array.status for v in status.values})

        node.subscription("/diagnostics", DiagnosticArray, keep)
        node.subscription("/wheel_speeds", WheelSpeeds, speeds.append)
        wait_for(lambda: len(speeds) > 40)
        wait_for(lambda: CRASHING_MESSAGES.keys() <= inputs_of(node).keys())
        inputs = inputs_of(node)
        publishers = {name: node.publisher(name, kind) for name, kind in inputs.items()}
        for topic, (message, rejection) in CRASHING_MESSAGES.items():
            wait_for(lambda: publishers[topic].has_subscribers)  # noqa: B023
            publishers[topic].publish(message)
            wait_for(lambda: _is_rejected(list(diagnostics), topic, rejection))  # noqa: B023
        generator, rng = MessageGenerator(5), np.random.default_rng(5)
        for _ in range(RANDOM):
            name = list(publishers)[rng.integers(len(publishers))]
            publishers[name].publish(generator.generate(inputs[name]))
            time.sleep(PAUSE)
        before = len(speeds)
        wait_for(lambda: len(speeds) > before + 40)
        output = chefbot.stop()
        assert chefbot.process.returncode == 0, output[-3000:]
