"""A mapper or a localization that receives no scan reports it."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

SECOND = 1_000_000_000
KINDS = {"mapper": "chefbot.nodes.gmapping:GmappingNode", "localization": "chefbot.nodes.amcl:AmclNode"}


@pytest.mark.parametrize("role", KINDS)
def test_missing_scans_are_reported_once_within_three_seconds(role: str) -> None:
    loop = Loop(StepClock())
    remarks: list[tuple[int, Message]] = []
    loop.add_observer(
        lambda one: remarks.append((one.time_ns, one.message)) if one.topic == "scan/remark" else None
    )
    system = NodeContainer(loop, load_robot("chefbot_lidar"), 1)
    system.launch(Launch(name="test", description="", args={}, nodes={"node": NodeEntry(kind=KINDS[role])}))
    loop.run(until_ns=10 * SECOND)
    (time_ns, message), *others = remarks
    assert time_ns <= 3 * SECOND and not others
    assert isinstance(message, String) and role in message.data.lower() and "lidar" in message.data
    ranges = np.ones(360, np.float32)
    header = Header.of(loop.now_ns, "laser")
    loop.publish(
        "scan", LaserScan(header, -3.14, 3.14, 0.0175, 0.0, 0.1, 0.1, 8.0, ranges), "lidar", from_device=True
    )
    loop.run(until_ns=11 * SECOND)
    assert len(remarks) == 2 and "again" in str(remarks[1][1])
    system.stop()
