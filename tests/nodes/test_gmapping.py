"""Tests the node of Gmapping."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer


@pytest.mark.parametrize("odom", [SE2(0.0, 0.0, 0.0), SE2(1.5, -0.7, 2.0)])
def test_map_origin_is_the_start_of_odometry_for_a_late_mapper(odom: SE2) -> None:
    system = NodeContainer(Loop(StepClock()), load_robot("chefbot_lidar"), 1)
    entry = NodeEntry(kind="chefbot.nodes.gmapping:GmappingNode")
    system.launch(Launch(name="test", description="", args={}, nodes={"gmapping": entry}))
    published: list[TransformStamped] = []
    system.loop.subscribe("tf", "test", lambda message: published.extend(message.transforms))  # type: ignore[attr-defined]
    now = system.loop.now_ns
    frames = [("odom", "base_link", odom), ("base_link", "laser", SE2(0.0, 0.0, 0.0))]
    transforms = tuple(TransformStamped.of(now, parent, child, pose) for parent, child, pose in frames)
    system.loop.publish("tf", TFMessage(transforms), "test")
    ranges = np.full(360, 2.0, np.float32)
    header = Header.of(now, "laser")
    system.loop.publish("scan", LaserScan(header, -3.14, 3.14, 0.0175, 0.0, 0.1, 0.1, 8.0, ranges), "test")
    system.loop.run(until_ns=now + 1_000_000)
    found = next(item for item in published if item.child_frame_id == "odom").transform.se2
    assert (found.x, found.y, found.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
