"""Base class of mappers: from scans to the map, the transform map -> odom and the drive for the map recorder."""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from chefbot.costmap.glass_detection import GlassDetector
from chefbot.localization.messages import why_not_on_map
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import MappedScan, MapTrajectory
from chefbot.msgs.geometry_msgs import PoseWithCovarianceStamped, TransformStamped
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Empty, Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.scans.continued_map import ContinuedMap
from chefbot.nodes.scans.drive_messages import DriveMessages, trajectory_of
from chefbot.nodes.scans.map_publisher import MapPublisherNode
from chefbot.runtime.node import In, Out, every, restored, topic
from chefbot.slam.offline import Slam
from chefbot.storage.mapped_drives import MapperParams


class MapperNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters that every mapper has."""

    publish_drive: Annotated[
        bool, Meta(description="publish the scans that the map is made of, for the map recorder")
    ] = False
    continue_map: Annotated[
        str, Meta(description="map bundle, or its folder, whose map is continued; empty: a new map")
    ] = ""


class MapperNode(MapPublisherNode):
    """Publishes the map and the transform map -> odom; both frames initially coincide.

    So, as in ROS's slam_gmapping, the origin stays where the robot was switched on, however late the mapper starts.
    A message on `reset_map` begins an empty map at the pose by odometry. With `continue_map`, the map of earlier
    drives is continued where the robot is found on it, or from a pose on `initialpose`.
    """

    role = "The mapper"
    params: Any
    restored_tf: In[TFMessage] = restored("tf")
    reset_map: In[Empty]
    initialpose: In[PoseWithCovarianceStamped]
    tf_out: Out[TFMessage] = topic("tf")
    mapped_scan: Out[MappedScan]
    map_trajectory: Out[MapTrajectory]

    def start(self) -> None:
        """Build the map that is continued; another one begins at the first scan, with the laser's mount."""
        super().start()
        self._slam: Slam | None = None
        self._glass = GlassDetector()
        self._earlier: ContinuedMap | None = None
        self._changed = self._looking = False
        self._given: SE2 | None = None
        if not self.params.publish_drive:
            self.mapped_scan.unadvertise()
            self.map_trajectory.unadvertise()
        if self.params.continue_map:
            self._earlier = ContinuedMap(Path(self.params.continue_map))
            self._slam, self._changed = self._earlier.slam, True

    def on_reset_map(self, _: Empty) -> None:
        """Drop the map; the next scan begins another one."""
        self._slam = self._earlier = self.restored_tf.last = None

    def on_initialpose(self, message: PoseWithCovarianceStamped) -> None:
        """Continue the map of earlier drives from this pose of the robot at the next scan."""
        if self._earlier is None:
            reason = "a mapper takes a pose only for a map that it continues, before it has found the robot"
        else:
            reason = why_not_on_map(message)
        if reason:
            self.scan_notice.publish(String(f"The given pose is ignored: {reason}."))
        else:
            self._given = message.pose.pose.se2

    def process_scan(self, scan: LaserScan, odom: SE2) -> None:
        """Update the map with a scan; publish map->odom."""
        laser = self.tf.lookup("base_link", scan.header.frame_id)
        if self.restored_tf.last is not None:
            start = self.restored_tf.last.transforms[0].transform.se2 @ odom
            self.restored_tf.last = self._earlier = None
            self._slam = self._restart(laser, start)
        if self._slam is None:
            settings = self.settings()
            self._drive = DriveMessages(settings, laser, odom, continued=False)
            self._slam = self.new_slam(settings, laser, odom)
        if self._earlier is not None and not self._find_robot(self._earlier, laser, scan, odom):
            return
        scan = self._glass.without_glass(odom @ laser, scan)
        used = self._slam.update(scan.angles, scan.ranges, odom, scan.range_max)
        self._changed |= used
        transform = TransformStamped.of(scan.header.stamp.ns, "map", "odom", self._slam.map_T_odom)
        self.tf_out.publish(TFMessage((transform,)))
        if self.params.publish_drive:
            self.mapped_scan.publish(self._drive.next(scan, odom, used))

    @every(hz=0.5)
    def publish_map(self) -> None:
        """Publish the map if it has changed."""
        if self._slam is not None and self._changed:
            self._changed, header = False, Header.of(self.now_ns, "map")
            if self.params.publish_drive:
                self.map_trajectory.publish(trajectory_of(header, self._slam))
            self.publish_grid(header, self._slam.map())

    @abstractmethod
    def settings(self) -> MapperParams:
        """Return the parameters of a new map."""

    @abstractmethod
    def new_slam(self, settings: Any, laser: SE2, initial: SE2) -> Slam:
        """Return a mapper with an empty map; initial: pose of the robot in it."""

    @abstractmethod
    def restarted_slam(self, laser: SE2, start: SE2) -> Slam | None:
        """Return a mapper with the map from before a restart; start: pose of the robot in it. None: there is none."""

    def _restart(self, laser: SE2, start: SE2) -> Slam | None:
        slam = self.restarted_slam(laser, start)
        if slam is not None:
            self._drive = DriveMessages(self.settings(), laser, start, continued=True)
            self._changed = True
        return slam

    def _find_robot(self, earlier: ContinuedMap, laser: SE2, scan: LaserScan, odom: SE2) -> bool:
        """Return whether the robot was found on the map of earlier drives."""
        pose, self._given = self._given, None
        if pose is not None:
            earlier.place(laser, pose)
        elif (pose := earlier.find(laser, scan, odom)) is None:
            if not self._looking:
                self.scan_notice.publish(String(earlier.searching(self.settings())))
            self._looking = True
            return False
        self._drive = DriveMessages(earlier.params, laser, pose, continued=True)
        self._earlier = None
        self.scan_notice.publish(String(f"The robot is at {pose.text}; the map is continued."))
        return True
