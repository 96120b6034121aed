"""Build a map of a Gazebo world with slam_toolbox and Nav2."""

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

LAUNCH = f"{get_package_share_directory('chefbot_gazebo')}/launch"
BRINGUP = FindPackageShare("chefbot_bringup")


def generate_launch_description():
    """Return Gazebo, slam_toolbox and Nav2."""
    simulated = {"use_sim_time": "true"}
    params = {"slam_params_file": PathJoinSubstitution([BRINGUP, "config", "slam_toolbox.yaml"])}
    return LaunchDescription(
        [
            IncludeLaunchDescription(f"{LAUNCH}/world_arguments.launch.py"),
            IncludeLaunchDescription(
                [f"{LAUNCH}/chefbot_", LaunchConfiguration("world"), "_world.launch.py"]
            ),
            IncludeLaunchDescription(
                [FindPackageShare("slam_toolbox"), "/launch/online_async_launch.py"],
                launch_arguments={**simulated, **params}.items(),
            ),
            IncludeLaunchDescription(
                [BRINGUP, "/launch/navigation.launch.py"], launch_arguments=simulated.items()
            ),
        ]
    )
