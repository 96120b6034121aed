"""Start the wheels, odometry and sensors of the built robot."""

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription

LAUNCH = f"{get_package_share_directory('chefbot_bringup')}/launch"


def generate_launch_description():
    """Return base.launch.py with the motor board; its other arguments are those of this file too."""
    built = {"base": "built"}
    return LaunchDescription(
        [IncludeLaunchDescription(f"{LAUNCH}/base.launch.py", launch_arguments=built.items())]
    )
