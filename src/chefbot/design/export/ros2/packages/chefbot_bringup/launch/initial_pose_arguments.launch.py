"""Declare the initial pose on the map, for localization.launch.py and amcl_demo.launch.py; starts nothing."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument


def generate_launch_description():
    """Return the declarations; the including file sees the launch configurations that they set."""
    x, y, a = "initial x on the map, m", "initial y on the map, m", "initial yaw on the map, rad"
    return LaunchDescription(
        [
            DeclareLaunchArgument("initial_pose_x", default_value="0.0", description=x),
            DeclareLaunchArgument("initial_pose_y", default_value="0.0", description=y),
            DeclareLaunchArgument("initial_pose_a", default_value="0.0", description=a),
        ]
    )
