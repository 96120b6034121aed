"""Adaptive Monte Carlo localization on a known map."""

from __future__ import annotations

import msgspec
import numpy as np

from chefbot.localization.amcl import Amcl
from chefbot.localization.messages import (
    particle_cloud,
    pose_message,
    same_grid,
    status_message,
    why_not_on_map,
)
from chefbot.localization.params import AmclParams
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import PoseWithCovarianceStamped, TransformStamped
from chefbot.msgs.nav2_msgs import ParticleCloud
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Empty, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.scans.scan_listener import ScanListenerNode
from chefbot.runtime.node import In, Out, every, restored, topic
from chefbot.scan.usable_range import usable_range

RESTORED_STD_XY, RESTORED_STD_YAW = 0.1, 0.1
"""Standard deviations of a pose restored after a restart, m and rad."""


class AmclNode(ScanListenerNode):
    """Publishes the pose on the map, the particles and the transform map -> odom.

    Without an initial pose it starts with global localization; after a restart it continues from the last pose if
    that was localized.
    """

    live_params = ("update_min_*", "max_beams", "beam_independence")
    role = "Localization"
    params: AmclParams
    map: In[OccupancyGrid]
    initialpose: In[PoseWithCovarianceStamped]
    reinitialize_global_localization: In[Empty]
    restored_status: In[LocalizationStatus] = restored("localization_status")
    restored_tf: In[TFMessage] = restored("tf")
    amcl_pose: Out[PoseWithCovarianceStamped] = topic(latched=True)
    particle_cloud: Out[ParticleCloud]
    localization_status: Out[LocalizationStatus] = topic(latched=True)
    tf_out: Out[TFMessage] = topic("tf")

    def start(self) -> None:
        """Start without a filter, which is created from the first map and scan."""
        super().start()
        self._amcl: Amcl | None = None
        self._initial_pose: PoseWithCovarianceStamped | None = None
        self._current_map: OccupancyGrid | None = None
        self._map_replaced = False

    def reconfigure(self, params: AmclParams) -> None:
        """Apply new parameters from the next scan on."""
        self.params = params
        if self._amcl is not None:
            self._amcl.params = msgspec.structs.replace(params, seed=self._amcl.params.seed)

    def on_map(self, message: OccupancyGrid) -> None:
        """Continue on a new map with the next scan; the same map, from a restarted map server, changes nothing."""
        if self._current_map is None or not same_grid(message.grid, self._current_map.grid):
            self._resolution = message.grid.resolution
            self._map_replaced = True
        self._current_map = message

    def on_initialpose(self, message: PoseWithCovarianceStamped) -> None:
        """Set the initial pose with its covariance; it must be a pose on the map."""
        reason = why_not_on_map(message, None if self.map.last is None else self.map.last.grid)
        if reason:
            self.scan_notice.publish(String(f"The given pose is ignored: {reason}."))
            return
        self._initial_pose = message
        if self._amcl is not None:
            self._set_initial_pose(message)

    def on_reinitialize_global_localization(self, _: Empty) -> None:
        """Start global localization on the whole map."""
        self._initial_pose = None
        if self._amcl is not None:
            self._amcl.initialize_globally()

    @property
    def wants_scans(self) -> bool:
        """Whether there is a map to compare scans with."""
        return self.map.last is not None

    def process_scan(self, scan: LaserScan, odom: SE2) -> None:
        """Update the particle filter with a scan; publish map->odom and, after a filter update, the pose."""
        laser = self.tf.lookup("base_link", scan.header.frame_id)
        if self._amcl is None:
            self._amcl = self._create_amcl(laser, odom)
        elif self._map_replaced and self._current_map is not None:
            self._amcl.replace_map(self._current_map.grid)
        self._map_replaced = False
        self._amcl.laser = laser  # a wrong static transform may have been replaced
        stamp = scan.header.stamp.ns
        max_range = min(scan.range_max, usable_range(self.robot, self._resolution))
        updated = self._amcl.update(scan.angles, scan.ranges, max_range, odom)
        transform = TransformStamped.of(stamp, "map", "odom", self._amcl.map_T_odom)
        self.tf_out.publish(TFMessage((transform,)))
        if updated:
            self.amcl_pose.publish(pose_message(self._amcl, stamp))
            self.localization_status.publish(status_message(self._amcl, stamp))

    def _create_amcl(self, sensor: SE2, odom: SE2) -> Amcl:
        assert self.map.last is not None
        seed = int(self.context.rng().integers(2**31)) + self.params.seed
        amcl = Amcl(msgspec.structs.replace(self.params, seed=seed), self.map.last.grid, sensor)
        if self._initial_pose is not None:
            self._amcl = amcl
            self._set_initial_pose(self._initial_pose)
        elif self._has_restored_pose():
            assert self.restored_tf.last is not None
            map_T_odom = self.restored_tf.last.transforms[0].transform.se2
            amcl.set_pose(map_T_odom @ odom, RESTORED_STD_XY, RESTORED_STD_YAW)
        return amcl

    def _has_restored_pose(self) -> bool:
        """Return whether a localized pose was restored after a restart; true at most once."""
        status, self.restored_status.last = self.restored_status.last, None
        return status is not None and status.localized and self.restored_tf.last is not None

    def _set_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        assert self._amcl is not None
        spread = np.sqrt(np.diag(message.pose.planar_covariance))
        self._amcl.set_pose(message.pose.pose.se2, float(max(spread[0], spread[1])), float(spread[2]))

    @every(hz=1)
    def publish_particles(self) -> None:
        """Publish a sample of the particles for display."""
        if self._amcl is not None:
            self.particle_cloud.publish(particle_cloud(self._amcl, self.now_ns))
