"""Start the base: the simulator or the motor board, the robot model and the selected odometry."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import ExecuteProcess, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SHARE = Path(get_package_share_directory("chefbot_bringup"))


def equals(name, value):
    """Return the substitution that is true if a launch argument has the value."""
    return EqualsSubstitution(LaunchConfiguration(name), value)


def chefbot_base(base, *names):
    """Return the chefbot process of one kind of base; the named launch arguments are passed on."""
    file = [str(SHARE / "chefbot"), f"/{base}_", LaunchConfiguration("odometry"), ".yaml"]
    arguments = [[f"{name}:=", LaunchConfiguration(name)] for name in names]
    return ExecuteProcess(
        cmd=["chefbot", "launch", file, *arguments],
        output="screen",
        condition=IfCondition(equals("base", base)),
    )


def generate_launch_description():
    """Return the chefbot process, which also publishes the model and its transforms, and the optional EKF."""
    simulated = {"use_sim_time": ParameterValue(equals("base", "simulation"), value_type=bool)}
    return LaunchDescription(
        [
            IncludeLaunchDescription(str(SHARE / "launch" / "base_arguments.launch.py")),
            chefbot_base("simulation", "robot", "world", "headless"),
            chefbot_base("built", "robot", "board_port", "headless"),
            Node(
                package="robot_localization",
                executable="ekf_node",
                name="ekf_filter_node",
                output="screen",
                parameters=[str(SHARE / "config" / "ekf.yaml"), simulated],
                remappings=[("odometry/filtered", "odom")],
                condition=IfCondition(equals("odometry", "ekf")),
            ),
        ]
    )
