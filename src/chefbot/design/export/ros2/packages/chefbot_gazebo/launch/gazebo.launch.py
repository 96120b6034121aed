"""Start Gazebo with a world and the robot at a pose in it."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.substitutions import Command, EqualsSubstitution, LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SHARE = Path(get_package_share_directory("chefbot_gazebo"))
ROBOT = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())
SIMULATED = {"use_sim_time": True}
ARGUMENTS = [
    IncludeLaunchDescription(str(SHARE / "launch" / "world_arguments.launch.py")),
    DeclareLaunchArgument("x", default_value="0.0", description="initial x in the world, m"),
    DeclareLaunchArgument("y", default_value="0.0", description="initial y in the world, m"),
    DeclareLaunchArgument("yaw", default_value="0.0", description="initial yaw in the world, rad"),
]


def equals(name, value):
    """Return the condition that a launch argument has a value."""
    return IfCondition(EqualsSubstitution(LaunchConfiguration(name), value))


def installed(package, *path):
    """Return the path of an installed file, found when the launch runs."""
    return PathJoinSubstitution([FindPackageShare(package), *path])


def gazebo(gui, options):
    """Return Gazebo with the selected world, for one value of the argument gui."""
    world = [str(SHARE / "worlds"), "/", LaunchConfiguration("world"), ".sdf"]
    return IncludeLaunchDescription(
        installed("ros_gz_sim", "launch", "gz_sim.launch.py"),
        launch_arguments={"gz_args": [options, *world]}.items(),
        condition=equals("gui", gui),
    )


def bridge(name, file):
    """Return a bridge between the topics of Gazebo and of ROS 2."""
    config = ParameterValue([str(SHARE / "config"), "/", *file], value_type=str)
    return Node(
        package="ros_gz_bridge",
        executable="parameter_bridge",
        name=name,
        output="screen",
        parameters=[{"config_file": config}],
    )


def robot_nodes():
    """Return the nodes that put the robot into the world and publish its model and transforms."""
    file = installed("chefbot_description", "urdf", f"{ROBOT['name']}.urdf.xacro")
    model = ParameterValue(Command(["xacro '", file, "'"]), value_type=str)
    pose = {"-x": "x", "-y": "y", "-Y": "yaw"}
    return [
        Node(
            package="ros_gz_sim",
            executable="create",
            output="screen",
            arguments=[
                *("-file", str(SHARE / "models" / f"{ROBOT['name']}.sdf"), "-name", ROBOT["name"]),
                *(word for option, name in pose.items() for word in (option, LaunchConfiguration(name))),
            ],
        ),
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            output="screen",
            parameters=[{"robot_description": model}, SIMULATED],
        ),
        Node(
            package="robot_localization",
            executable="ekf_node",
            name="ekf_filter_node",
            output="screen",
            parameters=[installed("chefbot_bringup", "config", "ekf.yaml"), SIMULATED],
            remappings=[("odometry/filtered", "odom")],
            condition=equals("odometry", "ekf"),
        ),
    ]


def depth_to_scan():
    """Return the node that makes the scan of a robot without a lidar."""
    return Node(
        package="depthimage_to_laserscan",
        executable="depthimage_to_laserscan_node",
        name="depthimage_to_laserscan",
        output="screen",
        parameters=[installed("chefbot_bringup", "config", "depth_to_scan.yaml"), SIMULATED],
        remappings=[
            ("depth", "/camera/depth/image_raw"),
            ("depth_camera_info", "/camera/depth/camera_info"),
        ],
    )


def generate_launch_description():
    """Return Gazebo, the robot, the bridges, and the scan of the camera if there is no lidar."""
    return LaunchDescription(
        [
            *ARGUMENTS,
            gazebo("true", "-r "),
            gazebo("false", "-r -s "),
            bridge("bridge", ["bridge.yaml"]),
            bridge("bridge_odometry", ["bridge_odometry_", LaunchConfiguration("odometry"), ".yaml"]),
            *robot_nodes(),
            *([] if ROBOT["lidar"] else [depth_to_scan()]),
        ]
    )
