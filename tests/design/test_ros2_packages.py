"""The workspace: papers, launch files run against a stand-in of `launch`, bridges against the SDF, RViz."""

from __future__ import annotations

import ast
import itertools
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import pytest
import yaml
from tests.design.fake_launch import PathJoinSubstitution, Started, needed, resolved
from tests.design.sdf_checker import read_by_libsdformat

from chefbot.cli.robot.ros2 import run_ros2
from chefbot.launcher.launch_changer import parse_arguments
from chefbot.nodes.drive_base import DriveBaseNode
from chefbot.nodes.odometry import OdometryNode
from chefbot.nodes.robot_state_publisher import RobotStatePublisherNode
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch, node_class, node_params
from chefbot.sim.world.world import built_in_worlds

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
PACKAGES = ("chefbot_description", "chefbot_bringup", "chefbot_gazebo")
CHAPTER = {
    "chefbot_bringup": {"robot_standalone", "gmapping_demo", "amcl_demo", "keyboard_teleop", "view_robot",
                        "view_navigation", "3dsensor"},
    "chefbot_gazebo": {"chefbot_empty_world", "chefbot_hotel_world", "gmapping_demo", "amcl_demo"},
    "chefbot_description": {"model_robot"},
}  # fmt: skip


@pytest.fixture(scope="module", params=["chefbot", "desk"])
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """A robot with a camera alone and one with a lidar alone, and its workspace."""
    out = tmp_path_factory.mktemp(request.param) / "ws" / "src"
    run_ros2(request.param, out)
    return request.param, out


def manifest(package: Path) -> ET.Element:
    return ET.parse(package / "package.xml").getroot()


@pytest.mark.parametrize("name", PACKAGES)
def test_package_metadata_follows_rep_149(made: tuple[str, Path], name: str) -> None:
    package = made[1] / name
    root = manifest(package)
    assert root.tag == "package" and root.attrib == {"format": "3"}
    tags = [child.tag for child in root]
    for once in ("name", "version", "description"):
        assert tags.count(once) == 1
    assert root.findtext("name") == name and re.fullmatch(r"[a-z][a-z0-9_]*", name)
    assert re.fullmatch(r"\d+\.\d+\.\d+", root.findtext("version") or "")
    assert all("@" in one.attrib["email"] and one.text for one in root.findall("maintainer"))
    assert root.findall("maintainer") and root.findtext("license") == "Apache-2.0"
    assert root.findtext("buildtool_depend") == root.findtext("export/build_type") == "ament_cmake"
    depends = [one.text for one in root.iterfind("exec_depend")]
    assert len(depends) == len(set(depends)) and name not in depends
    assert all(re.fullmatch(r"[a-z][a-z0-9_-]*", one or "") for one in depends)
    cmake = (package / "CMakeLists.txt").read_text()
    assert f"project({name} " in cmake and cmake.rstrip().endswith("ament_package()")
    (installed,) = re.findall(r"install\(DIRECTORY ([\w ]+) DESTINATION", cmake)
    assert set(installed.split()) == {one.name for one in package.iterdir() if one.is_dir()}


@pytest.mark.parametrize("name", PACKAGES)
def test_the_chapter_launches_exist_and_are_python(made: tuple[str, Path], name: str) -> None:
    robot, out = made
    files = sorted((out / name / "launch").glob("*.launch.py"))
    names = {file.name.removesuffix(".launch.py") for file in files}
    missing = CHAPTER[name] - names
    assert missing == ({"3dsensor"} if robot == "desk" and name == "chefbot_bringup" else set())
    for file in files:
        tree = ast.parse(file.read_text())
        compile(tree, str(file), "exec")
        assert ast.get_docstring(tree)
        imported = {
            one.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for one in node.names
        }
        used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        assert imported <= used


# -- what a launch file takes

