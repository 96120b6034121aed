"""Start Gazebo with the world that this file is named after, and the robot at its start."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription

SHARE = Path(get_package_share_directory("chefbot_gazebo"))
WORLD = Path(__file__).name.removeprefix("chefbot_").removesuffix("_world.launch.py")
START = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())["start"][WORLD]


def generate_launch_description():
    """Return gazebo.launch.py with the world and the start."""
    world = {"world": WORLD, **{name: str(value) for name, value in START.items()}}
    return LaunchDescription(
        [IncludeLaunchDescription(str(SHARE / "launch" / "gazebo.launch.py"), launch_arguments=world.items())]
    )
