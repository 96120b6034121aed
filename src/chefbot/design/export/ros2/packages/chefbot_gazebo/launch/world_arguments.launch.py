"""Declare the arguments of Gazebo, for gazebo.launch.py and the demos; starts nothing."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument

SHARE = Path(get_package_share_directory("chefbot_gazebo"))
WORLDS = list(yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())["start"])


def generate_launch_description():
    """Return the declarations; the including file sees the launch configurations that they set."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "world", default_value="hotel", description="world of this package", choices=WORLDS
            ),
            DeclareLaunchArgument(
                "gui",
                default_value="true",
                description="with the window of Gazebo",
                choices=["true", "false"],
            ),
            DeclareLaunchArgument(
                "odometry",
                default_value="gazebo",
                description="odometry by Gazebo, or by robot_localization",
                choices=["gazebo", "ekf"],
            ),
        ]
    )
