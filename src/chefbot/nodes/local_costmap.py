"""The local costmap in the frame `odom`, in which marked obstacles do not jump, and the health of its sensors."""

from __future__ import annotations

import contextlib
from functools import partial
from typing import Any

from chefbot.costmap.conversions import costmap_message
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import LIVE_PARAMS
from chefbot.costmap.sources import LASER
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.chefbot_msgs.maps import MapZones
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.nodes.navigation.costmap_layers import make_costmap, move_with_robot
from chefbot.nodes.people.marks import PeopleMarksNode
from chefbot.nodes.scans.deskewing import when_deskewed
from chefbot.nodes.scans.sensor_health import SensorHealthNode
from chefbot.runtime.node import In, Out, every, topic
from chefbot.runtime.transform_buffer import TransformError


class LocalCostmapNode(PeopleMarksNode, SensorHealthNode):
    """Base class of a node with a rolling costmap around the robot, which its obstacle sensors mark and clear.

    Its parameters have the fields `costmap` of type CostmapParams and `optional_sensors`.
    """

    live_params = tuple(f"costmap.{name}" for name in LIVE_PARAMS)
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    ultrasonic: In[Range]
    contact: In[PoseStamped]
    zones: In[MapZones]
    clear_costmaps: In[Float64]
    costmap: Out[OccupancyGrid] = topic("local_costmap/costmap", latched=True)

    def start(self) -> None:
        """Create an empty costmap around the robot."""
        super().start()
        self._costs = make_costmap(self.params.costmap, self.robot, rolling=True)

    def reconfigure(self, params: Any) -> None:
        """Apply new parameters to the costmap."""
        self.params = params
        self._costs.reconfigure(params.costmap)

    @property
    def is_active(self) -> bool:
        """Whether the node drives the robot at present, so that the costmap is published."""
        return False

    def on_scan(self, scan: LaserScan) -> None:
        """Update the laser's obstacle layer with a scan."""
        self._sensors.process_scan(scan, self.now_ns, self._pose())
        when_deskewed(self.tf, scan, scan.header.frame_id, self._mark_laser)

    def _mark_laser(self, scan: LaserScan, pose: SE2) -> None:
        self._costs.set_time(scan.header.stamp.ns / 1e9)
        self._mark(scan, pose)
        self._sensors.note_scan_marked(scan.header.stamp.ns)

    def on_obstacles(self, scan: ObstacleScan) -> None:
        """Update the camera's obstacle layers with an obstacle scan."""
        self._sensors.process_obstacles(scan, self.now_ns, self._pose())
        stamp, frame = scan.header.stamp.ns, scan.header.frame_id
        self.tf.on_available("odom", frame, stamp, lambda pose: self._mark_obstacles(pose, scan))

    def _mark_obstacles(self, pose: SE2, scan: ObstacleScan) -> None:
        self._costs.set_time(scan.header.stamp.ns / 1e9)
        self._mark(scan, pose)
        self._sensors.note_obstacles_marked(scan.header.stamp.ns)

    def on_ultrasonic(self, echo: Range) -> None:
        """Update the ranger's layer with an echo."""
        self.tf.on_available("odom", echo.header.frame_id, echo.header.stamp.ns, partial(self._mark, echo))

    def on_contact(self, contact: PoseStamped) -> None:
        """Mark what the robot has touched and stands at now, wherever the odometry was before the wheels slipped."""
        pose = self._pose()
        if pose is not None:
            self._mark(contact, pose)

    def _mark(self, message: Message, pose: SE2) -> None:
        """Mark and clear with a measurement from `pose` in odom."""
        self._costs.process(message, pose)

    def on_clear_costmaps(self, radius: Float64) -> None:
        """Clear the laser layer around the robot; a camera's stays, as it does not see what is beside the robot."""
        pose, lidar = self._pose(), self.robot.sensors.lidar
        if pose is not None and (lidar is None or lidar.full_turn):
            self._costs.clear_around(pose, radius.data, LASER)

    def _pose(self) -> SE2 | None:
        """Return the robot's pose in odom, None before the first odometry."""
        with contextlib.suppress(TransformError):
            return self.tf.lookup("odom", "base_link")
        return None

    def _costs_around(self, pose: SE2) -> Costmap:
        """Move the costmap to the robot and return its costs."""
        self._follow(self._costs, pose)
        return self._costs.update()

    def _follow(self, costs: LayeredCostmap, pose: SE2) -> None:
        """Move a rolling costmap to the robot, with the zones of the map where localization has them now."""
        costs.set_time(self.now_ns / 1e9)
        move_with_robot(costs, pose)
        with contextlib.suppress(TransformError):  # without localization there are no zones to obey
            if self.zones.last is not None:
                costs.process(self.zones.last, self.tf.lookup("odom", "map"))

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish the health of the obstacle sensors, also while no goal is active."""
        self._costs.set_time(self.now_ns / 1e9)
        self._publish_health(self._pose(), self._costs.update())

    @every(hz=1)
    def publish_costmap(self) -> None:
        """Publish the local costmap for display while the node drives the robot."""
        if self.is_active:
            self.costmap.publish(costmap_message(Header.of(self.now_ns, "odom"), self._costs.update()))
