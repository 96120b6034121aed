"""Grid-based FastSLAM, with the interface of slam_gmapping."""

from __future__ import annotations

import msgspec

from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Empty, Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.scans.scan_listener import ScanListenerNode
from chefbot.runtime.node import In, Out, every, restored, topic
from chefbot.scan.usable_range import usable_range
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams

CAMERA = GmappingParams(
    odometry_noise=OdometryNoise(
        translation_from_translation=0.01,
        translation_from_rotation=0.003,
        rotation_from_translation=0.003,
        rotation_from_rotation=0.006,
    ),
    min_translation_noise=0.002,
    min_rotation_noise=0.001,
)
"""Lower odometry noise for a camera: a narrow field of view contains little information about the heading."""


class GmappingNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the mapper for each kind of mapping sensor."""

    lidar: GmappingParams = GmappingParams()
    camera: GmappingParams = CAMERA


class GmappingNode(ScanListenerNode):
    """Publishes the map and the transform map -> odom; both frames initially coincide.

    So, as in ROS's slam_gmapping, the origin stays where the robot was switched on, however late the mapper starts.
    After a restart it continues with the last published map, at the pose by odometry since. A message on `reset_map`
    begins an empty map at the pose by odometry.
    """

    live_params = ("*.*_update", "*.clear_range", "*_noise*", "*.resample_threshold")
    role = "The mapper"
    params: GmappingNodeParams
    restored_map: In[OccupancyGrid] = restored("map")
    restored_tf: In[TFMessage] = restored("tf")
    reset_map: In[Empty]
    map: Out[OccupancyGrid] = topic(latched=True)
    tf_out: Out[TFMessage] = topic("tf")

    def start(self) -> None:
        """Start without a filter, which is created at the first scan with the sensor's mount."""
        super().start()
        self._slam: Gmapping | None = None
        self._changed = False

    def reconfigure(self, params: GmappingNodeParams) -> None:
        """Apply new parameters from the next scan on."""
        self.params = params
        if self._slam is not None:
            self._slam.retune(self._settings())

    def on_reset_map(self, _: Empty) -> None:
        """Drop the map; the next scan begins another one."""
        self._slam = self.restored_map.last = None

    def process_scan(self, scan: LaserScan, odom: SE2) -> None:
        """Update the particle filter and its map with a scan; publish map->odom."""
        if self._slam is None:
            self._slam = self._create_slam(self.tf.lookup("base_link", scan.header.frame_id), odom)
        self._changed |= self._slam.update(scan.angles, scan.ranges, odom, scan.range_max)
        transform = TransformStamped.of(scan.header.stamp.ns, "map", "odom", self._slam.map_T_odom)
        self.tf_out.publish(TFMessage((transform,)))

    def _create_slam(self, sensor: SE2, odom: SE2) -> Gmapping:
        """Create the filter with an empty map, or with the map restored after a restart."""
        map_message, tf_message = self.restored_map.last, self.restored_tf.last
        if map_message is None or tf_message is None:
            return Gmapping(self._settings(), sensor, odom)
        slam = Gmapping(self._settings(), sensor, tf_message.transforms[0].transform.se2 @ odom)
        slam.resume(map_message.grid)
        self._changed = True
        return slam

    def _settings(self) -> GmappingParams:
        """Return the parameters of the robot's sensor with this run's seed and the usable maximum range."""
        params = self.params.camera if self.robot.sensors.lidar is None else self.params.lidar
        seed = int(self.context.rng().integers(2**31)) + params.seed
        max_range = min(params.max_range, usable_range(self.robot, params.resolution))
        return msgspec.structs.replace(params, seed=seed, max_range=max_range)

    @every(hz=0.5)
    def publish_map(self) -> None:
        """Publish the map if it has changed."""
        if self._slam is not None and self._changed:
            self._changed = False
            self.map.publish(OccupancyGrid.of(Header.of(self.now_ns, "map"), self._slam.map()))
