"""A mapper with its map recorder, on a robot in a room whose odometry is right."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.storage.mapped_drives import BUNDLE
from tests.support.nodes import NodeRunner
from tests.support.pillar_room import ANGLES, circle, ranges_at

LASER = SE2(0.1, 0.0, 0.0)
MAPPERS = {
    "gmapping": "chefbot.nodes.gmapping:GmappingNode",
    "graph_slam": "chefbot.nodes.graph_slam:GraphSlamNode",
}


class MappingRobot(NodeRunner):
    """A mapper and a map recorder, and a robot whose odometry is right."""

    def __init__(
        self,
        folder: Path,
        continue_map: str = "",
        mapper: str = "gmapping",
        restored: Mapping[str, Message] | None = None,
    ) -> None:
        params = {
            mapper: {"publish_drive": True, "continue_map": continue_map},
            "recorder": {"folder": str(folder), "continue_map": continue_map},
        }
        kinds = {
            mapper: MAPPERS[mapper],
            "recorder": "chefbot.devices.maps.map_recorder:MapRecorderDevice",
        }
        self.began = SE2(0.0, 0.0, 0.0)
        """Pose in the room where the robot was switched on."""
        self.room = 1.0
        """Scale of the room."""
        super().__init__(kinds, dict(restored or {}), params)

    def scan(self, odom: SE2) -> None:
        now = self.loop.now_ns
        frames = (("odom", "base_link", odom), ("base_link", "laser", LASER))
        self.loop.publish(
            "tf", TFMessage(tuple(TransformStamped.of(now, *frame) for frame in frames)), "test"
        )
        ranges = ranges_at(self.began @ odom @ LASER) * np.float32(self.room)
        step = 2 * math.pi / len(ANGLES)
        header = Header.of(now, "laser")
        self.loop.publish(
            "scan", LaserScan(header, -math.pi, math.pi - step, step, 0.0, 0.1, 0.1, 12.0, ranges), "test"
        )
        self.run(0.1)

    def drive(self, turns: float = 1.0) -> None:
        """Drive on a circle with a scan every 3 cm, until the map is published."""
        for pose in circle(turns):
            self.scan(pose)
        self.run(2.1)

    def map_to_odom(self) -> SE2:
        """Return the newest transform map -> odom."""
        newest = (item for message in reversed(self.messages("tf")) for item in message.transforms)
        return next(item.transform.se2 for item in newest if item.child_frame_id == "odom")

    def notices(self) -> list[str]:
        return [message.data for message in self.messages("map_recorder/notice")]

    def end(self) -> None:
        self.system.stop()


def bundles(folder: Path) -> list[Path]:
    return sorted(folder.glob(f"*/{BUNDLE}"))
