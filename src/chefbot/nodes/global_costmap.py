"""The global costmap in the frame `map`: the static map and the obstacle layers of all sensors."""

from __future__ import annotations

from typing import Any

from chefbot.costmap.conversions import costmap_message
from chefbot.costmap.params import LIVE_PARAMS
from chefbot.costmap.pose_jump import PoseJumpDetector
from chefbot.costmap.sources import DROP_OFFS, LASTING_SOURCES
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.chefbot_msgs.maps import MapZones
from chefbot.msgs.chefbot_msgs.navigation import CostmapCell
from chefbot.msgs.geometry_msgs import PointStamped, PoseStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.nodes.navigation.costmap_cell import cell_message
from chefbot.nodes.navigation.costmap_layers import make_costmap
from chefbot.nodes.people.marks import PeopleMarksNode
from chefbot.nodes.scans.deskewing import when_deskewed
from chefbot.runtime.node import In, Out, every, topic
from chefbot.runtime.transform_buffer import TransformError


class GlobalCostmapNode(PeopleMarksNode):
    """Base class of a node with a costmap of the whole map, which the obstacle sensors mark and clear.

    Its parameters have a field `costmap` of type CostmapParams.
    """

    fixed_frame = "map"
    live_params = tuple(f"costmap.{name}" for name in LIVE_PARAMS)
    map: In[OccupancyGrid]
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    ultrasonic: In[Range]
    contact: In[PoseStamped]
    zones: In[MapZones]
    clear_costmaps: In[Float64]
    clicked_point: In[PointStamped]
    costmap_cell: Out[CostmapCell]
    costmap: Out[OccupancyGrid] = topic("global_costmap/costmap", latched=True)

    def start(self) -> None:
        """Create the global costmap, which is empty before the first map."""
        self._costs = make_costmap(self.params.costmap, self.robot, rolling=False)
        self._pose_jump = PoseJumpDetector()

    def reconfigure(self, params: Any) -> None:
        """Apply new parameters to the costmap."""
        self.params = params
        self._costs.reconfigure(params.costmap)

    def on_map(self, message: OccupancyGrid) -> None:
        """Set a new or grown static map."""
        self._costs.process(message, IDENTITY)

    def on_zones(self, message: MapZones) -> None:
        """Set the zones of the map."""
        self._costs.process(message, IDENTITY)

    def on_scan(self, scan: LaserScan) -> None:
        """Pass a scan to the layers."""
        stamp = scan.header.stamp.ns
        mark = lambda still, pose: self._mark(still, pose, stamp)  # noqa: E731
        when_deskewed(self.tf, scan, scan.header.frame_id, mark)

    def on_obstacles(self, scan: ObstacleScan) -> None:
        """Pass an obstacle scan of the camera to the layers."""
        self._place(scan, scan.header)

    def on_ultrasonic(self, echo: Range) -> None:
        """Pass an echo to the layers."""
        self._place(echo, echo.header)

    def on_contact(self, contact: PoseStamped) -> None:
        """Pass to the layers what the robot has touched, with its pose on the map before the wheels slipped."""
        self._pose_jump.note_contact(self.now_ns)
        stamp_ns, frame = contact.header.stamp.ns, contact.header.frame_id
        self.tf.on_available("odom", frame, stamp_ns, lambda pose: self._mark_contact(contact, pose))

    def _mark_contact(self, contact: PoseStamped, odom_T_robot: SE2) -> None:
        newest_ns = self.tf.newest_ns("odom")
        if self.map.last is not None and newest_ns is not None:
            map_T_odom = self.tf.lookup("map", "odom", min(contact.header.stamp.ns, newest_ns))
            self._costs.set_time(self.now_ns / 1e9)
            self._costs.process(contact, map_T_odom @ odom_T_robot)

    def _place(self, message: Message, header: Header) -> None:
        """Pass a message to the layers as soon as the odometry pose of its frame is known."""
        stamp = header.stamp.ns
        self.tf.on_available("odom", header.frame_id, stamp, lambda pose: self._mark(message, pose, stamp))

    def _mark(self, message: Message, odom_T_sensor: SE2, stamp_ns: int) -> None:
        """Mark with the odometry pose at the time of the measurement and the latest map -> odom transform."""
        try:
            map_T_odom = self.tf.lookup("map", "odom")
        except TransformError:
            return  # not localized yet: marks would be in the wrong place
        if self.map.last is not None:
            if self._pose_jump.process(map_T_odom, odom_T_sensor, stamp_ns):
                self._costs.clear()
            self._costs.set_time(stamp_ns / 1e9)
            self._costs.process(message, map_T_odom @ odom_T_sensor)

    def on_clear_costmaps(self, radius: Float64) -> None:
        """Clear the marks within a radius (m) of the robot, but not those that other sensors do not see."""
        try:
            robot = self.tf.lookup("map", "base_link")
            self._costs.clear_around(robot, radius.data, keep=(DROP_OFFS, *LASTING_SOURCES))
        except TransformError:
            self._costs.clear()  # not localized: all marks are unreliable

    def on_clicked_point(self, clicked: PointStamped) -> None:
        """Publish the cost of the cell at a point, and what marked it: RViz's "Publish Point", or the web UI."""
        try:
            point = self.tf.lookup("map", clicked.header.frame_id) @ SE2(
                clicked.point.x, clicked.point.y, 0.0
            )
        except TransformError:
            return  # the point is nowhere on the map yet
        if self.map.last is not None:
            header = Header.of(self.now_ns, "map")
            self.costmap_cell.publish(cell_message(header, self._costs, point, self.robot))

    @every(hz=1)
    def publish_costmap(self) -> None:
        """Publish the global costmap for display."""
        if self.map.last is not None:
            header = Header.of(self.now_ns, "map")
            self.costmap.publish(costmap_message(header, self._costs.update()))
