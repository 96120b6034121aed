"""Legal messages that no robot can work with, over the real wire: refused by name, and the launch goes on."""

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
from tests.chaos.launched import launched, wait_for
from tests.chaos.messages import Messages

RANDOM = 400
PAUSE = 0.005
SPOKEN_BY_THE_ROBOT = ("/clock", "/wheel_speeds", "/rosout", "/parameter_events")
NINE = np.ones(9, np.float32)
NEGATIVE = covariance_36(np.diag([-1.0, 0.1, 0.1]))
IN_AN_HOUR = TransformStamped.of(time.time_ns() + 3600 * 10**9, "odom", "base_footprint", SE2(0.0, 0.0, 0.0))
KILLERS: dict[str, tuple[Message, str]] = {
    "/initialpose": (
        PoseWithCovarianceStamped(Header(), PoseWithCovariance(Pose(), NEGATIVE)),
        "pose.covariance holds the variance -1",
    ),
    "/map": (
        OccupancyGrid(Header(), MapMetaData(resolution=0.05, width=10, height=10), np.zeros(99, np.int8)),
        "data has 99 cells",
    ),
    "/scan": (
        LaserScan(Header(), 0.0, 1.0, 3e38, 0.0, 0.1, 0.1, 12.0, NINE),
        "angle_increment is 3e+38",
    ),
    "/obstacles": (
        ObstacleScan(Header(), 0.0, 9.0, 4.0, NINE, np.full(9, -1e9, np.float32), NINE),
        "span more than a turn",
    ),
    "/tf": (TFMessage((IN_AN_HOUR,)), "ahead of the robot's clock"),
    "/cmd_vel_teleop": (message_type("geometry_msgs/msg/Twist").from_cdr(b"\0\1\0\0" + b"\xff" * 48), "nan"),
}
"""Each ended a launch, or held its loop up, before."""


def inputs_of(node: RmwNode) -> dict[str, type[Message]]:
    """Every topic that somebody on the wire subscribes to, and its type; not what is part of an action."""
    return {
        name: message_type(found.types[0].name)
        for name, found in sorted(node.wire.graph.topics().items())
        if found.consumers and "/_action/" not in name and name not in SPOKEN_BY_THE_ROBOT
    }


@pytest.mark.slow
def test_messages_that_crashed_a_launch_are_refused_by_name() -> None:
    with launched("stormed.yaml", "headless:=true") as (one, node):
        named: dict[str, str] = {}
        driven: list[WheelSpeeds] = []

        def note(array: DiagnosticArray) -> None:
            named.update({v.key: v.value for status in array.status for v in status.values})

        node.subscription("/diagnostics", DiagnosticArray, note)
        node.subscription("/wheel_speeds", WheelSpeeds, driven.append)
        wait_for(lambda: len(driven) > 40)
        wait_for(lambda: KILLERS.keys() <= inputs_of(node).keys())
        inputs = inputs_of(node)
        ends = {name: node.publisher(name, kind) for name, kind in inputs.items()}
        for topic, (message, words) in KILLERS.items():
            wait_for(lambda: ends[topic].has_subscribers)  # noqa: B023
            ends[topic].publish(message)
            wait_for(lambda: any(key.startswith(f"{topic}: ") and words in key for key in named))  # noqa: B023
        messages, rng = Messages(5), np.random.default_rng(5)
        for _ in range(RANDOM):
            name = list(ends)[rng.integers(len(ends))]
            ends[name].publish(messages.any_of(inputs[name]))
            time.sleep(PAUSE)
        before = len(driven)
        wait_for(lambda: len(driven) > before + 40)
        said = one.stop()
        assert one.process.returncode == 0, said[-3000:]
