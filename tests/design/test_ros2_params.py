"""Parameters for Nav2, slam_toolbox and robot_localization: physics, names, types, and a reason for each."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tests.design.known_parameters import DISTRIBUTIONS
from tests.design.parameter_check import faults

from chefbot.design.errors import DesignError
from chefbot.design.export.ros2 import annotated_yaml
from chefbot.design.export.ros2.annotated_yaml import Explained, plain_values, with_template, yaml_scalar
from chefbot.design.export.ros2.depth_to_scan import depth_to_scan
from chefbot.design.export.ros2.derived_nav_params import Figures, OdometryErrors
from chefbot.design.export.ros2.ekf import STATE, ekf, ekf_tree
from chefbot.design.export.ros2.nav2 import nav2_params, nav2_tree
from chefbot.design.export.ros2.odometry_noise import MARGIN, alphas
from chefbot.design.export.ros2.slam import slam_toolbox, slam_tree
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.motion_limits import max_acceleration, max_speed, max_turn, max_turn_acceleration
from chefbot.robot.spec import Robot
from chefbot.robot.validation import check_buildable

FLOOR = OdometryErrors(slip=0.003, diameter_error=0.003, separation_error=0.005)
ROBOTS = sorted(built_in_robots())


def derived(robot: Robot) -> Figures:
    return Figures(robot, FLOOR)


def nav2(robot: Robot) -> dict[str, Any]:
    """The file as ROS 2 reads it, node to parameters."""
    nodes = yaml.safe_load(nav2_params(derived(robot)))
    return {
        name: (inside.get(name) or inside)[
            "ros__parameters"
        ]  # a costmap is a node in a namespace of its name
        for name, inside in nodes.items()
    }


def params(text: str) -> dict[str, Any]:
    (node,) = yaml.safe_load(text).values()
    found: dict[str, Any] = node["ros__parameters"]
    return found


def stopping_distance(speed: float, brake: float, reaction: float, dt: float = 1e-4) -> float:
    """Metres, by small steps."""
    travelled = speed * reaction
    while speed > 0.0:
        travelled += speed * dt
        speed -= brake * dt
    return travelled


def check_physics(robot: Robot) -> None:
    """What must hold for any robot."""
    nodes = nav2(robot)
    control, costs = nodes["controller_server"], nodes["local_costmap"]
    mppi, dwb, smoother = control["FollowPath"], control["DWB"], nodes["velocity_smoother"]
    slack = 1e-9
    for speed in (mppi["vx_max"], dwb["max_vel_x"], smoother["max_velocity"][0]):
        assert 0.0 < speed <= max_speed(robot) + slack
    for turn in (mppi["wz_max"], dwb["max_vel_theta"], smoother["max_velocity"][2]):
        assert 0.0 < turn <= max_turn(robot) + slack
    for a in (
        mppi["ax_max"],
        -mppi["ax_min"],
        dwb["acc_lim_x"],
        smoother["max_accel"][0],
        -dwb["decel_lim_x"],
    ):
        assert 0.0 < a <= max_acceleration(robot) + slack
    assert mppi["az_max"] <= max_turn_acceleration(robot) + slack
    period = 1.0 / control["controller_frequency"]
    assert abs(mppi["model_dt"] - period) < 1e-6  # beyond that MPPI does not shift its sequence, or refuses
    horizon = mppi["model_dt"] * mppi["time_steps"]
    reaction = 1.0 / derived(robot).scan_sensor.rate + period
    assert horizon >= reaction + max_speed(robot) / max_acceleration(robot) - 1e-3
    assert nodes["behavior_server"]["max_rotational_vel"] <= max_turn(robot) + slack

    scan_sensor = derived(robot).scan_sensor
    if (
        mppi["vx_max"] < max_speed(robot) - 2e-4
    ):  # slower than it could: then because of what it sees, and not much
        needed_range = (
            stopping_distance(mppi["vx_max"], mppi["ax_max"], 1.0 / scan_sensor.rate + 0.1)
            + robot.circumscribed_radius
        )
        assert 0.98 * scan_sensor.range_max <= needed_range <= scan_sensor.range_max + 1e-3
    radius, inflation = costs["robot_radius"], costs["inflation_layer"]["inflation_radius"]
    assert robot.circumscribed_radius <= radius <= robot.circumscribed_radius + 2e-4
    needed = stopping_distance(mppi["vx_max"], mppi["ax_max"], reaction)
    assert inflation >= radius + needed - 1e-3
    edge = math.exp(-costs["inflation_layer"]["cost_scaling_factor"] * (inflation - radius))
    assert 0.05 < edge < 0.3
    assert costs["resolution"] <= max(min(0.05, radius / 3 * 1.001), 0.01)
    assert isinstance(costs["width"], int) and costs["width"] / 2 >= mppi["vx_max"] * horizon * 0.9 + radius
    assert mppi["prune_distance"] >= mppi["vx_max"] * horizon
    scan = costs["obstacle_layer"]["scan"]
    assert scan["obstacle_min_range"] < scan["obstacle_max_range"] <= scan["raytrace_max_range"]
    assert scan["max_obstacle_height"] > overall_height(robot)
    assert nodes["global_costmap"]["inflation_layer"] == costs["inflation_layer"]
    monitor = nodes["collision_monitor"]["FootprintApproach"]
    assert monitor["time_before_collision"] >= mppi["vx_max"] / mppi["ax_max"]
    assert mppi["vx_max"] * monitor["simulation_time_step"] <= costs["resolution"]


def check_names(robot: Robot) -> None:
    figures = derived(robot)
    texts = [nav2_params(figures), slam_toolbox(figures), ekf(figures)]
    camera = robot.sensors.depth_camera
    texts += [depth_to_scan(camera)] if camera else []
    for text in texts:
        for distribution in DISTRIBUTIONS:
            assert faults(yaml.safe_load(text), distribution) == []


@pytest.mark.parametrize("name", ROBOTS)
def test_parameters_follow_every_built_in_robot(name: str) -> None:
    robot = load_robot(name)
    check_physics(robot)
    check_names(robot)


@pytest.mark.slow
@settings(max_examples=20)
@given(
    name=st.sampled_from(ROBOTS),
    wheel=st.floats(0.7, 1.4),
    track=st.floats(0.85, 1.1),
    speed=st.floats(0.02, 3.0),
    acceleration=st.floats(0.05, 3.0),
)
def test_parameters_follow_random_robots(
    name: str, wheel: float, track: float, speed: float, acceleration: float
) -> None:
    robot = load_robot(name)
    wheels = msgspec.structs.replace(
        robot.wheels, diameter=wheel * robot.wheels.diameter, separation=track * robot.wheels.separation
    )
    drive = msgspec.structs.replace(robot.drive, max_speed=speed, max_acceleration=acceleration)
    robot = msgspec.structs.replace(robot, wheels=wheels, drive=drive)
    try:
        check_buildable(robot, "a robot")
    except RobotFileError:
        assume(False)
    assume(max_speed(robot) > 0.01)
    check_physics(robot)
    check_names(robot)


def test_faster_robots_look_further_and_small_ones_closer() -> None:
    robot = load_robot("chefbot_lidar")
    slow, fast = (
        nav2(msgspec.structs.replace(robot, drive=msgspec.structs.replace(robot.drive, max_speed=v)))
        for v in (0.15, 0.45)
    )
    for value in (
        lambda nodes: nodes["local_costmap"]["inflation_layer"]["inflation_radius"],
        lambda nodes: nodes["local_costmap"]["width"],
        lambda nodes: nodes["controller_server"]["controller_frequency"],
        lambda nodes: nodes["controller_server"]["FollowPath"]["prune_distance"],
        lambda nodes: nodes["collision_monitor"]["FootprintApproach"]["time_before_collision"],
    ):
        assert value(slow) < value(fast)
    desk, porter = nav2(load_robot("desk")), nav2(load_robot("porter"))
    assert desk["local_costmap"]["resolution"] < porter["local_costmap"]["resolution"]
    assert desk["amcl"]["sigma_hit"] < porter["amcl"]["sigma_hit"]


def test_a_camera_robot_sees_less_and_never_drives_blind() -> None:
    camera, lidar = load_robot("chefbot"), load_robot("chefbot_lidar")
    seen, around = nav2(camera), nav2(lidar)
    assert seen["controller_server"]["FollowPath"]["vx_min"] == 0.0
    assert around["controller_server"]["FollowPath"]["vx_min"] < 0.0
    spec = camera.sensors.depth_camera
    assert spec is not None and lidar.sensors.lidar is not None
    assert spec.noise * seen["amcl"]["laser_max_range"] ** 2 <= 0.05 + 1e-6 < spec.noise * spec.range_max**2
    assert around["amcl"]["laser_max_range"] == lidar.sensors.lidar.range_max
    assert around["amcl"]["laser_min_range"] == lidar.sensors.lidar.range_min
    narrow, wide = params(slam_toolbox(derived(camera))), params(slam_toolbox(derived(lidar)))
    assert narrow["minimum_travel_heading"] < spec.field_of_view / 3 < wide["minimum_travel_heading"]
    sources = around["local_costmap"]["obstacle_layer"]["observation_sources"].split()
    assert sources == ["scan", "depth_scan"]
    assert seen["local_costmap"]["obstacle_layer"]["observation_sources"].split() == ["scan"]


def test_short_range_sensors_limit_the_speed() -> None:
    robot = load_robot("porter")
    assert robot.sensors.lidar is not None
    lidar = msgspec.structs.replace(robot.sensors.lidar, range_max=0.5)
    dim = msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, lidar=lidar))
    seen, dimly = (nav2(one)["controller_server"]["FollowPath"]["vx_max"] for one in (robot, dim))
    assert dimly < 0.8 * seen == pytest.approx(0.8 * max_speed(robot))
    check_physics(dim)
    assert "stops within the" in nav2_params(derived(dim)) and "stops within the" not in nav2_params(
        derived(robot)
    )


def test_a_robot_without_range_sensor_is_refused() -> None:
    robot = load_robot("desk")
    blind = msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, lidar=None))
    with pytest.raises(DesignError, match=r"neither sensors\.lidar nor sensors\.depth_camera"):
        nav2_params(derived(blind))


@pytest.mark.parametrize("name", ROBOTS)
def test_alphas_are_the_variances_of_slipping_wheels(name: str) -> None:
    """Many robots drive straight and turn, their wheels off by that noise; nothing of the formulas is used."""
    robot = load_robot(name)
    figures, chance, travel, turn = derived(robot), np.random.default_rng(1), 0.2, 0.3
    computed = {key: value.value for key, value in alphas(figures, travel, turn).items()}
    track = robot.wheels.separation

    def driven(left: float, right: float) -> tuple[float, float]:
        """Variance of length and of heading."""
        errors = [
            chance.normal(0.0, FLOOR.slip * math.sqrt(abs(s)), 40_000)
            + chance.normal(0.0, FLOOR.diameter_error, 40_000) * s
            for s in (left, right)
        ]
        share = 1.0 + chance.normal(0.0, FLOOR.separation_error, 40_000)
        heading = (right - left + errors[1] - errors[0]) / track * share
        return float(np.var((errors[0] + errors[1]) / 2)), float(np.var(heading))

    _, yaw = driven(travel, travel)
    assert computed["alpha2"] == pytest.approx(MARGIN**2 * yaw / travel**2, rel=0.05)
    _, yaw = driven(-turn * track / 2, turn * track / 2)
    assert computed["alpha1"] == pytest.approx(MARGIN**2 * yaw / turn**2, rel=0.05)
    assert math.sqrt(float(str(computed["alpha3"]))) * travel >= 0.24 * figures.resolution.number


@pytest.mark.parametrize("name", ROBOTS)
def test_scan_matching_keeps_the_bounds_of_karto(name: str) -> None:
    """Karto throws at start where a smear is not within half of and ten times the search's resolution."""
    values = params(slam_toolbox(derived(load_robot(name))))
    for search in ("correlation_search_space", "loop_search_space"):
        cell = values[f"{search}_resolution"]
        assert 0.5 * cell <= values[f"{search}_smear_deviation"] <= 10 * cell
        assert values[f"{search}_dimension"] / cell <= 160 + 1e-6
    assert values["minimum_travel_distance"] < values["link_scan_maximum_distance"]
    assert values["min_laser_range"] < values["max_laser_range"]


