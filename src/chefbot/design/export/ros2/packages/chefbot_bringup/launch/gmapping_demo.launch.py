"""Build a map while driving by hand or to goals, with chefbot or with slam_toolbox and Nav2."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import EqualsSubstitution, LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

SHARE = Path(get_package_share_directory("chefbot_bringup"))
ROBOT = yaml.safe_load((SHARE / "config" / "robot.yaml").read_text())
BASE_ARGUMENTS = [
    DeclareLaunchArgument("robot", default_value=ROBOT["robot"], description="chefbot robot: name or file"),
    DeclareLaunchArgument(
        "base",
        default_value="simulation",
        description="chefbot's simulator, or the built robot",
        choices=["simulation", "built"],
    ),
    DeclareLaunchArgument(
        "odometry",
        default_value="chefbot",
        description="chefbot's odometry, or robot_localization",
        choices=["chefbot", "ekf"],
    ),
    DeclareLaunchArgument(
        "world", default_value="hotel", description="simulated world: hotel, room, empty, or a file"
    ),
    DeclareLaunchArgument("board_port", default_value="auto", description="serial port of the motor board"),
    DeclareLaunchArgument(
        "headless", default_value="false", description="without the web page", choices=["true", "false"]
    ),
]
STACK = DeclareLaunchArgument(
    "stack",
    default_value="chefbot",
    description="navigation stack: chefbot, or Nav2 and slam_toolbox",
    choices=["chefbot", "nav2"],
)


def equals(name, value):
    """Return the substitution that is true if a launch argument has the value."""
    return EqualsSubstitution(LaunchConfiguration(name), value)


def with_nav2(file, arguments):
    """Return the include of a launch file for the stack nav2."""
    return IncludeLaunchDescription(
        PythonLaunchDescriptionSource(file),
        launch_arguments=arguments.items(),
        condition=IfCondition(equals("stack", "nav2")),
    )


def generate_launch_description():
    """Return the mapping demo of the selected stack."""
    base = {argument.name: LaunchConfiguration(argument.name) for argument in BASE_ARGUMENTS}
    simulated = {"use_sim_time": equals("base", "simulation")}
    slam = PathJoinSubstitution([FindPackageShare("slam_toolbox"), "launch", "online_async_launch.py"])
    params = {"slam_params_file": str(SHARE / "config" / "slam_toolbox.yaml")}
    return LaunchDescription(
        [
            STACK,
            *BASE_ARGUMENTS,
            ExecuteProcess(
                cmd=[
                    *("chefbot", "launch", "gmapping_demo"),
                    *([f"{name}:=", base[name]] for name in ("robot", "world", "headless")),
                ],
                output="screen",
                condition=IfCondition(equals("stack", "chefbot")),
            ),
            with_nav2(str(SHARE / "launch" / "base.launch.py"), base),
            with_nav2(slam, simulated | params),
            with_nav2(str(SHARE / "launch" / "navigation.launch.py"), simulated),
        ]
    )
