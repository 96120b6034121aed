"""`controllers.yaml` for ros2_control's diff_drive_controller.

Names: https://control.ros.org/jazzy/doc/ros2_controllers/diff_drive_controller/doc.
"""

from __future__ import annotations

from chefbot.design.export.ros2.annotated_yaml import Tree, yaml_text
from chefbot.design.export.sdf_sensors import WHEELS
from chefbot.design.export.urdf_frames import joint_name
from chefbot.robot.motion_limits import (
    max_acceleration,
    max_deceleration,
    max_speed,
    max_turn,
    max_turn_acceleration,
    max_turn_deceleration,
)
from chefbot.robot.spec import Robot


def controllers(robot: Robot) -> str:
    """Return the parameters of the controller manager and the controller; speeds in m/s and rad/s."""
    left, right = (joint_name(wheel) for wheel in WHEELS)
    limits = {
        "linear.x": (max_speed(robot), max_acceleration(robot), max_deceleration(robot)),
        "angular.z": (max_turn(robot), max_turn_acceleration(robot), max_turn_deceleration(robot)),
    }
    manager: Tree = {
        "update_rate": round(robot.sensors.imu.rate),
        "joint_state_broadcaster": {"type": "joint_state_broadcaster/JointStateBroadcaster"},
        "diff_drive_controller": {"type": "diff_drive_controller/DiffDriveController"},
    }
    drive: dict[str, float | str | list[str]] = {
        "left_wheel_names": [left],
        "right_wheel_names": [right],
        "wheel_separation": float(robot.wheels.separation),
        "wheel_radius": float(robot.wheel_radius),
        "wheel_separation_multiplier": float(robot.calibration.separation),
        "left_wheel_radius_multiplier": float(robot.calibration.left_wheel),
        "right_wheel_radius_multiplier": float(robot.calibration.right_wheel),
        "odom_frame_id": "odom",
        "base_frame_id": "base_footprint",
    }
    for axis, (speed, acceleration, deceleration) in limits.items():
        drive[f"{axis}.max_velocity"], drive[f"{axis}.min_velocity"] = float(speed), -float(speed)
        drive[f"{axis}.max_acceleration"] = float(acceleration)
        drive[f"{axis}.max_deceleration"] = -float(deceleration)
    tree: Tree = {
        "controller_manager": {"ros__parameters": manager},
        "diff_drive_controller": {"ros__parameters": drive},
    }
    return yaml_text(tree, f"ros2_control for the robot {robot.name}, written by chefbot.")
