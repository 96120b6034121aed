"""Grid-based FastSLAM, with the interface of slam_gmapping."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_maps import MappedScan
from chefbot.msgs.geometry_msgs import PoseWithCovarianceStamped, TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Empty, Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.scans.continued_map import LOOKING, ContinuedMap
from chefbot.nodes.scans.drive_messages import DriveMessages
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
    publish_drive: Annotated[
        bool, Meta(description="publish the scans that the map is made of, for the map recorder")
    ] = False
    continue_map: Annotated[
        str, Meta(description="map bundle, or its folder, whose map is continued; empty: a new map")
    ] = ""


class GmappingNode(ScanListenerNode):
    """Publishes the map and the transform map -> odom; both frames initially coincide.

    So, as in ROS's slam_gmapping, the origin stays where the robot was switched on, however late the mapper starts.
    After a restart it continues with the last published map, at the pose by odometry since. A message on `reset_map`
    begins an empty map at the pose by odometry. With `continue_map`, the map of earlier drives is continued where the
    robot is found on it, or from a pose on `initialpose`.
    """

    live_params = ("*.*_update", "*.clear_range", "*_noise*", "*.resample_threshold")
    role = "The mapper"
    params: GmappingNodeParams
    restored_map: In[OccupancyGrid] = restored("map")
    restored_tf: In[TFMessage] = restored("tf")
    reset_map: In[Empty]
    initialpose: In[PoseWithCovarianceStamped]
    map: Out[OccupancyGrid] = topic(latched=True)
    tf_out: Out[TFMessage] = topic("tf")
    mapped_scan: Out[MappedScan]

    def start(self) -> None:
        """Start without a filter, which is created at the first scan with the sensor's mount."""
        super().start()
        self._slam: Gmapping | None = None
        self._earlier: ContinuedMap | None = None
        self._changed = self._looking = False
        if not self.params.publish_drive:
            self.mapped_scan.unadvertise()
        if self.params.continue_map and self.restored_map.last is None:
            self._earlier = ContinuedMap(Path(self.params.continue_map))
            self._slam, self._changed = self._earlier.slam, True

    def reconfigure(self, params: GmappingNodeParams) -> None:
        """Apply new parameters from the next scan on."""
        self.params = params
        if self._slam is not None:
            self._slam.retune(self._settings())

    def on_reset_map(self, _: Empty) -> None:
        """Drop the map; the next scan begins another one."""
        self._slam = self._earlier = self.restored_map.last = None

    def on_initialpose(self, message: PoseWithCovarianceStamped) -> None:
        """Continue the map of earlier drives from this pose of the robot."""
        if self._earlier is not None:
            self._earlier.given = message.pose.pose.se2

    def process_scan(self, scan: LaserScan, odom: SE2) -> None:
        """Update the particle filter and its map with a scan; publish map->odom."""
        if self._slam is None:
            self._slam = self._create_slam(self.tf.lookup("base_link", scan.header.frame_id), odom)
        if self._earlier is not None and not self._find_robot(self._earlier, scan, odom):
            return
        used = self._slam.update(scan.angles, scan.ranges, odom, scan.range_max)
        self._changed |= used
        transform = TransformStamped.of(scan.header.stamp.ns, "map", "odom", self._slam.map_T_odom)
        self.tf_out.publish(TFMessage((transform,)))
        if self.params.publish_drive:
            self.mapped_scan.publish(self._drive.next(scan, odom, used))

    def _find_robot(self, earlier: ContinuedMap, scan: LaserScan, odom: SE2) -> bool:
        """Return whether the robot was found on the map of earlier drives."""
        laser = self.tf.lookup("base_link", scan.header.frame_id)
        pose = earlier.find(laser, scan, odom)
        if pose is None:
            if not self._looking:
                self.scan_remark.publish(String(LOOKING))
            self._looking = True
            return False
        self._drive = DriveMessages(earlier.params, laser, pose, continued=True)
        self._earlier = None
        text = f"The robot is at x {pose.x:.2f} m, y {pose.y:.2f} m, yaw {pose.yaw:.2f} rad; the map is continued."
        self.scan_remark.publish(String(text))
        return True

    def _create_slam(self, sensor: SE2, odom: SE2) -> Gmapping:
        """Create the filter with an empty map, or with the map restored after a restart."""
        map_message, tf_message, settings = self.restored_map.last, self.restored_tf.last, self._settings()
        if map_message is None or tf_message is None:
            self._drive = DriveMessages(settings, sensor, odom, continued=False)
            return Gmapping(settings, sensor, odom)
        start = tf_message.transforms[0].transform.se2 @ odom
        self._drive = DriveMessages(settings, sensor, start, continued=True)
        slam = Gmapping(settings, sensor, start)
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
