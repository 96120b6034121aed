"""Start the map server and AMCL of Nav2."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SHARE = Path(get_package_share_directory("chefbot_bringup"))


def value(name, value_type):
    """Return a launch argument as a parameter value of the type."""
    return ParameterValue(LaunchConfiguration(name), value_type=value_type)


def generate_launch_description():
    """Return the map server, AMCL at the initial pose, and the manager that activates them."""
    time = {"use_sim_time": value("use_sim_time", bool)}
    pose = {"x": "initial_pose_x", "y": "initial_pose_y", "yaw": "initial_pose_a"}
    initial = {f"initial_pose.{field}": value(name, float) for field, name in pose.items()}
    return LaunchDescription(
        [
            DeclareLaunchArgument("map_file", description="YAML file of the map"),
            IncludeLaunchDescription(str(SHARE / "launch" / "initial_pose_arguments.launch.py")),
            DeclareLaunchArgument(
                "use_sim_time",
                default_value="true",
                description="time from /clock",
                choices=["true", "false"],
            ),
            Node(
                package="nav2_map_server",
                executable="map_server",
                name="map_server",
                output="screen",
                parameters=[{"yaml_filename": value("map_file", str)}, time],
            ),
            Node(
                package="nav2_amcl",
                executable="amcl",
                name="amcl",
                output="screen",
                parameters=[
                    str(SHARE / "config" / "nav2_params.yaml"),
                    time,
                    {"set_initial_pose": True} | initial,
                ],
            ),
            Node(
                package="nav2_lifecycle_manager",
                executable="lifecycle_manager",
                name="lifecycle_manager_localization",
                output="screen",
                parameters=[{"autostart": True}, {"node_names": ["map_server", "amcl"]}, time],
            ),
        ]
    )
