"""The package `chefbot_gazebo`: worlds for gz-sim, the robot put into them, bridges, and Nav2 on it."""

from __future__ import annotations

from collections.abc import Mapping

from chefbot.design.export.ros2.bringup import MAP, START, ekf_action
from chefbot.design.export.ros2.bringup import PACKAGE as BRINGUP
from chefbot.design.export.ros2.gazebo_bridge import bridges
from chefbot.design.export.ros2.launch_text import (
    Argument,
    LaunchText,
    call,
    include,
    launch_file,
    listed,
    node,
    passed,
)
from chefbot.design.export.ros2.package import with_papers
from chefbot.design.export.sdf import sdf
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot

PACKAGE = "chefbot_gazebo"
DEPENDS = (
    "ament_index_python", "launch", "launch_ros", "chefbot_bringup", "chefbot_description", "ros_gz_sim",
    "ros_gz_bridge", "robot_state_publisher", "robot_localization", "xacro",
    "depthimage_to_laserscan", "slam_toolbox",
)  # fmt: skip
POSE = ("x", "y", "yaw")
SOURCE = Argument("Gazebo's own, or robot_localization", "gazebo", ("gazebo", "ekf"))
WINDOW = Argument("with Gazebo's window", "true", ("true", "false"))
SIM = 'use_sim_time="true"'
SIMULATED = '{"use_sim_time": True}'


def gazebo_package(robot: Robot, worlds: Mapping[str, tuple[str, SE2]]) -> dict[str, str]:
    """Path in the package to text. worlds: name to the SDF text without a robot, and where the robot starts."""
    files = {
        **{f"launch/{name}.launch.py": text for name, text in launches(robot, worlds).items()},
        **{f"worlds/{name}.sdf": text for name, (text, _) in worlds.items()},
        f"models/{robot.name}.sdf": sdf(robot),
        **{f"config/{name}": text for name, text in bridges(robot).items()},
    }
    about = f"The robot {robot.name} in Gazebo, written by chefbot from its robot file."
    return with_papers(PACKAGE, about, DEPENDS, files)


def launches(robot: Robot, worlds: Mapping[str, tuple[str, SE2]]) -> dict[str, str]:
    """Launch file's name to its text: one for each world, and the chapter's demos in any of them."""
    common = {"gui": WINDOW, "odometry": SOURCE}
    any_world = {"world": Argument("which of ours", "hotel", tuple(worlds)), **common}
    start = {name: Argument(f"where it starts, {name}: metres, radians", "0.0") for name in POSE}
    inside = in_worlds(worlds)
    texts = {
        "gazebo": LaunchText(
            "Gazebo with a world, and the robot at a pose in it.",
            {**any_world, **start},
            gazebo_actions(robot),
        ),
        "gmapping_demo": LaunchText(
            "Map a world of Gazebo with slam_toolbox and Nav2.", any_world, [*inside, *mapping()]
        ),
        "amcl_demo": LaunchText(
            "Nav2 on a saved map in Gazebo.", {"map_file": MAP, **START, **any_world}, [*inside, *localized()]
        ),
    }
    for name, (_, pose) in worlds.items():
        action = include(PACKAGE, "gazebo.launch.py", f'world="{name}"', *posed(pose), *passed(*common))
        texts[f"chefbot_{name}_world"] = LaunchText(f"The robot in the world {name}.", common, [action])
    return {name: launch_file(PACKAGE, robot.name, *launch) for name, launch in texts.items()}


def posed(start: SE2) -> list[str]:
    """A start as launch arguments."""
    return [f'{name}="{value:.6g}"' for name, value in zip(POSE, (start.x, start.y, start.yaw), strict=True)]


def in_worlds(worlds: Mapping[str, tuple[str, SE2]]) -> list[str]:
    """The world that is asked for, by its own launch file, which knows the start in it."""
    return [
        include(
            PACKAGE,
            f"chefbot_{name}_world.launch.py",
            f'only_if=only("world", "{name}")',
            *passed("gui", "odometry"),
        )
        for name in worlds
    ]


def gazebo_actions(robot: Robot) -> list[str]:
    """Simulator, robot, bridges, model, filter, and the camera's scan where there is no lidar."""
    world = 'str(SHARE / "worlds"), "/", LaunchConfiguration("world"), ".sdf"'
    where = [f'"-{"Y" if name == "yaw" else name}", LaunchConfiguration("{name}")' for name in POSE]
    model = f'"-file", str(SHARE / "models" / "{robot.name}.sdf"), "-name", "{robot.name}"'
    config = listed(
        ['str(SHARE / "config" / "bridge_odometry_")', 'LaunchConfiguration("odometry")', '".yaml"']
    )
    actions = [
        *(
            include(
                "ros_gz_sim",
                "gz_sim.launch.py",
                f'only_if=only("gui", "{gui}")',
                f'gz_args=["{how}", {world}]',
            )
            for gui, how in (("true", "-r "), ("false", "-r -s "))
        ),
        node("ros_gz_sim", "create", f"arguments={listed([model, *where])}"),
        _bridge("bridge", 'str(SHARE / "config" / "bridge.yaml")'),
        _bridge("bridge_odometry", call("ParameterValue", [config, "value_type=str"])),
        model_action(robot),
        ekf_action(SIMULATED),
    ]
    return [*actions, depth_action()] if robot.sensors.lidar is None else actions


def model_action(robot: Robot) -> str:
    """The model and its transforms; Gazebo tells where the joints are, on /joint_states."""
    described = listed([f'model("{robot.name}")', SIMULATED])
    return node("robot_state_publisher", "robot_state_publisher", f"parameters={described}")


def _bridge(name: str, config: str) -> str:
    params = listed([call("dict", [f"config_file={config}"])])
    return node("ros_gz_bridge", "parameter_bridge", f'name="{name}"', f"parameters={params}")


def depth_action() -> str:
    """The scan of a robot without a lidar."""
    names = ('("depth", "/camera/depth/image_raw")', '("depth_camera_info", "/camera/depth/camera_info")')
    return node(
        "depthimage_to_laserscan",
        "depthimage_to_laserscan_node",
        'name="depthimage_to_laserscan"',
        f"parameters={listed([_config('depth_to_scan'), SIMULATED])}",
        f"remappings={listed(names)}",
    )


def _config(name: str) -> str:
    return f'installed("{BRINGUP}", "config", "{name}.yaml")'


def mapping() -> list[str]:
    """slam_toolbox and Nav2."""
    params = f"slam_params_file={_config('slam_toolbox')}"
    return [
        include("slam_toolbox", "online_async_launch.py", SIM, params),
        include(BRINGUP, "navigation.launch.py", SIM),
    ]


def localized() -> list[str]:
    """AMCL and Nav2."""
    return [
        include(BRINGUP, "localization.launch.py", SIM, *passed("map_file", *START)),
        include(BRINGUP, "navigation.launch.py", SIM),
    ]
