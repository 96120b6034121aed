"""Simulates sensors of a robot without a world: no obstacle for the camera, a distant wall for the lidar."""

from __future__ import annotations

import numpy as np

from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import Node, NoParams, Out, every

WALL = 7.0
BINS = 160


class ClearSensorsNode(Node):
    """Publishes a laser scan and an obstacle scan at 10 Hz, in base_link.

    With `blind` the camera measures neither obstacles nor floor; `wall` is the distance of a wall in metres or inf;
    `ranges` are those of the lidar, one a degree from behind.
    """

    params: NoParams
    scan: Out[LaserScan]
    obstacles: Out[ObstacleScan]

    def start(self) -> None:
        """Start without a wall and without a fault."""
        self.blind, self.wall = False, np.inf
        self.ranges = np.full(360, WALL, np.float32)

    @every(hz=10)
    def publish_scans(self) -> None:
        """Publish both scans."""
        header = Header.of(self.now_ns, "base_link")
        far = np.full(BINS, np.inf if self.blind else self.wall, np.float32)
        self.scan.publish(LaserScan(header, -np.pi, np.pi, np.pi / 180, 0.0, 0.1, 0.16, 8.0, self.ranges))
        clear_to = 0.0 if self.blind else min(self.wall, 4.0)
        floor = np.full(BINS, 0.7, np.float32), np.full(BINS, clear_to, np.float32)
        self.obstacles.publish(ObstacleScan(header, -0.5, 1.0 / BINS, 8.0, far, *floor))