BASE = ("robot", "base", "odometry", "world", "board_port", "headless")
START = ("map_file", "initial_pose_x", "initial_pose_y", "initial_pose_a")
GAZEBO = ("world", "gui", "odometry")
ARGUMENTS = {
    "chefbot_bringup": {
        "3dsensor": {"robot"},
        "amcl_demo": {"stack", *BASE, *START, "use_sim_time"},
        "base": {*BASE},
        "gmapping_demo": {"stack", *BASE, "use_sim_time"},
        "keyboard_teleop": {"stack"},
        "localization": {*START, "use_sim_time"},
        "navigation": {"use_sim_time"},
        "robot_standalone": {*BASE},
        "view_navigation": {"use_sim_time"},
        "view_robot": {"use_sim_time"},
    },
    "chefbot_gazebo": {
        "amcl_demo": {*GAZEBO, *START, "use_sim_time"},
        "chefbot_hotel_world": {*GAZEBO, "x", "y", "yaw"},
        "gazebo": {*GAZEBO, "x", "y", "yaw"},
        "gmapping_demo": {*GAZEBO, "use_sim_time"},
    },
}
VALUES = {
    "chefbot_bringup": {"base": ["simulation", "built"], "odometry": ["chefbot", "ekf"]},
    "chefbot_gazebo": {
        "gui": ["true", "false"], "odometry": ["gazebo", "ekf"], "world": ["hotel", *built_in_worlds()],
    },
}  # fmt: skip
"""The default, then what else may be given."""
SHARED_VALUES = {
    "board_port": ["auto"], "headless": ["false", "true"], "initial_pose_a": ["0.0"], "initial_pose_x": ["0.0"],
    "initial_pose_y": ["0.0"], "map_file": [None], "stack": ["chefbot", "nav2"], "use_sim_time": ["true", "false"],
    "world": ["hotel"], "x": ["0.0"], "y": ["0.0"], "yaw": ["0.0"],
}  # fmt: skip


