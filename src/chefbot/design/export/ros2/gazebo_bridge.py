"""Which topics of Gazebo are which of ROS 2: the YAML files of ros_gz_bridge.

Format and types: https://github.com/gazebosim/ros_gz/tree/jazzy/ros_gz_bridge. The names on Gazebo's side are those
of our SDF, those on ROS's side our own: both bases are driven and seen alike.
"""

from __future__ import annotations

from typing import NamedTuple

from chefbot.robot.spec import Robot

TO_ROS, TO_GAZEBO = "GZ_TO_ROS", "ROS_TO_GZ"


class BridgedTopic(NamedTuple):
    """A topic that crosses."""

    ros: str
    gz: str
    ros_type: str
    gz_type: str
    direction: str = TO_ROS


CLOCK = BridgedTopic("/clock", "/clock", "rosgraph_msgs/msg/Clock", "gz.msgs.Clock")
JOINTS = BridgedTopic("/joint_states", "/joint_states", "sensor_msgs/msg/JointState", "gz.msgs.Model")
DRIVEN = tuple(
    BridgedTopic(topic, "/cmd_vel", "geometry_msgs/msg/Twist", "gz.msgs.Twist", TO_GAZEBO)
    for topic in ("/cmd_vel_nav", "/cmd_vel_teleop", "/cmd_vel")
)
"""Gazebo's base has no gate that puts the driver before navigation: who speaks last is obeyed."""
ODOMETRY = (
    BridgedTopic("/odom", "/odom", "nav_msgs/msg/Odometry", "gz.msgs.Odometry"),
    BridgedTopic("/tf", "/tf", "tf2_msgs/msg/TFMessage", "gz.msgs.Pose_V"),
)
WHEEL_ODOMETRY = (ODOMETRY[0]._replace(ros="/wheel_odom"),)
"""For robot_localization, which then makes /odom and the transform."""


def sensor_links(robot: Robot) -> list[BridgedTopic]:
    """What the robot's sensors say, for those that it has."""
    sensors = robot.sensors
    links = [BridgedTopic("/imu/data", "/imu/data", "sensor_msgs/msg/Imu", "gz.msgs.IMU")]
    scan = "sensor_msgs/msg/LaserScan", "gz.msgs.LaserScan"
    if sensors.lidar is not None:
        links.append(BridgedTopic("/scan", "/scan", *scan))
    if sensors.ultrasonic is not None:
        links.append(BridgedTopic("/ultrasonic_rays", "/ultrasonic", *scan))
    if sensors.depth_camera is not None:
        links += [
            BridgedTopic(
                "/camera/depth/image_raw", "/camera/depth_image", "sensor_msgs/msg/Image", "gz.msgs.Image"
            ),
            BridgedTopic(
                "/camera/color/image_raw", "/camera/image", "sensor_msgs/msg/Image", "gz.msgs.Image"
            ),
            BridgedTopic(
                "/camera/depth/camera_info",
                "/camera/camera_info",
                "sensor_msgs/msg/CameraInfo",
                "gz.msgs.CameraInfo",
            ),
        ]
    return links


def bridges(robot: Robot) -> dict[str, str]:
    """File to text: what always crosses, and the two sorts of odometry, one of which does."""
    always = [CLOCK, JOINTS, *DRIVEN, *sensor_links(robot)]
    return {
        "bridge.yaml": bridge_text(always),
        "bridge_odometry_gazebo.yaml": bridge_text(ODOMETRY),
        "bridge_odometry_ekf.yaml": bridge_text(WHEEL_ODOMETRY),
    }


def bridge_text(links: tuple[BridgedTopic, ...] | list[BridgedTopic]) -> str:
    """A file of ros_gz_bridge."""
    return "".join(
        f'- ros_topic_name: "{link.ros}"\n'
        f'  gz_topic_name: "{link.gz}"\n'
        f'  ros_type_name: "{link.ros_type}"\n'
        f'  gz_type_name: "{link.gz_type}"\n'
        f"  direction: {link.direction}\n"
        for link in links
    )
