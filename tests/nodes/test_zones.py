"""The zones node and the nodes that obey it: speed limit, masks, keep-out zones on the way, and the causes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.config import ConfigError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, SLOW_ZONE, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped, Twist
from chefbot.msgs.nav2_msgs import ComputePathToPose, ComputePathToPose_Goal, SpeedLimit
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.controller import ControllerNode
from chefbot.nodes.drive_base import DriveBaseNode
from chefbot.ros2.rmw.action_client import new_goal_id
from chefbot.runtime.node import subscribes_to
from chefbot.safety.speed_limit import fraction_within
from chefbot.storage.map_files import save_map
from chefbot.storage.zones import zones_path

ZONES = "chefbot.nodes.navigation.zones:ZonesNode"
PLANNER = "chefbot.nodes.planner:PlannerNode"


def zone(name: str, kind: str, box: tuple[float, float, float, float], **more: float) -> MapZone:
    x, y, right, top = box
    corners = ((x, y), (right, y), (right, top), (x, top))
    return MapZone(name, kind, tuple(Point(a, b, 0.0) for a, b in corners), **more)


def rooms() -> Grid:
    """Return two corridors round a block, 6 m x 5 m."""
    cells = np.zeros((100, 120), np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    cells[40:70, 40:80] = 100
    return Grid(cells, 0.05, 0.0, 0.0)


class ZoneRunner(NodeRunner):
    """Nodes with a map, zones and a pose of the robot."""

    def __init__(self, kinds: dict[str, str], *zones: MapZone, params: dict[str, Any] | None = None) -> None:
        super().__init__(kinds, {}, params)
        header = Header.of(0, "map")
        self.loop.publish("map", OccupancyGrid.of(header, rooms()), "wire")
        self.loop.publish("zones", MapZones(header, zones), "wire")
        self.place(SE2(1.0, 1.0, 0.0))

    def place(self, pose: SE2, seconds: float = 0.3) -> None:
        for parent, child, at in (("map", "odom", SE2(0.0, 0.0, 0.0)), ("odom", "base_footprint", pose)):
            self.loop.publish(
                "tf", TFMessage((TransformStamped.of(self.loop.now_ns, parent, child, at),)), "w"
            )
        self.run(seconds)

    def sentences(self) -> str:
        return " ".join(one.sentence for one in self.messages("cause_reports") if isinstance(one, Cause))


FRAMES = {"robot_state_publisher": "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode"}
RAMP = zone("ramp", SLOW_ZONE, (3.0, 0.0, 4.0, 2.0), speed=0.15)


def test_the_limit_begins_before_the_zone_and_ends_behind_it() -> None:
    runner = ZoneRunner({**FRAMES, "zones": ZONES}, RAMP)
    assert runner.messages("speed_limit") == []
    for x, low, high in ((2.8, 0.149, 0.5), (3.5, 0.15, 0.15), (4.2, 0.0, 0.0)):
        runner.place(SE2(x, 1.0, 0.0))
        assert low <= runner.messages("speed_limit")[-1].speed_limit <= high
    runner.place(SE2(4.05, 1.0, 0.0))
    assert runner.messages("speed_limit")[-1].speed_limit == 0.0
    runner.loop.publish("cmd_vel", Twist.of(-0.2, 0.0), "base")
    runner.run(0.3)
    assert 0.15 <= runner.messages("speed_limit")[-1].speed_limit < 0.5, "backward it lies ahead"


def test_a_zone_that_slows_the_robot_down_is_a_cause() -> None:
    runner = ZoneRunner({**FRAMES, "zones": ZONES}, RAMP)
    runner.place(SE2(3.5, 1.0, 0.0))
    assert runner.sentences() == "", "it stands"
    runner.loop.publish("cmd_vel_nav", Twist.of(0.4, 0.0), "controller")
    runner.run(0.3)
    assert runner.sentences() == "Slow zone ramp limits the speed to 0.15 m/s."


def test_the_base_keeps_the_limit_for_every_source() -> None:
    runner = ZoneRunner(
        {**FRAMES, "zones": ZONES, "base": "chefbot.nodes.drive_base:DriveBaseNode"},
        zone("ramp", SLOW_ZONE, (0.0, 0.0, 5.0, 2.0), speed=0.1),
        params={"base": {"monitor": {"optional_sensors": ["lidar", "depth camera", "ultrasonic ranger"]}}},
    )
    for topic in ("cmd_vel_teleop", "cmd_vel_nav"):
        for _ in range(40):
            runner.loop.publish(topic, Twist.of(0.3, 0.1), "driver", from_device=True)
            runner.place(SE2(1.0, 1.0, 0.0), 0.05)
        last = runner.messages("cmd_vel")[-1]
        assert last.linear.x <= 0.1 + 1e-9
        assert last.linear.x == 0.0 or last.angular.z / last.linear.x == pytest.approx(1.0 / 3.0, rel=0.05)


def test_nav2_finds_the_masks() -> None:
    runner = ZoneRunner({"zones": ZONES}, RAMP, zone("hole", KEEP_OUT, (2.0, 3.8, 3.0, 4.4)))
    (info,) = {(one.type, one.filter_mask_topic) for one in runner.messages("keepout_costmap_filter_info")}
    assert info == (0, "keepout_filter_mask")
    assert runner.messages("keepout_filter_mask")[-1].grid.at(2.5, 4.0) == 100
    speed = runner.messages("speed_costmap_filter_info")[-1]
    assert speed.multiplier * runner.messages("speed_filter_mask")[-1].grid.at(3.5, 1.0) == pytest.approx(
        0.15
    )


def test_a_slow_zone_is_not_an_obstacle_beside_the_trajectory() -> None:
    limit = SpeedLimit(speed_limit=0.15)
    assert fraction_within(limit, 0.4, 0.5) * 0.4 == pytest.approx(0.15)
    assert subscribes_to(ControllerNode, SpeedLimit) and subscribes_to(DriveBaseNode, SpeedLimit)


def plan(runner: NodeRunner, goal: SE2) -> Any:
    message = PoseStamped(Header.of(0, "map"), Pose.of(goal))
    request = ComputePathToPose.send_goal(new_goal_id(), ComputePathToPose_Goal(message))
    runner.loop.publish("compute_path_to_pose/_action/send_goal", request, "client")
    runner.run(0.5)
    return runner.messages("compute_path_to_pose/_action/get_result")[-1].result


def planner(*zones: MapZone) -> ZoneRunner:
    return ZoneRunner({**FRAMES, "planner": PLANNER}, *zones)


SOUTH, NORTH = (2.5, 0.0, 3.5, 2.1), (2.5, 3.4, 3.5, 5.0)
EAST = SE2(5.0, 1.0, 0.0)


def test_a_plan_leads_round_a_keep_out_zone_and_names_it() -> None:
    runner = planner(zone("buffet", KEEP_OUT, SOUTH))
    path = plan(runner, EAST).path.array
    assert path[:, 1].max() > 3.5
    (cause,) = [one for one in runner.messages("cause_reports") if one.kind == "detour"]
    assert cause.sentence.endswith("because of the keep-out zone buffet.")
    assert cause.sensor == "keep-out zone buffet" and SOUTH[0] <= cause.point.x <= SOUTH[2]
    plan(runner, EAST)
    assert len([one for one in runner.messages("cause_reports") if one.kind == "detour"]) == 1


def test_without_a_path_the_zone_is_named() -> None:
    runner = planner(zone("buffet", KEEP_OUT, SOUTH), zone("stairs", KEEP_OUT, NORTH))
    result = plan(runner, EAST)
    assert result.error_code == 208
    assert result.error_msg == "no path leads to the goal because of the keep-out zone buffet"
    (cause,) = [one for one in runner.messages("cause_reports") if one.kind == "failure"]
    assert cause.sensor == "keep-out zone buffet"


def test_a_goal_in_a_keep_out_zone_fails_with_its_name() -> None:
    runner = planner(zone("buffet", KEEP_OUT, (4.0, 0.0, 6.0, 2.1)))
    assert plan(runner, EAST).error_code == 206
    (cause,) = [one for one in runner.messages("cause_reports") if one.kind == "failure"]
    assert cause.sensor == "keep-out zone buffet"


def test_a_lane_that_closes_the_path_is_named() -> None:
    west = 3.14159265
    runner = planner(zone("exit", ONE_WAY, SOUTH, direction=west), zone("stairs", KEEP_OUT, NORTH))
    assert plan(runner, EAST).error_code == 208
    (cause,) = [one for one in runner.messages("cause_reports") if one.kind == "failure"]
    assert cause.sentence == "No path leads to the goal because of the one-way lane exit."


def test_a_detour_because_of_a_lane_is_reported() -> None:
    runner = planner(zone("exit", ONE_WAY, SOUTH, direction=3.14159265))
    assert plan(runner, EAST).path.array[:, 1].max() > 3.5
    assert "longer because of the one-way lane exit." in runner.sentences()


def test_the_map_server_finds_the_zones_beside_the_map(tmp_path: Path) -> None:
    path = save_map(tmp_path / "rooms", rooms())
    corners = "corners: [{x: 1 m, y: 1 m}, {x: 2 m, y: 1 m}, {x: 2 m, y: 2 m}]"
    zones_path(path).write_text(f"version: 1\nzones:\n  hall: {{kind: preferred, {corners}}}\n")
    other = tmp_path / "other.yaml"
    other.write_text(f"version: 1\nzones:\n  stairs: {{kind: keep_out, {corners}}}\n")
    for given, name in (({}, "hall"), ({"zones": str(other)}, "stairs")):
        runner = NodeRunner(
            {"map_server": "chefbot.devices.maps.map_file:MapFileDevice"},
            {},
            {"map_server": {"map": str(path), **given}},
        )
        runner.run(0.2)
        assert [one.name for one in runner.messages("zones")[-1].zones] == [name]
    other.write_text("version: 1\nzones: {a: {kind: keep_out, corners: []}}")
    with pytest.raises(ConfigError, match="zone a: it needs three corners"):
        NodeRunner(
            {"map_server": "chefbot.devices.maps.map_file:MapFileDevice"},
            {},
            {"map_server": {"map": str(path), "zones": str(other)}},
        )