def leaves(tree: Any, path: str = "") -> Iterator[tuple[str, Explained]]:
    for key, value in tree.items():
        if isinstance(value, Explained) or not hasattr(value, "items"):
            yield f"{path}.{key}", value if isinstance(value, Explained) else Explained(value)
        else:
            yield from leaves(value, f"{path}.{key}")


@pytest.mark.parametrize("make", [nav2_tree, slam_tree, ekf_tree])
def test_values_that_differ_between_robots_have_a_reason(make: Any) -> None:
    trees = [dict(leaves(make(derived(load_robot(name))))) for name in ROBOTS]
    shared = set.intersection(*(set(tree) for tree in trees))
    differing = {path for path in shared if len({str(tree[path].value) for tree in trees}) > 1}
    assert differing
    silent = {path for path in differing if not all(tree[path].reason for tree in trees)}
    assert {path.rpartition(".")[2] for path in silent} <= {"observation_sources"}
    if make is nav2_tree:
        assert len(differing) > 50


def test_a_reason_contains_the_numbers_of_its_value() -> None:
    """The inflation's reason, computed again from its own text."""
    tree = dict(leaves(nav2_tree(derived(load_robot("porter")))))
    value, reason = tree[".local_costmap.local_costmap.ros__parameters.inflation_layer.inflation_radius"]
    numbers = [
        float(word.rstrip(":")) for word in reason.split() if word.rstrip(":").replace(".", "").isdigit()
    ]
    assert sum(numbers[:3]) == pytest.approx(value, rel=5e-3)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_yaml_reads_back_with_values_and_types(name: str) -> None:
    robot = load_robot(name)
    assert yaml.safe_load(nav2_params(derived(robot))) == plain_values(
        nav2_tree(derived(robot))
    ) or differs_by_digits(robot)
    assert max(len(line) for line in nav2_params(derived(robot)).splitlines() if "[" not in line) <= 112


