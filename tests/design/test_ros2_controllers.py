"""Controllers and costmaps of the ROS 2 export, as functions of the robot's figures."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import Any

import pytest
import yaml

from chefbot.design.export.ros2.annotated_yaml import Explained, plain_values
from chefbot.design.export.ros2.controllers import controller_server, dwb, mppi
from chefbot.design.export.ros2.costmaps import EXTRA_CLEARING_RANGE, global_costmap, local_costmap
from chefbot.design.export.ros2.derived_nav_params import Figures, OdometryErrors
from chefbot.design.export.ros2.interfaces import interface_files
from chefbot.design.export.ros2.ros2_control import controllers
from chefbot.msgs.idl.registry import message_type
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.motion_limits import max_acceleration, max_speed, max_turn

ROBOTS = sorted(built_in_robots())


@cache
def figures(name: str) -> Figures:
    return Figures(load_robot(name), OdometryErrors(slip=0.003, diameter_error=0.003, separation_error=0.005))


def values(tree: Any) -> dict[str, Any]:
    found: dict[str, Any] = plain_values(tree)
    return found


@pytest.mark.parametrize("name", ROBOTS)
def test_both_controllers_stay_within_the_limits_of_the_robot(name: str) -> None:
    robot, by_mppi, by_dwb = load_robot(name), values(mppi(figures(name))), values(dwb(figures(name)))
    assert by_mppi["vx_max"] == by_dwb["max_vel_x"] == by_dwb["max_speed_xy"] <= max_speed(robot)
    assert by_mppi["wz_max"] == by_dwb["max_vel_theta"] <= max_turn(robot)
    assert by_mppi["ax_max"] == by_dwb["acc_lim_x"] <= max_acceleration(robot)
    assert by_mppi["ax_min"] == by_dwb["decel_lim_x"] == -by_mppi["ax_max"]
    assert by_dwb["decel_lim_theta"] == -by_dwb["acc_lim_theta"] == -by_mppi["az_max"] < 0.0
    half = figures(name).horizon.number / 2  # one twist is kept for the whole look-ahead
    assert 1.0 <= by_dwb["sim_time"] <= 2.0 and by_dwb["sim_time"] == pytest.approx(
        1.0 if half < 1.0 else 2.0 if half > 2.0 else half, abs=0.01
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_mppi_shifts_by_exactly_one_period_over_the_horizon(name: str) -> None:
    one, tree = figures(name), values(controller_server(figures(name)))
    steps, dt = tree["FollowPath"]["time_steps"], tree["FollowPath"]["model_dt"]
    assert dt * tree["controller_frequency"] == pytest.approx(1.0, abs=1e-12)
    assert isinstance(steps, int) and steps * dt >= one.horizon.number - 1e-9 > (steps - 1) * dt - 1e-6


@pytest.mark.parametrize("name", ROBOTS)
def test_only_a_robot_that_sees_behind_itself_reverses(name: str) -> None:
    lowest, highest = (values(mppi(figures(name)))[key] for key in ("vx_min", "vx_max"))
    around = load_robot(name).sensors.covers_rear
    assert lowest == (pytest.approx(-highest / 2) if around else 0.0)


def test_the_example_robot_of_nav2_gets_the_example_values() -> None:
    """Distances scale with the look-ahead: 1.4 m in cells of 5 cm gives those that Nav2 documents."""
    one = figures("chefbot")
    scale = one.lookahead.number / 1.4
    tree = values(mppi(one))
    assert tree["prune_distance"] == pytest.approx(1.7 * scale, rel=0.02)
    assert tree["CostCritic"]["near_goal_distance"] == pytest.approx(1.0 * scale, rel=0.02)
    assert tree["PathFollowCritic"]["threshold_to_consider"] == pytest.approx(1.4 * scale, rel=0.02)
    cells = scale * 0.05 / one.resolution.number
    assert tree["PathAlignCritic"]["offset_from_furthest"] == max(1, round(20 * cells))
    assert tree["PathAngleCritic"]["offset_from_furthest"] == max(1, round(4 * cells))


@pytest.mark.parametrize("name", ROBOTS)
def test_every_derived_value_has_its_reason(name: str) -> None:
    def reasons(tree: Any) -> list[str]:
        inside = [reasons(entry) for entry in tree.values() if isinstance(entry, dict)]
        return sum(inside, [entry.reason for entry in tree.values() if isinstance(entry, Explained)])

    trees = (controller_server(figures(name)), local_costmap(figures(name)), global_costmap(figures(name)))
    explanations = [reason for tree in trees for reason in reasons(tree)]
    assert len(explanations) > 30 and all(explanations)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_costmap_contains_the_look_ahead(name: str) -> None:
    one, tree = figures(name), values(local_costmap(figures(name)))
    assert isinstance(tree["width"], int) and tree["width"] == tree["height"] < tree["width"] + 1
    assert tree["width"] >= 2 * (one.lookahead.number + one.inflation.number) > tree["width"] - 1
    assert tree["robot_radius"] >= load_robot(name).circumscribed_radius
    assert tree["footprint_padding"] == pytest.approx(tree["resolution"] / 5)
    layer = tree["obstacle_layer"]
    for source in layer["observation_sources"].split():
        beam = layer[source]
        assert beam["obstacle_min_range"] < beam["obstacle_max_range"] <= beam["raytrace_max_range"]
        assert (
            beam["raytrace_max_range"] <= beam["obstacle_max_range"] + EXTRA_CLEARING_RANGE + 1e-9
            or source != "scan"
        )
    same = {key: value for key, value in tree.items() if key not in ("update_frequency", "width", "height")}
    assert values(global_costmap(one)) == same


@pytest.mark.parametrize("name", ROBOTS)
def test_the_camera_is_a_second_source_beside_a_lidar_only(name: str) -> None:
    sensors = load_robot(name).sensors
    sources = values(global_costmap(figures(name)))["obstacle_layer"]["observation_sources"].split()
    both = sensors.lidar is not None and sensors.depth_camera is not None
    assert sources == (["scan", "depth_scan"] if both else ["scan"])


@pytest.mark.parametrize("name", ROBOTS)
def test_ros2_control_has_the_wheels_and_limits_of_the_robot(name: str) -> None:
    robot, tree = load_robot(name), yaml.safe_load(controllers(load_robot(name)))
    manager, drive = (
        tree[node]["ros__parameters"] for node in ("controller_manager", "diff_drive_controller")
    )
    assert manager["update_rate"] == round(robot.sensors.imu.rate) and isinstance(manager["update_rate"], int)
    radius = drive["wheel_radius"] * drive["left_wheel_radius_multiplier"]
    assert radius == pytest.approx(robot.left_wheel_radius)
    track = drive["wheel_separation"] * drive["wheel_separation_multiplier"]
    assert track == pytest.approx(robot.effective_wheel_separation)
    assert drive["left_wheel_names"] == ["wheel_left_joint"]
    assert drive["right_wheel_names"] == ["wheel_right_joint"]
    for axis, speed in (("linear.x", max_speed(robot)), ("angular.z", max_turn(robot))):
        assert drive[f"{axis}.max_velocity"] == -drive[f"{axis}.min_velocity"] == pytest.approx(speed)
        assert drive[f"{axis}.max_deceleration"] <= -drive[f"{axis}.max_acceleration"] < 0.0
    assert all(math.isfinite(value) for value in drive.values() if isinstance(value, float))


def test_interface_files_have_the_docstring_and_the_fields() -> None:
    files = interface_files()
    assert all(re.fullmatch(r"msg/[A-Z]\w+\.msg|action/[A-Z]\w+\.action", path) for path in files)
    for path, text in files.items():
        assert text.startswith("# ") and not re.search(r"[ \t]$", text, re.MULTILINE), path
        if path.startswith("msg/"):
            kind = message_type(f"chefbot_msgs/msg/{path[4:-4]}")
            fields = [line.split()[1] for line in text.splitlines() if line and line[0] != "#"]
            assert [field.partition("=")[0] for field in fields] == list(kind.__struct_fields__), path
    assert files["action/Deliver.action"].count("---\n") == 2
