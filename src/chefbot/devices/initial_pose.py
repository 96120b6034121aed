"""Initial pose of the robot, with the parameters of amcl: initial_pose_x, _y, _a."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, PoseWithCovarianceStamped, covariance_36
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import Device, In, Out

VARIANCE_XY, VARIANCE_YAW = 0.5**2, (np.pi / 12) ** 2
"""amcl's initial_cov_xx, m^2, and initial_cov_aa, rad^2 (http://wiki.ros.org/amcl): standard deviations of
half a metre and 15 degrees."""
MAX_DEVIATION = 1.0
"""Maximum distance and standard deviation, m, of an estimate that was initialized with this pose."""


class InitialPoseParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The initial pose in the map frame."""

    x: Annotated[float, Meta(ge=-1e7, le=1e7, description="on the map, m")] = 0.0
    y: Annotated[float, Meta(ge=-1e7, le=1e7, description="on the map, m")] = 0.0
    yaw: Annotated[float, Meta(ge=-7, le=7, description="counter-clockwise from the map's x axis, rad")] = 0.0


class InitialPoseDevice(Device):
    """Publishes the initial pose once, like a click in the web UI, and a second time if it was not received."""

    params: InitialPoseParams
    amcl_pose: In[PoseWithCovarianceStamped]
    initialpose: Out[PoseWithCovarianceStamped]

    def start(self) -> None:
        """Publish as soon as the event loop runs."""
        self._pose: SE2 | None = None
        self._checked = False
        self.post(partial(self.assume, self.pose()))

    def assume(self, pose: SE2) -> None:
        """Publish a pose in the map frame as the initial one."""
        self._pose = pose
        self.initialpose.publish(initial_pose(self.now_ns, pose))

    def on_amcl_pose(self, estimate: PoseWithCovarianceStamped) -> None:
        """Check with the first estimate whether the pose was received: localization may run in a process that
        starts later."""
        if self._checked or self._pose is None:
            return
        self._checked = True
        # The pose was received if the first estimate is near it and certain enough.
        deviation = float(np.sqrt(np.diag(estimate.pose.planar_covariance)[:2].max()))
        if deviation > MAX_DEVIATION or estimate.pose.pose.se2.distance(self._pose) > MAX_DEVIATION:
            self.assume(self._pose)

    def pose(self) -> SE2:
        """Return the initial pose in the map frame."""
        return SE2(self.params.x, self.params.y, self.params.yaw)


def initial_pose(now_ns: int, pose: SE2) -> PoseWithCovarianceStamped:
    """Return the message that starts localization from a pose in the map frame."""
    covariance = covariance_36(np.diag([VARIANCE_XY, VARIANCE_XY, VARIANCE_YAW]))
    message = PoseWithCovariance(Pose.of(pose), covariance)
    return PoseWithCovarianceStamped(Header.of(now_ns, "map"), message)
