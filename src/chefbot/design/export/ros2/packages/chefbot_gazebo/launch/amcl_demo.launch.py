"""Navigate on a saved map in Gazebo with AMCL and Nav2."""

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.substitutions import FindPackageShare

LAUNCH = f"{get_package_share_directory('chefbot_gazebo')}/launch"
BRINGUP = FindPackageShare("chefbot_bringup")


def generate_launch_description():
    """Return Gazebo, localization and navigation."""
    simulated = {"use_sim_time": "true"}
    return LaunchDescription(
        [
            DeclareLaunchArgument("map_file", description="YAML file of the map"),
            IncludeLaunchDescription(f"{LAUNCH}/world_arguments.launch.py"),
            IncludeLaunchDescription(
                [f"{LAUNCH}/chefbot_", LaunchConfiguration("world"), "_world.launch.py"]
            ),
            IncludeLaunchDescription(
                [BRINGUP, "/launch/localization.launch.py"],
                # Without a default, it has to be passed; the others are seen by an included file anyway.
                launch_arguments={**simulated, "map_file": LaunchConfiguration("map_file")}.items(),
            ),
            IncludeLaunchDescription(
                [BRINGUP, "/launch/navigation.launch.py"], launch_arguments=simulated.items()
            ),
        ]
    )