@pytest.mark.parametrize("name", ARGUMENTS)
def test_launch_files_list_their_arguments(
    made: tuple[str, Path], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As `ros2 launch --show-args` does, also those of included files."""
    robot, out = made
    values = SHARED_VALUES | VALUES[name] | {"robot": [robot]}
    for launch, expected in ARGUMENTS[name].items():
        file = out / name / "launch" / f"{launch}.launch.py"
        if launch == "3dsensor" and robot == "desk":
            continue
        shown = Started(out, monkeypatch).arguments(file)
        assert set(shown) == expected, launch
        for one in shown.values():
            default, *others = values[one.name]
            assert one.default_value == default and one.description
            assert set(one.choices or ()) == ({default, *others} if others else set())


# -- what a launch starts, for every choice of its arguments


def all_choices(file: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, str]]:
    arguments = Started(out, monkeypatch).arguments(file).values()
    chosen = [one for one in arguments if one.choices]
    required = {one.name: "runs/map.yaml" for one in arguments if one.default_value is None}
    for values in itertools.product(*(one.choices or [] for one in chosen)):
        yield required | dict(zip((one.name for one in chosen), values, strict=True))


@pytest.mark.rotated("exported packages and worlds")
@pytest.mark.parametrize("name", ["chefbot_bringup", "chefbot_gazebo"])
@pytest.mark.slow
def test_every_launch_starts_what_exists(
    made: tuple[str, Path], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, out = made
    for file in sorted((out / name / "launch").glob("*.launch.py")):
        for arguments in all_choices(file, out, monkeypatch):
            started = Started(out, monkeypatch)
            started.run(file, arguments)
            starts = not file.name.endswith("_arguments.launch.py")
            assert bool(started.nodes or started.commands) == starts, (file.name, arguments)
            check_nodes(started, out, name)
            check_commands(started)
            check_foreign(started)


@lru_cache
def described(file: str) -> frozenset[str]:
    """The nodes that a parameter file is about."""
    return frozenset(yaml.safe_load(Path(file).read_text()))


def check_nodes(started: Started, out: Path, package: str) -> None:
    names = [node.name for node, _ in started.nodes if node.name]
    assert len(names) == len(set(names))
    for node, arguments in started.nodes:
        assert node.package in needed(out / package) | needed(out / "chefbot_bringup")
        for given in node.parameters:
            if isinstance(given, str | PathJoinSubstitution):
                given = resolved(given, arguments, out)
                assert node.name in described(given), f"{given} does not mention {node.name}"
            elif "config_file" in given:
                assert Path(resolved(given["config_file"], arguments, out)).is_file()
            elif "node_names" in given:
                assert set(given["node_names"]) <= set(names)
        for word in node.arguments:
            text = resolved(word, arguments, out)
            assert not text.endswith((".rviz", ".sdf")) or Path(text).is_file()


def check_commands(started: Started) -> None:
    """Our own nodes: the launch is read, every argument known, every class there."""
    for command in started.commands:
        check_command(tuple(command))


@lru_cache
def check_command(command: tuple[str, ...]) -> None:
    assert command[:2] == ("chefbot", "launch")
    launch = load_launch(command[2], parse_arguments(command[3:]))
    for node, entry in launch.nodes.items():
        node_params(node_class(entry.kind, node), entry.params, node)


def check_foreign(started: Started) -> None:
    for path, passed in started.foreign:
        if path.name == "online_async_launch.py":
            assert set(passed) == {"use_sim_time", "slam_params_file"}
            assert Path(passed["slam_params_file"]).is_file() and passed["use_sim_time"] in ("true", "false")
        else:
            assert path.name == "gz_sim.launch.py" and set(passed) == {"gz_args"}
            assert Path(passed["gz_args"].split()[-1]).is_file()


def of(made: tuple[str, Path], file: str, monkeypatch: pytest.MonkeyPatch, **arguments: str) -> Started:
    started = Started(made[1], monkeypatch)
    started.run(made[1] / file, arguments)
    return started


def test_nav2_commands_are_the_only_ones_at_the_base(
    made: tuple[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Controller and behaviours -> smoother -> collision monitor -> the topic that our base takes."""
    started = of(made, "chefbot_bringup/launch/gmapping_demo.launch.py", monkeypatch, stack="nav2")
    topics = {node.name: dict(node.remappings).get("cmd_vel", "cmd_vel") for node, _ in started.nodes}
    assert topics["controller_server"] == topics["behavior_server"] == topics["velocity_smoother"]
    params = yaml.safe_load((made[1] / "chefbot_bringup/config/nav2_params.yaml").read_text())
    monitor = params["collision_monitor"]["ros__parameters"]
    assert monitor["cmd_vel_in_topic"] == "cmd_vel_smoothed"  # the smoother's own name for what it gives
    assert monitor["cmd_vel_out_topic"] in DriveBaseNode.__annotations__
    teleop = of(made, "chefbot_bringup/launch/keyboard_teleop.launch.py", monkeypatch, stack="nav2")
    assert dict(teleop.nodes[0][0].remappings)["cmd_vel"] in DriveBaseNode.__annotations__


def test_one_node_publishes_odometry_and_none_of_ours_the_map(
    made: tuple[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for base, odometry in itertools.product(("simulation", "built"), ("chefbot", "ekf")):
        started = of(made, "chefbot_bringup/launch/base.launch.py", monkeypatch, base=base, odometry=odometry)
        (command,) = started.commands
        launch = load_launch(command[2], parse_arguments(command[3:]))
        assert launch.clock == {"simulation": "simulation", "built": "wall"}[base]
        assert all("static_transform" not in entry.kind for entry in launch.nodes.values())
        (publisher,) = [one for one in launch.nodes.values() if node_class(one.kind, "") is OdometryNode]
        filters = [node for node, _ in started.nodes if node.package == "robot_localization"]
        assert len(filters) == (odometry == "ekf")
        assert ("odom" in publisher.remap and "tf" in publisher.remap) == (odometry == "ekf")
        if filters:
            config = yaml.safe_load((made[1] / "chefbot_bringup/config/ekf.yaml").read_text())
            assert config["ekf_filter_node"]["ros__parameters"]["odom0"] == publisher.remap["odom"]
            assert dict(filters[0].remappings)["odometry/filtered"] == "odom"


def test_one_node_publishes_the_robot_description(
    made: tuple[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two latched /robot_description would reach a subscriber in any order."""
    for base, odometry in itertools.product(("simulation", "built"), ("chefbot", "ekf")):
        started = of(made, "chefbot_bringup/launch/base.launch.py", monkeypatch, base=base, odometry=odometry)
        (command,) = started.commands
        launch = load_launch(command[2], parse_arguments(command[3:]))
        ours = [one for one in launch.nodes.values() if node_class(one.kind, "") is RobotStatePublisherNode]
        theirs = [node for node, _ in started.nodes if node.package == "robot_state_publisher"]
        assert len(ours) + len(theirs) == 1


def test_navigation_for_another_base_has_a_launch(made: tuple[str, Path]) -> None:
    """It commands the other's wheels, and nothing in it publishes odometry or the body's frames."""
    file = str(made[1] / "chefbot_bringup" / "chefbot" / "your_robot.yaml")
    check_command(("chefbot", "launch", file, f"robot:={made[0]}", "map_file:=runs/map.yaml"))
    kinds = {entry.kind.rpartition(":")[2] for entry in load_launch(file).nodes.values()}
    assert {"DriveBaseNode", "AmclNode", "PlannerNode", "ControllerNode", "NavigatorNode"} <= kinds
    assert not {"OdometryNode", "RobotStatePublisherNode", "MotorBoardDevice", "SimulatorDevice"} & kinds


def test_bridges_use_the_topics_of_the_model(made: tuple[str, Path]) -> None:
    robot, out = made
    model = ET.parse(out / "chefbot_gazebo" / "models" / f"{robot}.sdf").getroot()
    topics = {f"/{one.text}" for tag in ("topic", "odom_topic", "tf_topic") for one in model.iter(tag)}
    topics |= {f"/camera/{name}" for name in ("image", "depth_image", "camera_info", "points")}
    config = out / "chefbot_gazebo" / "config"
    rows = [row for file in sorted(config.glob("bridge*.yaml")) for row in yaml.safe_load(file.read_text())]
    assert {row["gz_topic_name"] for row in rows} <= topics | {"/clock"}
    for row in rows:
        assert set(row) == {"ros_topic_name", "gz_topic_name", "ros_type_name", "gz_type_name", "direction"}
        assert row["direction"] in ("GZ_TO_ROS", "ROS_TO_GZ")
        assert re.fullmatch(r"\w+/msg/\w+", row["ros_type_name"]) and row["gz_type_name"].startswith(
            "gz.msgs."
        )
    to_ros = [row["ros_topic_name"] for row in rows if row["direction"] == "GZ_TO_ROS"]
    assert len(to_ros) == len(set(to_ros))
    assert ("/scan" in to_ros) == (load_robot(robot).sensors.lidar is not None)


def test_every_world_has_its_launch_file(made: tuple[str, Path]) -> None:
    launches = {
        file.name for file in (made[1] / "chefbot_gazebo" / "launch").glob("chefbot_*_world.launch.py")
    }
    assert launches == {f"chefbot_{world}_world.launch.py" for world in built_in_worlds()}


def test_rviz_shows_the_depth_image_of_a_camera_robot(made: tuple[str, Path]) -> None:
    for name in ("robot", "navigation"):
        file = yaml.safe_load((made[1] / "chefbot_bringup" / "rviz" / f"{name}.rviz").read_text())
        shown = {one["Class"] for one in file["Visualization Manager"]["Displays"]}
        camera = load_robot(made[0]).sensors.depth_camera
        assert ("rviz_default_plugins/Image" in shown) == (camera is not None)


@pytest.mark.rotated("exported packages and worlds")
@pytest.mark.slow
def test_worlds_wait_for_the_robot(made: tuple[str, Path]) -> None:
    robot, out = made
    worlds = sorted((out / "chefbot_gazebo" / "worlds").glob("*.sdf"))
    assert {"empty", "hotel", "room"} <= {file.stem for file in worlds}
    for file in worlds:
        assert robot not in {model.attrib["name"] for model in ET.parse(file).iter("model")}
    assert read_by_libsdformat(out / "chefbot_gazebo" / "worlds" / "empty.sdf")


def test_rviz_displays_only_published_topics(made: tuple[str, Path]) -> None:
    for name in ("robot", "navigation"):
        file = yaml.safe_load((made[1] / "chefbot_bringup" / "rviz" / f"{name}.rviz").read_text())
        manager = file["Visualization Manager"]
        topics = {one["Topic"]["Value"] for one in manager["Displays"] if "Topic" in one}
        assert "/scan" in topics
        tools = {one["Topic"]["Value"] for one in manager["Tools"] if "Topic" in one}
        assert tools == {"/goal_pose", "/initialpose"}
        if name == "navigation":
            assert {
                "/map",
                "/plan",
                "/people/poses",
                "/particle_cloud",
                "/global_costmap/costmap",
                "/local_costmap/costmap",
            } <= topics
            assert manager["Global Options"]["Fixed Frame"] == "map"
