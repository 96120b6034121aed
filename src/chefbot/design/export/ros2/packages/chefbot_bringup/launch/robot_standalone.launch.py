"""Start the wheels, odometry and sensors of the built robot."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

SHARE = Path(get_package_share_directory("chefbot_bringup"))
ROBOT = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())
ARGUMENTS = [
    DeclareLaunchArgument("robot", default_value=ROBOT["robot"], description="chefbot robot: name or file"),
    DeclareLaunchArgument("board_port", default_value="auto", description="serial port of the motor board"),
    DeclareLaunchArgument(
        "headless", default_value="false", description="without the web page", choices=["true", "false"]
    ),
    DeclareLaunchArgument(
        "odometry",
        default_value="chefbot",
        description="chefbot's odometry, or robot_localization",
        choices=["chefbot", "ekf"],
    ),
]


def generate_launch_description():
    """Return base.launch.py with the motor board."""
    arguments = {argument.name: LaunchConfiguration(argument.name) for argument in ARGUMENTS}
    base = PythonLaunchDescriptionSource(str(SHARE / "launch" / "base.launch.py"))
    return LaunchDescription(
        [
            *ARGUMENTS,
            IncludeLaunchDescription(base, launch_arguments={"base": "built", **arguments}.items()),
        ]
    )
