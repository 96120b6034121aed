"""Navigate on a saved map, with chefbot or with Nav2."""

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration

LAUNCH = f"{get_package_share_directory('chefbot_bringup')}/launch"
START = ("map_file", "initial_pose_x", "initial_pose_y", "initial_pose_a")


def generate_launch_description():
    """Return the navigation demo of the selected stack."""
    nav2 = EqualsSubstitution(LaunchConfiguration("stack"), "nav2")
    simulated = {"use_sim_time": EqualsSubstitution(LaunchConfiguration("base"), "simulation")}
    arguments = [[f"{name}:=", LaunchConfiguration(name)] for name in (*START, "robot", "world", "headless")]
    return LaunchDescription(
        [
            DeclareLaunchArgument("map_file", description="YAML file of the map"),
            IncludeLaunchDescription(f"{LAUNCH}/initial_pose_arguments.launch.py"),
            DeclareLaunchArgument(
                "stack",
                default_value="chefbot",
                description="navigation stack: chefbot, or Nav2 and slam_toolbox",
                choices=["chefbot", "nav2"],
            ),
            IncludeLaunchDescription(f"{LAUNCH}/base_arguments.launch.py"),
            ExecuteProcess(
                cmd=["chefbot", "launch", "amcl_demo", *arguments],
                output="screen",
                condition=UnlessCondition(nav2),
            ),
            GroupAction(
                [
                    IncludeLaunchDescription(f"{LAUNCH}/base.launch.py"),
                    IncludeLaunchDescription(
                        f"{LAUNCH}/localization.launch.py",
                        # Without a default, it has to be passed; the others are seen by an included file anyway.
                        launch_arguments={**simulated, "map_file": LaunchConfiguration("map_file")}.items(),
                    ),
                    IncludeLaunchDescription(
                        f"{LAUNCH}/navigation.launch.py", launch_arguments=simulated.items()
                    ),
                ],
                condition=IfCondition(nav2),
            ),
        ]
    )
