"""Where the sensors sit: /tf_static and /robot_description, as robot_state_publisher gives them."""

from __future__ import annotations

from chefbot.design.urdf import urdf
from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.std_msgs import String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.sections import Mount
from chefbot.robot.spec import Robot
from chefbot.runtime.node import Node, NoParams, Out, topic

LIDAR_FRAME = "laser"
CAMERA_FRAME = "camera_depth_frame"
ULTRASONIC_FRAME = "ultrasonic_link"
IMU_FRAME = "imu_link"


def sensor_frames(robot: Robot) -> dict[str, Mount]:
    """Frame to mount of each sensor that the robot has."""
    sensors = robot.sensors
    frames = {IMU_FRAME: sensors.imu.mount}
    for frame, sensor in (
        (LIDAR_FRAME, sensors.lidar),
        (CAMERA_FRAME, sensors.depth_camera),
        (ULTRASONIC_FRAME, sensors.ultrasonic),
    ):
        if sensor is not None:
            frames[frame] = sensor.mount
    return frames


class FramesNode(Node):
    """Tells once, for all who come later too, the robot's model and its fixed transforms."""

    params: NoParams
    tf_static: Out[TFMessage] = topic(latched=True)
    robot_description: Out[String] = topic(latched=True)

    def start(self) -> None:
        """Publish both."""
        fixed = [TransformStamped.of(self.now_ns, "base_footprint", "base_link", IDENTITY)]
        for frame, mount in sensor_frames(self.robot).items():
            fixed.append(TransformStamped.of(self.now_ns, "base_link", frame, mount.planar, mount.z))
        self.tf_static.publish(TFMessage(tuple(fixed)))
        self.robot_description.publish(String(urdf(self.robot)))