def differs_by_digits(robot: Robot) -> bool:
    """Nine digits are written; a period such as 1/15 s has more."""
    read = dict(leaves(yaml.safe_load(nav2_params(derived(robot)))))
    meant = dict(leaves(plain_values(nav2_tree(derived(robot)))))
    assert read.keys() == meant.keys()
    for path, one in meant.items():
        assert type(read[path].value) is type(one.value)
        if isinstance(one.value, float):
            assert read[path].value == pytest.approx(one.value, rel=1e-8)
        else:
            assert read[path].value == one.value
    return True


@given(
    st.floats(allow_nan=False, allow_infinity=False)
    | st.integers(-(2**31), 2**31)
    | st.booleans()
    | st.text()
)
def test_a_written_value_keeps_its_type(value: Any) -> None:
    if isinstance(value, str):
        assume(value.isprintable())
    read = yaml.safe_load(yaml_scalar(value))
    assert type(read) is type(value)
    assert read == (pytest.approx(value, rel=1e-8) if isinstance(value, float) else value)


def test_the_filter_fuses_wheels_and_gyro_once_each() -> None:
    robot = load_robot("chefbot")
    filter_ = params(ekf(derived(robot)))
    wheels = {name for name, on in zip(STATE, filter_["odom0_config"], strict=True) if on}
    gyro = {name for name, on in zip(STATE, filter_["imu0_config"], strict=True) if on}
    assert wheels == {"vx", "vy", "vyaw"} and gyro == {"vyaw"}
    noise = np.array(filter_["process_noise_covariance"]).reshape(15, 15)
    assert np.array_equal(noise, noise.T) and np.all(np.linalg.eigvalsh(noise) > 0.0)
    imu = msgspec.structs.replace(robot.sensors.imu, gyro_bias=0.5)
    bad = msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, imu=imu))
    assert "imu0" not in params(ekf(derived(bad)))
    check_names(bad)


