"""The ROS 2 packages of a robot: files of the folder `packages`, copied, and what depends on the robot, generated.

Package format: https://www.ros.org/reps/rep-0149.html; ament_cmake:
https://docs.ros.org/en/jazzy/How-To-Guides/Ament-CMake-Documentation.html
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from chefbot.design.export.ros2.annotated_yaml import Tree, yaml_text
from chefbot.design.export.ros2.depth_to_scan import depth_to_scan
from chefbot.design.export.ros2.derived_nav_params import Figures, OdometryErrors
from chefbot.design.export.ros2.ekf import ekf
from chefbot.design.export.ros2.interfaces import interface_files
from chefbot.design.export.ros2.nav2 import nav2_params
from chefbot.design.export.ros2.ros2_control import controllers
from chefbot.design.export.ros2.slam import slam_toolbox
from chefbot.design.export.sdf import sdf
from chefbot.design.export.urdf_xacro import mesh_files, xacro_files
from chefbot.design.solids.stl_obj import stl
from chefbot.design.solids.triangulation import part_mesh
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot

DESCRIPTION, BRINGUP, GAZEBO, MESSAGES = (
    "chefbot_description",
    "chefbot_bringup",
    "chefbot_gazebo",
    "chefbot_msgs",
)
PACKAGES = Path(__file__).parent / "packages"
"""The static files, one folder for each package."""
CAMERA_DISPLAYS = ("rviz_default_plugins/Image", "rviz_default_plugins/PointCloud2")
RVIZ = ("robot", "navigation")
"""RViz's settings, each with a launch file that shows them."""
Files = dict[str, bytes]
"""Path in a package to content."""


def description_package(robot: Robot) -> Files:
    """Return the files of chefbot_description: model, meshes and a launch file for RViz. Loads the CAD libraries."""
    texts = {
        "config/robot.yaml": _robot_config(robot, {"name": robot.name}),
        "config/controllers.yaml": controllers(robot),
        **{f"urdf/{name}": text for name, text in xacro_files(robot, DESCRIPTION).items()},
    }
    meshes = {f"meshes/{name}": stl(part_mesh(solids)) for name, solids in mesh_files(robot).items()}
    return _static(DESCRIPTION) | _encoded(texts) | meshes


def bringup_package(robot: Robot, name_or_file: str, odometry_errors: OdometryErrors) -> Files:
    """Return the files of chefbot_bringup: launch files and parameters of chefbot's nodes and of Nav2.

    name_or_file: default of the launch argument robot, as `chefbot launch` takes it. UserError for a robot without
    a sensor for navigation.
    """
    camera, static, figures = robot.sensors.depth_camera, _static(BRINGUP), Figures(robot, odometry_errors)
    view = static.pop("launch/view.launch.py")
    static |= {f"launch/view_{name}.launch.py": view for name in RVIZ}
    texts = {
        "config/robot.yaml": _robot_config(robot, {"robot": name_or_file}),
        "config/nav2_params.yaml": nav2_params(figures),
        "config/slam_toolbox.yaml": slam_toolbox(figures),
        "config/ekf.yaml": ekf(figures),
    }
    if camera is None:
        _remove_camera(static)
    else:
        texts["config/depth_to_scan.yaml"] = depth_to_scan(camera)
    return static | _encoded(texts)


def _remove_camera(static: Files) -> None:
    """Remove the camera's launch file, and its displays in RViz's settings."""
    del static["launch/3dsensor.launch.py"]
    for name in RVIZ:
        file = f"rviz/{name}.rviz"
        for kind in CAMERA_DISPLAYS:
            static[file] = _without_display(static[file], kind)


def gazebo_package(robot: Robot, worlds: Mapping[str, tuple[str, SE2]]) -> Files:
    """Return the files of chefbot_gazebo: worlds, model, bridges and launch files.

    worlds: name to the SDF text without a robot and the robot's initial pose.
    """
    static = _static(GAZEBO)
    bridge, sensors = static["config/bridge.yaml"], robot.sensors
    for name in ("lidar", "ultrasonic", "depth_camera", "color_camera"):
        rows = static.pop(f"config/bridge_{name}.yaml")
        bridge += b"" if getattr(sensors, name) is None else rows
    rows = static.pop("config/bridge_depth_camera_picture.yaml")
    bridge += rows if sensors.depth_camera is not None and sensors.color_camera is None else b""
    launch = static.pop("launch/chefbot_world.launch.py")
    static |= {f"launch/chefbot_{name}_world.launch.py": launch for name in worlds}
    start: Tree = {name: {"x": pose.x, "y": pose.y, "yaw": pose.yaw} for name, (_, pose) in worlds.items()}
    config: Tree = {"name": robot.name, "lidar": robot.sensors.lidar is not None, "start": start}
    texts = {
        "config/robot.yaml": _robot_config(robot, config),
        f"models/{robot.name}.sdf": sdf(robot),
        **{f"worlds/{name}.sdf": text for name, (text, _) in worlds.items()},
    }
    return static | {"config/bridge.yaml": bridge} | _encoded(texts)


def message_package() -> Files:
    """Return the files of chefbot_msgs: the messages and actions of chefbot in ROS 2's interface format."""
    return _static(MESSAGES) | _encoded(interface_files())


def _static(package: str) -> Files:
    home = PACKAGES / package
    paths = sorted(path for path in home.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(home).as_posix(): path.read_bytes() for path in paths}


def _encoded(texts: Mapping[str, str]) -> Files:
    return {path: text.encode() for path, text in texts.items()}


def _robot_config(robot: Robot, values: Tree) -> str:
    return yaml_text(values, f"What the launch files read about the robot {robot.name}; written by chefbot.")


def _without_display(rviz: bytes, kind: str) -> bytes:
    """Remove the displays of a class; a display starts with its class at an indentation of four."""
    return re.sub(rb"    - Class: " + re.escape(kind.encode()) + rb"\n(?:      .*\n)*", b"", rviz)
