"""Drive with the keyboard; needs xterm, or start the program in a terminal of its own."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration
from launch_ros.actions import Node


def with_stack(name):
    """Return the condition that a navigation stack is selected."""
    return IfCondition(EqualsSubstitution(LaunchConfiguration("stack"), name))


def generate_launch_description():
    """Return the teleoperation program of the selected stack; cmd_vel_teleop has priority over navigation."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "stack",
                default_value="chefbot",
                description="teleoperation by chefbot or by teleop_twist_keyboard",
                choices=["chefbot", "nav2"],
            ),
            ExecuteProcess(
                cmd=["chefbot", "launch", "keyboard_teleop"],
                output="screen",
                prefix="xterm -e",
                condition=with_stack("chefbot"),
            ),
            Node(
                package="teleop_twist_keyboard",
                executable="teleop_twist_keyboard",
                output="screen",
                prefix="xterm -e",
                remappings=[("cmd_vel", "cmd_vel_teleop")],
                condition=with_stack("nav2"),
            ),
        ]
    )
