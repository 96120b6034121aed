"""Publishes /tf_static and /robot_description, as ROS's robot_state_publisher does."""

from __future__ import annotations

from chefbot.design.export.urdf import urdf
from chefbot.design.export.urdf_frames import Frame, fixed_frames, quaternion
from chefbot.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.node import Node, NoParams, Out, topic


class RobotStatePublisherNode(Node):
    """Publishes the robot model and its fixed transforms once, transient local."""

    params: NoParams
    tf_static: Out[TFMessage] = topic(latched=True)
    robot_description: Out[String] = topic(latched=True)

    def start(self) -> None:
        """Publish the fixed transforms and the URDF."""
        fixed = tuple(transform(self.now_ns, frame) for frame in fixed_frames(self.robot))
        self.tf_static.publish(TFMessage(fixed))
        self.robot_description.publish(String(urdf(self.robot)))


def transform(ns: int, frame: Frame) -> TransformStamped:
    """Return `parent_T_frame` as a message with the full 3-D orientation of the frame."""
    w, x, y, z = quaternion(frame.rpy)
    pose = Transform(Vector3(*frame.at), Quaternion(x, y, z, w))
    return TransformStamped(Header.of(ns, frame.parent), frame.name, pose)
