"""Start the servers of Nav2, without localization."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SHARE = Path(get_package_share_directory("chefbot_bringup"))
# Executable to package and to the topic of its cmd_vel:
# controller and behaviors -> velocity smoother -> collision monitor -> base.
SERVERS = {
    "controller_server": ("nav2_controller", "cmd_vel_controller"),
    "smoother_server": ("nav2_smoother", None),
    "planner_server": ("nav2_planner", None),
    "behavior_server": ("nav2_behaviors", "cmd_vel_controller"),
    "velocity_smoother": ("nav2_velocity_smoother", "cmd_vel_controller"),
    "collision_monitor": ("nav2_collision_monitor", None),
    "bt_navigator": ("nav2_bt_navigator", None),
    "waypoint_follower": ("nav2_waypoint_follower", None),
}


def generate_launch_description():
    """Return the servers and the manager that activates them in order."""
    time = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
    params = str(SHARE / "config" / "nav2_params.yaml")
    servers = [
        Node(
            package=package,
            executable=name,
            name=name,
            output="screen",
            parameters=[params, time],
            remappings=[("cmd_vel", topic)] if topic else [],
        )
        for name, (package, topic) in SERVERS.items()
    ]
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "use_sim_time",
                default_value="true",
                description="time from /clock",
                choices=["true", "false"],
            ),
            *servers,
            Node(
                package="nav2_lifecycle_manager",
                executable="lifecycle_manager",
                name="lifecycle_manager_navigation",
                output="screen",
                parameters=[{"autostart": True}, {"node_names": list(SERVERS)}, time],
            ),
        ]
    )