def test_a_template_value_without_a_derived_one_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.yaml").write_text("node: {fixed: 1, derived: }\n")
    monkeypatch.setattr(annotated_yaml, "TEMPLATES", tmp_path)
    assert with_template("a.yaml", {"node": {"derived": 2.0}}) == {"node": {"fixed": 1, "derived": 2.0}}
    with pytest.raises(DesignError, match="derived has no derived value"):
        with_template("a.yaml", {"node": {}})


def damaged(change: Any) -> list[str]:
    nodes = copy.deepcopy(yaml.safe_load(nav2_params(derived(load_robot("chefbot")))))
    change(nodes)
    return faults(nodes)


def test_the_table_finds_parameters_that_ros_would_refuse() -> None:
    def control(nodes: Any) -> Any:
        return nodes["controller_server"]["ros__parameters"]

    assert damaged(dict) == []
    (fault,) = damaged(lambda nodes: control(nodes).update(controler_frequency=20.0))
    assert "controler_frequency" in fault and "controller_frequency" in fault
    (fault,) = damaged(lambda nodes: control(nodes).update(controller_frequency=20))
    assert "must be double, 20 is int" in fault
    (fault,) = damaged(
        lambda nodes: control(nodes)["FollowPath"].update(plugin="nav2_mppi_controler::MPPIController")
    )
    assert "nav2_mppi_controller::MPPIController" in fault
    (fault,) = damaged(lambda nodes: control(nodes).pop("DWB"))
    assert "'DWB' is listed and not described" in fault
    (fault,) = damaged(lambda nodes: control(nodes)["FollowPath"]["critics"].append("TwirlingCritic"))
    assert "TwirlingCritic" in fault
    (fault,) = damaged(lambda nodes: nodes.update(amcl={"alpha1": 0.2}))
    assert "ros__parameters" in fault
    costs = damaged(
        lambda nodes: nodes["local_costmap"]["local_costmap"]["ros__parameters"].update(width=3.0)
    )
    assert len(costs) == 1 and "must be int" in costs[0]
    extra = {"controller_server": {"ros__parameters": {"publish_zero_velocity": True}}}
    assert faults(extra, "kilted") == [] and len(faults(extra, "jazzy")) == 1
