"""The ROS 2 package `chefbot_description`: what `ros2 launch chefbot_description model_robot.launch.py` shows.

Package format: https://www.ros.org/reps/rep-0149.html; ament_cmake:
https://docs.ros.org/en/jazzy/How-To-Guides/Ament-CMake-Documentation.html
"""

from __future__ import annotations

from chefbot.design.export.ros2.package import cmake, manifest
from chefbot.design.export.sdf_sensors import WHEELS
from chefbot.design.export.urdf_frames import joint_name
from chefbot.design.export.urdf_xacro import mesh_files, xacro_files
from chefbot.design.solids.triangulation import part_mesh
from chefbot.robot.geometry.shapes import Solid
from chefbot.robot.motion_limits import max_acceleration, max_speed, max_turn, max_turn_acceleration
from chefbot.robot.spec import Robot

PACKAGE = "chefbot_description"
FOLDERS = ("urdf", "meshes", "launch", "rviz", "config")


def ros_package(robot: Robot) -> dict[str, bytes]:
    """Path in the package to content. Loads the CAD libraries."""
    texts = {
        "package.xml": manifest(
            PACKAGE, f"Model of the robot {robot.name}, written by chefbot from its robot file.", NEEDED
        ),
        "CMakeLists.txt": cmake(PACKAGE, FOLDERS),
        "launch/model_robot.launch.py": LAUNCH.replace("@ROBOT@", robot.name),
        "rviz/robot.rviz": RVIZ,
        "config/controllers.yaml": _controllers(robot),
        **{f"urdf/{name}": text for name, text in xacro_files(robot, PACKAGE).items()},
    }
    meshes = {f"meshes/{name}": stl(solids) for name, solids in mesh_files(robot).items()}
    return {path: text.encode() for path, text in texts.items()} | meshes


def stl(solids: tuple[Solid, ...]) -> bytes:
    """A part's solids as binary STL, in metres in the part's frame."""
    from trimesh import Trimesh

    mesh = part_mesh(solids)
    data: bytes = Trimesh(mesh.vertices, mesh.triangles, process=False).export(file_type="stl")
    return data


NEEDED = (
    "robot_state_publisher", "joint_state_publisher", "joint_state_publisher_gui", "rviz2", "xacro",
    "launch", "launch_ros", "ament_index_python",
)  # fmt: skip


LAUNCH = '''"""The robot in RViz, with a slider for each wheel."""

from pathlib import Path
from shlex import quote

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    share = Path(get_package_share_directory("chefbot_description"))
    file = quote(str(share / "urdf" / "@ROBOT@.urdf.xacro"))  # Command cuts its line at spaces
    model = Command(["xacro ", file, " prefix:=", LaunchConfiguration("prefix")])
    gui = LaunchConfiguration("gui")
    return LaunchDescription(
        [
            DeclareLaunchArgument("prefix", default_value='""', description="before the name of every link"),
            DeclareLaunchArgument("gui", default_value="true", description="sliders for the wheels"),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                parameters=[{"robot_description": ParameterValue(model, value_type=str)}],
            ),
            Node(
                package="joint_state_publisher_gui",
                executable="joint_state_publisher_gui",
                condition=IfCondition(gui),
            ),
            Node(
                package="joint_state_publisher",
                executable="joint_state_publisher",
                condition=UnlessCondition(gui),
            ),
            Node(package="rviz2", executable="rviz2", arguments=["-d", str(share / "rviz" / "robot.rviz")]),
        ]
    )
'''

RVIZ = """Panels:
  - Class: rviz_common/Displays
    Name: Displays
Visualization Manager:
  Class: ""
  Displays:
    - Class: rviz_default_plugins/Grid
      Enabled: true
      Name: Grid
      Cell Size: 0.5
      Plane Cell Count: 10
    - Class: rviz_default_plugins/RobotModel
      Enabled: true
      Name: RobotModel
      Description Source: Topic
      Description Topic:
        Value: /robot_description
        Durability Policy: Transient Local
        Reliability Policy: Reliable
        History Policy: Keep Last
        Depth: 1
    - Class: rviz_default_plugins/TF
      Enabled: true
      Name: TF
      Marker Scale: 0.3
  Enabled: true
  Global Options:
    Fixed Frame: base_footprint
  Tools:
    - Class: rviz_default_plugins/MoveCamera
  Value: true
  Views:
    Current:
      Class: rviz_default_plugins/Orbit
      Distance: 1.2
      Focal Point: {X: 0, Y: 0, Z: 0.2}
      Pitch: 0.4
      Yaw: 0.8
      Name: Current View
"""


def _controllers(robot: Robot) -> str:
    """For controller_manager: https://control.ros.org/jazzy/doc/ros2_controllers/diff_drive_controller/doc"""
    left, right = (joint_name(wheel) for wheel in WHEELS)
    return f"""controller_manager:
  ros__parameters:
    update_rate: {round(robot.sensors.imu.rate)}
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    diff_drive_controller:
      type: diff_drive_controller/DiffDriveController

diff_drive_controller:
  ros__parameters:
    left_wheel_names: [{left}]
    right_wheel_names: [{right}]
    wheel_separation: {_double(robot.wheels.separation)}
    wheel_radius: {_double(robot.wheel_radius)}
    wheel_separation_multiplier: {_double(robot.calibration.separation)}
    left_wheel_radius_multiplier: {_double(robot.calibration.left_wheel)}
    right_wheel_radius_multiplier: {_double(robot.calibration.right_wheel)}
    odom_frame_id: odom
    base_frame_id: base_footprint
    linear.x.max_velocity: {_double(max_speed(robot))}
    linear.x.min_velocity: {_double(-max_speed(robot))}
    linear.x.max_acceleration: {_double(max_acceleration(robot))}
    linear.x.max_deceleration: {_double(-max_acceleration(robot))}
    angular.z.max_velocity: {_double(max_turn(robot))}
    angular.z.min_velocity: {_double(-max_turn(robot))}
    angular.z.max_acceleration: {_double(max_turn_acceleration(robot))}
    angular.z.max_deceleration: {_double(-max_turn_acceleration(robot))}
"""


def _double(value: float) -> str:
    """With a point: to ROS 2's parameters 1 is an integer, and diff_drive_controller refuses that."""
    return str(float(f"{value:.9g}"))
