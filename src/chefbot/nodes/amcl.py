"""Scans on a known map to a pose."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from chefbot.localization.amcl import Amcl
from chefbot.localization.clusters import position_spread
from chefbot.localization.params import AmclParams
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    TransformStamped,
    covariance_36,
)
from chefbot.msgs.nav2_msgs import Particle, ParticleCloud
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Empty, Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.node import In, Node, Out, every, last_words, topic
from chefbot.scan.usable_range import trusted_range

SHOWN_PARTICLES = 500
"""More arrows than these only slow the page."""
RESUMED_XY, RESUMED_YAW = 0.1, 0.1
"""Metres and radians (standard deviations) to which a pose still holds after a life before knew it."""


class AmclNode(Node):
    """Publishes the pose on the map, the particles and the transform map -> odom.

    Without an initial pose it begins by searching the whole map; in another life it begins where it was, if that
    was known.
    """

    live_params = ("update_min_*", "max_beams", "beam_independence")
    params: AmclParams
    map: In[OccupancyGrid]
    scan: In[LaserScan]
    initialpose: In[PoseWithCovarianceStamped]
    reinitialize_global_localization: In[Empty]
    sure_before: In[LocalizationStatus] = last_words("localization_status")
    frames_before: In[TFMessage] = last_words("tf")
    amcl_pose: Out[PoseWithCovarianceStamped] = topic(latched=True)
    particle_cloud: Out[ParticleCloud]
    localization_status: Out[LocalizationStatus] = topic(latched=True)
    tf_out: Out[TFMessage] = topic("tf")

    def start(self) -> None:
        """It needs a map and a scan before it can say anything."""
        self._amcl: Amcl | None = None
        self._wish: PoseWithCovarianceStamped | None = None
        self._known: OccupancyGrid | None = None

    def reconfigure(self, params: AmclParams) -> None:
        """From the next scan on."""
        self.params = params
        if self._amcl is not None:
            self._amcl.params = msgspec.structs.replace(params, seed=self._amcl.params.seed)

    def on_map(self, message: OccupancyGrid) -> None:
        """A new map: begin anew; the same told again, by a map server's next life, changes nothing."""
        if self._known is None or not _same(message, self._known):
            self._amcl = None
        self._known = message

    def on_initialpose(self, message: PoseWithCovarianceStamped) -> None:
        """Somebody says where the robot is."""
        self._wish = message
        if self._amcl is not None:
            self._apply(message)

    def on_reinitialize_global_localization(self, _: Empty) -> None:
        """Search the whole map."""
        self._wish = None
        if self._amcl is not None:
            self._amcl.scatter()

    def on_scan(self, scan: LaserScan) -> None:
        """Wait until odometry has reached the scan's time."""
        if self.map.last is not None:
            stamp = scan.header.stamp.ns
            self.tf.when("odom", "base_link", stamp, lambda odom: self._update(scan, odom))

    def _update(self, scan: LaserScan, odom: SE2) -> None:
        if self._amcl is None:
            self._amcl = self._make(self.tf.lookup("base_link", scan.header.frame_id), odom)
        stamp = scan.header.stamp.ns
        reach = min(scan.range_max, trusted_range(self.robot, self._resolution))
        updated = self._amcl.update(scan.angles, scan.ranges, reach, odom)
        transform = TransformStamped.of(stamp, "map", "odom", self._amcl.map_T_odom)
        self.tf_out.publish(TFMessage((transform,)))
        if updated:
            covariance = covariance_36(self._amcl.covariance)
            pose = PoseWithCovariance(Pose.of(self._amcl.pose), covariance)
            self.amcl_pose.publish(PoseWithCovarianceStamped(Header.of(stamp, "map"), pose))
            self._publish_status(stamp)

    def _make(self, sensor: SE2, odom: SE2) -> Amcl:
        assert self.map.last is not None
        self._resolution = self.map.last.grid.resolution
        seed = int(self.context.rng().integers(2**31)) + self.params.seed
        amcl = Amcl(msgspec.structs.replace(self.params, seed=seed), self.map.last.grid, sensor)
        if self._wish is not None:
            self._amcl = amcl
            self._apply(self._wish)
        elif self._lived_before():
            assert self.frames_before.last is not None
            map_T_odom = self.frames_before.last.transforms[0].transform.se2
            amcl.set_pose(map_T_odom @ odom, RESUMED_XY, RESUMED_YAW)
        return amcl

    def _lived_before(self) -> bool:
        """Whether a life before knew where the robot is; true once."""
        sure, self.sure_before.last = self.sure_before.last, None
        return sure is not None and sure.localized and self.frames_before.last is not None

    def _apply(self, message: PoseWithCovarianceStamped) -> None:
        assert self._amcl is not None
        spread = np.sqrt(np.diag(message.pose.planar_covariance))
        self._amcl.set_pose(message.pose.pose.se2, float(max(spread[0], spread[1])), float(spread[2]))

    def _publish_status(self, stamp: int) -> None:
        assert self._amcl is not None
        spread = position_spread(self._amcl.covariance)
        yaw = math.sqrt(max(self._amcl.covariance[2, 2], 0.0))
        sure = self._amcl.converged
        sentence = (
            f"I know where I am to {spread:.2f} m." if sure else "I am not sure where I am; looking around."
        )
        self.localization_status.publish(
            LocalizationStatus(
                Header.of(stamp, "map"),
                sure,
                self._amcl.confidence,
                spread,
                yaw,
                len(self._amcl.particles),
                sentence,
            )
        )

    @every(hz=1)
    def publish_particles(self) -> None:
        """A sample of them, for looking."""
        if self._amcl is None:
            return
        step = max(1, len(self._amcl.particles) // SHOWN_PARTICLES)
        particles = tuple(
            Particle(Pose.of(SE2.of(pose)), float(weight))
            for pose, weight in zip(self._amcl.particles[::step], self._amcl.weights[::step], strict=True)
        )
        self.particle_cloud.publish(ParticleCloud(Header.of(self.now_ns, "map"), particles))


def _same(a: OccupancyGrid, b: OccupancyGrid) -> bool:
    one, other = a.grid, b.grid
    corners = (one.origin_x, one.origin_y, one.resolution) == (
        other.origin_x,
        other.origin_y,
        other.resolution,
    )
    return corners and np.array_equal(one.cells, other.cells)
