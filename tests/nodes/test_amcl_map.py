"""Localization on a map that is changed while the robot runs: it continues from where it is."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.devices.initial_pose import initial_pose
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage

POSE = SE2(3.0, 2.0, 0.0)
ANGLES = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def room(margin: int = 0) -> Grid:
    """A room of 8 m by 5 m from the origin on, with unknown cells around it."""
    cells = np.zeros((100, 160), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    cells[60:70, 20:30] = 100
    return Grid(np.pad(cells, margin, constant_values=-1), 0.05, -0.05 * margin, -0.05 * margin)


def ranges() -> np.ndarray:
    """What a lidar at POSE sees of the walls and of the block."""
    grid, steps = room(), np.arange(0.1, 10.0, 0.01)
    x = POSE.x + steps * np.cos(ANGLES)[:, None]
    y = POSE.y + steps * np.sin(ANGLES)[:, None]
    rows, columns = np.clip((y / 0.05).astype(int), 0, 99), np.clip((x / 0.05).astype(int), 0, 159)
    found: np.ndarray = steps[np.argmax(grid.cells[rows, columns] == 100, axis=1)]
    return found.astype(np.float32)


class Hall(NodeRunner):
    """The node with the map of the room."""

    def __init__(self) -> None:
        super().__init__({"amcl": "chefbot.nodes.amcl:AmclNode"}, {})
        self.node: Any = self.system.nodes["amcl"]
        self.send("map", OccupancyGrid.of(Header.of(0, "map"), room()))

    def send(self, topic: str, message: Any) -> None:
        self.loop.publish(topic, message, "test", from_device=True)
        self.run(0.05)

    def scan(self) -> None:
        now = self.loop.now_ns
        frames = (("odom", "base_link"), ("base_link", "laser"))
        transforms = tuple(TransformStamped.of(now, *frame, SE2(0.0, 0.0, 0.0)) for frame in frames)
        self.send("tf", TFMessage(transforms))
        header = Header.of(now, "laser")
        step = float(ANGLES[1] - ANGLES[0])
        self.send("scan", LaserScan(header, -np.pi, np.pi, step, 0.0, 0.1, 0.1, 12.0, ranges()))


def test_a_changed_map_keeps_the_pose() -> None:
    hall = Hall()
    hall.scan()
    hall.send("initialpose", initial_pose(hall.loop.now_ns, POSE))
    for _ in range(3):
        hall.scan()
    amcl, before = hall.node._amcl, hall.node._amcl.pose
    assert before.distance(POSE) < 0.1
    hall.send("map", OccupancyGrid.of(Header.of(1, "map"), room(margin=30)))
    assert hall.node._amcl is amcl and amcl.field is not None
    for _ in range(3):
        hall.scan()
    assert hall.node._amcl is amcl and amcl.pose.distance(POSE) < 0.1
    assert hall.messages("localization_status")[-1].localized  # type: ignore[attr-defined]


@pytest.mark.parametrize("changed", [False, True])
def test_only_another_map_is_taken(changed: bool) -> None:
    hall = Hall()
    hall.scan()
    field = hall.node._amcl.field
    hall.send("map", OccupancyGrid.of(Header.of(1, "map"), room(margin=10 if changed else 0)))
    hall.scan()
    assert (hall.node._amcl.field is not field) == changed


@pytest.mark.parametrize(
    ("frame", "x", "reason"),
    [
        ("nonsense", 3.0, "its frame is nonsense, not map"),
        ("map", 900.0, "900.00, 2.00 m lies outside the map"),
    ],
)
def test_a_pose_that_is_not_on_the_map_is_ignored(frame: str, x: float, reason: str) -> None:
    hall = Hall()
    hall.send("initialpose", initial_pose(hall.loop.now_ns, POSE))
    hall.scan()
    wrong = initial_pose(hall.loop.now_ns, SE2(x, POSE.y, 0.0))
    header = Header.of(hall.loop.now_ns, frame)
    hall.send("initialpose", msgspec.structs.replace(wrong, header=header))
    hall.scan()
    assert hall.node._amcl.pose.distance(POSE) < 0.5
    assert hall.messages("scan/notice")[-1].data == f"The given pose is ignored: {reason}."  # type: ignore[attr-defined]
