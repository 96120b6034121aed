"""Build a map while driving by hand or to goals, with chefbot or with slam_toolbox and Nav2."""

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration
from launch_ros.substitutions import FindPackageShare

SHARE = get_package_share_directory("chefbot_bringup")


def generate_launch_description():
    """Return the mapping demo of the selected stack."""
    nav2 = EqualsSubstitution(LaunchConfiguration("stack"), "nav2")
    simulated = {"use_sim_time": EqualsSubstitution(LaunchConfiguration("base"), "simulation")}
    params = {"slam_params_file": f"{SHARE}/config/slam_toolbox.yaml"}
    arguments = [[f"{name}:=", LaunchConfiguration(name)] for name in ("robot", "world", "headless")]
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "stack",
                default_value="chefbot",
                description="navigation stack: chefbot, or Nav2 and slam_toolbox",
                choices=["chefbot", "nav2"],
            ),
            IncludeLaunchDescription(f"{SHARE}/launch/base_arguments.launch.py"),
            ExecuteProcess(
                cmd=["chefbot", "launch", "gmapping_demo", *arguments],
                output="screen",
                condition=UnlessCondition(nav2),
            ),
            GroupAction(
                [
                    IncludeLaunchDescription(f"{SHARE}/launch/base.launch.py"),
                    IncludeLaunchDescription(
                        [FindPackageShare("slam_toolbox"), "/launch/online_async_launch.py"],
                        launch_arguments={**simulated, **params}.items(),
                    ),
                    IncludeLaunchDescription(
                        f"{SHARE}/launch/navigation.launch.py", launch_arguments=simulated.items()
                    ),
                ],
                condition=IfCondition(nav2),
            ),
        ]
    )
