"""Scans to a map, as slam_gmapping does it."""

from __future__ import annotations

import msgspec

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.node import In, Node, Out, every, last_words, topic
from chefbot.scan.usable_range import trusted_range
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams

CAMERA = GmappingParams(srr=0.01, str=0.003, srt=0.003, stt=0.006, least_shift=0.002, least_turn=0.001)
"""A narrow view says little of the heading: believe wheels and gyro, which err so little in one step."""


class GmappingNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the mapper, for each kind of mapping sensor."""

    lidar: GmappingParams = GmappingParams()
    camera: GmappingParams = CAMERA


class GmappingNode(Node):
    """Publishes the map and the transform map -> odom; the map frame begins where that of odometry does.

    So, as in ROS's slam_gmapping, home stays where the robot was switched on, however late the mapper comes.

    In another life it goes on with the map that was told last, and where the robot is by odometry since.
    """

    live_params = ("*.*_update", "*.clear_range", "*.s[rt][rt]", "*.least_*", "*.resample_threshold")
    params: GmappingNodeParams
    scan: In[LaserScan]
    map_before: In[OccupancyGrid] = last_words("map")
    frames_before: In[TFMessage] = last_words("tf")
    map: Out[OccupancyGrid] = topic(latched=True)
    tf_out: Out[TFMessage] = topic("tf")

    def start(self) -> None:
        """The sensor's place comes with the first scan."""
        self._slam: Gmapping | None = None
        self._changed = False

    def reconfigure(self, params: GmappingNodeParams) -> None:
        """From the next scan on."""
        self.params = params
        if self._slam is not None:
            self._slam.retune(self._settings())

    def on_scan(self, scan: LaserScan) -> None:
        """Wait until odometry has reached the scan's time."""
        stamp = scan.header.stamp.ns
        self.tf.when("odom", "base_link", stamp, lambda odom: self._update(scan, odom))

    def _update(self, scan: LaserScan, odom: SE2) -> None:
        if self._slam is None:
            self._slam = self._begin(self.tf.lookup("base_link", scan.header.frame_id), odom)
        self._changed |= self._slam.update(scan.angles, scan.ranges, odom, scan.range_max)
        transform = TransformStamped.of(scan.header.stamp.ns, "map", "odom", self._slam.map_T_odom)
        self.tf_out.publish(TFMessage((transform,)))

    def _begin(self, sensor: SE2, odom: SE2) -> Gmapping:
        """With an empty map, or with that of a life before."""
        told, frames = self.map_before.last, self.frames_before.last
        if told is None or frames is None:
            return Gmapping(self._settings(), sensor, odom)
        slam = Gmapping(self._settings(), sensor, frames.transforms[0].transform.se2 @ odom)
        slam.resume(told.grid)
        self._changed = True
        return slam

    def _settings(self) -> GmappingParams:
        """Of the robot's sensor, with this run's seed; no walls from ranges that are not known to a cell."""
        params = self.params.camera if self.robot.sensors.lidar is None else self.params.lidar
        seed = int(self.context.rng().integers(2**31)) + params.seed
        reach = min(params.max_range, trusted_range(self.robot, params.resolution))
        return msgspec.structs.replace(params, seed=seed, max_range=reach)

    @every(hz=0.5)
    def publish_map(self) -> None:
        """Only when something was added."""
        if self._slam is not None and self._changed:
            self._changed = False
            self.map.publish(OccupancyGrid.of(Header.of(self.now_ns, "map"), self._slam.map()))
