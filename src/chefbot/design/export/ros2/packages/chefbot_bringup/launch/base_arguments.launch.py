"""Declare the arguments of the base, for base.launch.py and the demos; starts nothing."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument

SHARE = Path(get_package_share_directory("chefbot_bringup"))
ROBOT = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())


def generate_launch_description():
    """Return the declarations; the including file sees the launch configurations that they set."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "robot", default_value=ROBOT["robot"], description="chefbot robot: name or file"
            ),
            DeclareLaunchArgument(
                "base",
                default_value="simulation",
                description="chefbot's simulator, or the built robot",
                choices=["simulation", "built"],
            ),
            DeclareLaunchArgument(
                "odometry",
                default_value="chefbot",
                description="chefbot's odometry, or robot_localization",
                choices=["chefbot", "ekf"],
            ),
            DeclareLaunchArgument(
                "world", default_value="hotel", description="simulated world: hotel, room, empty, or a file"
            ),
            DeclareLaunchArgument(
                "board_port", default_value="auto", description="serial port of the motor board"
            ),
            DeclareLaunchArgument(
                "headless",
                default_value="false",
                description="without the web UI",
                choices=["true", "false"],
            ),
        ]
    )
