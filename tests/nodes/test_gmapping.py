"""Tests the node of Gmapping."""

from __future__ import annotations

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.grid import UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.map_msgs import OccupancyGridUpdate
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Empty, Header
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


def test_a_reset_begins_an_empty_map_where_the_robot_is() -> None:
    runner = NodeRunner({"gmapping": "chefbot.nodes.gmapping:GmappingNode"}, {})

    def look(metres: float) -> OccupancyGrid:
        """Send a scan of walls at this distance, and return the next map."""
        now, count = runner.loop.now_ns, len(runner.messages("map"))
        frames = [("odom", "base_link"), ("base_link", "laser")]
        transforms = tuple(TransformStamped.of(now, *frame, SE2(0.0, 0.0, 0.0)) for frame in frames)
        runner.loop.publish("tf", TFMessage(transforms), "test")
        ranges = np.full(360, metres, np.float32)
        header = Header.of(now, "laser")
        runner.loop.publish(
            "scan", LaserScan(header, -3.14, 3.14, 0.0175, 0.0, 0.1, 0.1, 8.0, ranges), "test"
        )
        runner.run(2.5)
        assert len(runner.messages("map")) > count
        newest = runner.messages("map")[-1]
        assert isinstance(newest, OccupancyGrid)
        return newest

    first = look(3.0).grid
    assert first.at(2.0, 0.0) != UNKNOWN
    runner.loop.publish("reset_map", Empty(), "page")
    runner.run(0.1)
    second = look(1.0).grid
    assert second.at(0.5, 0.0) != UNKNOWN and second.at(2.0, 0.0) == UNKNOWN


def test_map_updates_turn_each_map_into_the_next() -> None:
    runner = NodeRunner({"gmapping": "chefbot.nodes.gmapping:GmappingNode"}, {})
    for step in range(6):
        now, pose = runner.loop.now_ns, SE2(0.0, 0.0, 0.6 * step)
        frames = [("odom", "base_link", pose), ("base_link", "laser", SE2(0.0, 0.0, 0.0))]
        transforms = tuple(TransformStamped.of(now, *frame) for frame in frames)
        runner.loop.publish("tf", TFMessage(transforms), "test")
        ranges = np.full(360, 2.0 if step else 7.0, np.float32)  # nearer than before: within the known area
        scan = LaserScan(Header.of(now, "laser"), -3.14, 3.14, 0.0175, 0.0, 0.1, 0.1, 8.0, ranges)
        runner.loop.publish("scan", scan, "test")
        runner.run(2.5)
    maps = {m.header.stamp.ns: m.grid for m in runner.messages("map") if isinstance(m, OccupancyGrid)}
    updates = [m for m in runner.messages("map_updates") if isinstance(m, OccupancyGridUpdate)]
    stamps = sorted(maps)
    assert updates and len(maps) > 3
    for update in updates:
        before = stamps[stamps.index(update.header.stamp.ns) - 1]
        patched = maps[before].cells.copy()
        rows, columns = slice(update.y, update.y + update.height), slice(update.x, update.x + update.width)
        patched[rows, columns] = update.data.reshape(update.height, update.width)
        assert np.array_equal(patched, maps[update.header.stamp.ns].cells)
