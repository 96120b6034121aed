"""Publish the simulated depth camera and the laser scan made from its images."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

SHARE = Path(get_package_share_directory("chefbot_bringup"))
ROBOT = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())


def generate_launch_description():
    """Return the chefbot process with the camera."""
    robot = LaunchConfiguration("robot")
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "robot", default_value=ROBOT["robot"], description="chefbot robot: name or file"
            ),
            ExecuteProcess(cmd=["chefbot", "launch", "3dsensor", ["robot:=", robot]], output="screen"),
        ]
    )
