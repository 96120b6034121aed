"""Tests the node of graph SLAM: reset, restart with the map that the recorder has kept, live parameters."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.support.mapping_robot import MappingRobot, bundles

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Empty, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.gmapping import GmappingNode
from chefbot.nodes.graph_slam import GraphSlamNode
from chefbot.nodes.scans.mapper import MapperNode

START = SE2(0.3, 0.2, 0.4)
"""Pose of odom in the map at the restart."""


def test_both_mappers_have_the_same_ports() -> None:
    for node in (GmappingNode, GraphSlamNode):
        assert issubclass(node, MapperNode) and node.role == "The mapper"


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    robot = MappingRobot(tmp_path / "kept", mapper="graph_slam")
    robot.drive()
    robot.end()
    return bundles(tmp_path / "kept")[0].parent


def restored(folder: Path) -> dict[str, Message]:
    transforms = TFMessage((TransformStamped.of(0, "map", "odom", START),))
    return {"tf": transforms, "map_recorder/folder": String(str(folder))}


def test_a_restarted_mapper_goes_on_with_the_kept_map(kept: Path, tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path / "later", mapper="graph_slam", restored=restored(kept))
    robot.began = START
    robot.drive(0.5)
    first = robot.messages("mapped_scan")[0]
    assert first.continued and SE2.of(first.start).distance(START) < 1e-9
    found = robot.map_to_odom()
    assert found.distance(START) < 0.05 and abs(found.between(START).yaw) < 0.03
    robot.end()


def test_a_restart_before_a_map_was_kept_begins_another(tmp_path: Path) -> None:
    transforms = TFMessage((TransformStamped.of(0, "map", "odom", START),))
    robot = MappingRobot(tmp_path, mapper="graph_slam", restored={"tf": transforms})
    robot.drive(0.2)
    assert not robot.messages("mapped_scan")[0].continued
    robot.end()


def test_a_reset_begins_an_empty_map(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path, mapper="graph_slam")
    robot.drive()
    whole = robot.messages("map")[-1].grid
    robot.loop.publish("reset_map", Empty(), "page")
    robot.scan(SE2(0.0, 0.0, 0.0))
    robot.run(2.1)
    assert (robot.messages("map")[-1].grid.cells >= 0).sum() < (whole.cells >= 0).sum()
    robot.end()


def test_parameters_change_while_it_maps(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path, mapper="graph_slam")
    robot.drive(0.5)
    before = sum(message.used for message in robot.messages("mapped_scan"))
    rarely = {"linear_update": 5.0, "angular_update": 3.0}
    robot.system.set_params("graph_slam", {"publish_drive": True, "graph": rarely}, "test")
    robot.run(0.1)
    robot.drive(0.5)
    after = sum(message.used for message in robot.messages("mapped_scan")) - before
    assert after < before / 3
    robot.end()
