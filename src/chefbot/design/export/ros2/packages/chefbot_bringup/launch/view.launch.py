"""Show the displays that this file is named after in RViz: of the robot, or also of its navigation."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SHARE = Path(get_package_share_directory("chefbot_bringup"))
DISPLAYS = Path(__file__).name.removeprefix("view_").removesuffix(".launch.py")


def generate_launch_description():
    """Return RViz with its settings of the same name."""
    time = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "use_sim_time",
                default_value="true",
                description="time from /clock",
                choices=["true", "false"],
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                output="screen",
                arguments=["-d", str(SHARE / "rviz" / f"{DISPLAYS}.rviz")],
                parameters=[time],
            ),
        ]
    )
