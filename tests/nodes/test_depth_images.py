"""Depth images that a robot cannot use are named as bad input, and are no bug of the node."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.msgs.sensor_msgs import Image
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.depth_to_scan import NO_CAMERA
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

NODES = {"depth_to_scan": NodeEntry(kind="chefbot.nodes.depth_to_scan:DepthToScanNode")}


@pytest.mark.parametrize(
    ("robot", "reason"), [("jackal", NO_CAMERA), ("chefbot", "depth image of shape (2, 3)")]
)
def test_images_that_do_not_fit_the_robot_are_refused(robot: str, reason: str) -> None:
    system = NodeContainer(Loop(StepClock()), load_robot(robot), 1)
    system.isolate_faults(lambda _: None)
    system.launch(Launch(name="depth", description="", args={}, nodes=NODES))
    image = Image.of(Header.of(0, "camera"), "32FC1", np.ones((2, 3), np.float32))
    system.loop.publish("camera/depth/image_raw", image, "test", from_device=True)
    system.loop.run(until_ns=1_000_000)
    assert system.faults is not None and system.faults.bug_count == 0
    assert [sentence for sentence in system.faults.counts if reason in sentence]
