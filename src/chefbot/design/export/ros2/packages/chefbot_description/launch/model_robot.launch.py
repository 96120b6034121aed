"""Show the robot model in RViz, with a slider for each wheel."""

from pathlib import Path
from shlex import quote

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SHARE = Path(get_package_share_directory("chefbot_description"))
ROBOT = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())


def generate_launch_description():
    """Return the state publishers and RViz."""
    file = quote(str(SHARE / "urdf" / f"{ROBOT['name']}.urdf.xacro"))  # Command splits its text at spaces
    model = Command(["xacro ", file, " prefix:=", LaunchConfiguration("prefix")])
    gui = LaunchConfiguration("gui")
    return LaunchDescription(
        [
            DeclareLaunchArgument("prefix", default_value='""', description="prefix of every link name"),
            DeclareLaunchArgument("gui", default_value="true", description="sliders for the wheels"),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                parameters=[{"robot_description": ParameterValue(model, value_type=str)}],
            ),
            Node(
                package="joint_state_publisher_gui",
                executable="joint_state_publisher_gui",
                condition=IfCondition(gui),
            ),
            Node(
                package="joint_state_publisher",
                executable="joint_state_publisher",
                condition=UnlessCondition(gui),
            ),
            Node(package="rviz2", executable="rviz2", arguments=["-d", str(SHARE / "rviz" / "robot.rviz")]),
        ]
    )
