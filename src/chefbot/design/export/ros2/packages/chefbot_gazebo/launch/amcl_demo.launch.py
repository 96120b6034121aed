"""Navigate on a saved map in Gazebo with AMCL and Nav2."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

SHARE = Path(get_package_share_directory("chefbot_gazebo"))
ROBOT = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())
WORLD_ARGUMENTS = [
    DeclareLaunchArgument(
        "world", default_value="hotel", description="world of this package", choices=list(ROBOT["start"])
    ),
    DeclareLaunchArgument(
        "gui", default_value="true", description="with the window of Gazebo", choices=["true", "false"]
    ),
    DeclareLaunchArgument(
        "odometry",
        default_value="gazebo",
        description="odometry by Gazebo, or by robot_localization",
        choices=["gazebo", "ekf"],
    ),
]
MAP_ARGUMENTS = [
    DeclareLaunchArgument("map_file", description="YAML file of the map"),
    DeclareLaunchArgument("initial_pose_x", default_value="0.0", description="initial x on the map, m"),
    DeclareLaunchArgument("initial_pose_y", default_value="0.0", description="initial y on the map, m"),
    DeclareLaunchArgument("initial_pose_a", default_value="0.0", description="initial yaw on the map, rad"),
]


def installed(package, *path):
    """Return the path of an installed file, found when the launch runs."""
    return PathJoinSubstitution([FindPackageShare(package), *path])


def included(file, **arguments):
    """Return the include of a launch file with its arguments."""
    return IncludeLaunchDescription(PythonLaunchDescriptionSource(file), launch_arguments=arguments.items())


def generate_launch_description():
    """Return Gazebo, localization and navigation."""
    world = [str(SHARE / "launch"), "/chefbot_", LaunchConfiguration("world"), "_world.launch.py"]
    options = {name: LaunchConfiguration(name) for name in ("gui", "odometry")}
    start = {argument.name: LaunchConfiguration(argument.name) for argument in MAP_ARGUMENTS}
    bringup = ("localization.launch.py", start), ("navigation.launch.py", {})
    return LaunchDescription(
        [
            *MAP_ARGUMENTS,
            *WORLD_ARGUMENTS,
            included(world, **options),
            *(
                included(installed("chefbot_bringup", "launch", name), use_sim_time="true", **arguments)
                for name, arguments in bringup
            ),
        ]
    )
