"""Publishes a fixed transform between two frames, as tf2_ros' static_transform_publisher does."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.node import Node, Out, every, topic


class StaticTransformParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Names of the two frames and the pose of the child in the parent."""

    frame: Annotated[str, Meta(min_length=1, description="the parent")]
    child: Annotated[str, Meta(min_length=1, description="the child")]
    x: Annotated[float, Meta(ge=-10_000, le=10_000, description="of the child in the parent, m")] = 0.0
    y: Annotated[float, Meta(ge=-10_000, le=10_000, description="of the child in the parent, m")] = 0.0
    yaw: Annotated[float, Meta(ge=-7, le=7, description="of the child in the parent, rad")] = 0.0


class StaticTransformNode(Node):
    """Substitutes for mapping or odometry where there is none, so that dependent data can be displayed.

    It publishes on /tf periodically, because /tf_static belongs to the robot's own frames.
    """

    live_params = ("*",)
    params: StaticTransformParams
    tf_out: Out[TFMessage] = topic("tf")

    @every(hz=10)
    def publish_transform(self) -> None:
        """Publish the transform with the current time."""
        pose = SE2(self.params.x, self.params.y, self.params.yaw)
        transform = TransformStamped.of(self.now_ns, self.params.frame, self.params.child, pose)
        self.tf_out.publish(TFMessage((transform,)))
