"""Where the robot stands when it starts, as amcl's parameters initial_pose_x, _y, _a say it."""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, PoseWithCovarianceStamped, covariance_36
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import Device, In, Out

VARIANCE_XY, VARIANCE_YAW = 0.5**2, (np.pi / 12) ** 2
"""amcl's initial_cov_xx and initial_cov_aa (http://wiki.ros.org/amcl): half a metre, 15 degrees."""
FAR = 1.0
"""Metres: an estimate so far off, or with such a deviation, was made without this pose."""


class InitialPoseParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A pose on the map."""

    x: Annotated[float, Meta(ge=-10_000, le=10_000, description="on the map, m")] = 0.0
    y: Annotated[float, Meta(ge=-10_000, le=10_000, description="on the map, m")] = 0.0
    yaw: Annotated[float, Meta(ge=-7, le=7, description="counter-clockwise from the map's x axis, rad")] = 0.0


class InitialPoseDevice(Device):
    """Publishes the initial pose, as a click on the page does; a second time if nobody was subscribed yet."""

    params: InitialPoseParams
    amcl_pose: In[PoseWithCovarianceStamped]
    initialpose: Out[PoseWithCovarianceStamped]

    def start(self) -> None:
        """Publish as soon as the loop runs."""
        self._pose, self._answered = self.pose(), False
        self.post(self._publish)

    def on_amcl_pose(self, estimate: PoseWithCovarianceStamped) -> None:
        """The first estimate shows whether it was received: localization may run in a process that starts later."""
        if self._answered:
            return
        self._answered = True
        spread = float(np.sqrt(np.diag(estimate.pose.planar_covariance)[:2].max()))
        if spread > FAR or estimate.pose.pose.se2.distance(self._pose) > FAR:
            self._publish()

    def pose(self) -> SE2:
        """On the map."""
        return SE2(self.params.x, self.params.y, self.params.yaw)

    def _publish(self) -> None:
        covariance = covariance_36(np.diag([VARIANCE_XY, VARIANCE_XY, VARIANCE_YAW]))
        message = PoseWithCovariance(Pose.of(self._pose), covariance)
        self.initialpose.publish(PoseWithCovarianceStamped(Header.of(self.now_ns, "map"), message))
