"""Tracks people in laser scans and depth images."""

from __future__ import annotations

import math

from chefbot.costmap.glass_detection import GlassDetector
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.geometry_msgs import PoseArray
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.people_msgs import People
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.scans.deskewing import when_deskewed
from chefbot.people.observation import Observation, observe_obstacles, observe_scan
from chefbot.people.params import PeopleTrackerParams
from chefbot.people.people_messages import people_message, people_poses, tracked_people
from chefbot.people.tracker import PeopleTracker
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.runtime.transform_buffer import TransformError

FRAME = "odom"
"""Frame of the tracks: poses in it do not jump."""


class PeopleTrackerNode(Node):
    """Publishes people with numbers in the frame odom, after each scan, or obstacle scan without a lidar.

    `people` is what ROS's leg detectors publish, `people/poses` the same for display; `tracked_people` has
    covariances and last sightings.
    """

    params: PeopleTrackerParams
    map: In[OccupancyGrid]
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    people: Out[People]
    poses: Out[PoseArray] = topic("people/poses")
    tracked_people: Out[TrackedPeople]
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Create the tracker, which has no tracks yet."""
        self._tracker = PeopleTracker(self.params)
        self._glass = GlassDetector()
        self._has_lidar = self.robot.sensors.lidar is not None

    def on_map(self, message: OccupancyGrid) -> None:
        """Set the map, whose obstacles are not people."""
        self._tracker.set_map(message.grid)

    def on_scan(self, scan: LaserScan) -> None:
        """Track people in a scan of a lidar; without one the obstacle scans of the depth camera are used."""
        if self._has_lidar:
            when_deskewed(self.tf, scan, scan.header.frame_id, self._track_in_scan)

    def _track_in_scan(self, scan: LaserScan, pose: SE2) -> None:
        """Track people in a scan without skew; what glass returns moves along with the robot, and is nobody."""
        observation = observe_scan(self._glass.without_glass(pose, scan, math.inf), pose)
        self._update(observation, scan.header.stamp.ns, publish=True)

    def on_obstacles(self, scan: ObstacleScan) -> None:
        """Track people in an obstacle scan."""
        publish, stamp = not self._has_lidar, scan.header.stamp.ns
        update = lambda pose: self._update(observe_obstacles(scan, pose), stamp, publish=publish)  # noqa: E731
        self.tf.on_available(FRAME, scan.header.frame_id, stamp, update)

    def _update(self, observation: Observation, stamp_ns: int, *, publish: bool) -> None:
        """Update the tracks with what is seen from the sensor's pose."""
        if self._tracker.update(observation, stamp_ns / 1e9, self._map_pose()) and publish:
            self._publish()

    def _publish(self) -> None:
        header = Header.of(round(self._tracker.time * 1e9), FRAME)
        tracked = tracked_people(header, self._tracker.people)
        self.tracked_people.publish(tracked)
        self.people.publish(people_message(tracked))
        self.poses.publish(people_poses(tracked))

    def _map_pose(self) -> SE2 | None:
        """Return the pose of odom in the map, None before the robot is localized."""
        try:
            return self.tf.lookup("map", FRAME)
        except TransformError:
            return None

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish whether the tracker could use all messages that it received."""
        warning = self._tracker.take_warning()
        status = DiagnosticStatus(WARN if warning else OK, "people tracker", warning or "People are tracked.")
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, FRAME), (status,)))
