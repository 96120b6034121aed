"""Base class of nodes that need scans: each scan with its odometry, and a sentence when none arrive."""

from __future__ import annotations

from typing import ClassVar

from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.nodes.scans.deskewing import when_deskewed
from chefbot.runtime.node import In, Node, Out, every, topic

MAX_SILENCE_NS = 2_000_000_000
"""Time without a scan after which it is reported, ns; it is looked at once a second."""


class ScanListenerNode(Node):
    """Base class of nodes that need scans; `role` is the subject of the sentences about missing ones."""

    role: ClassVar[str] = "The node"
    scan: In[LaserScan]
    scan_notice: Out[String] = topic("scan/notice")

    def start(self) -> None:
        """Begin to wait for scans."""
        self._received_ns, self._reported = self.now_ns, False

    def on_scan(self, scan: LaserScan) -> None:
        """Process a scan once odometry at its time is available."""
        self._received_ns = self.now_ns
        if self._reported:
            self._reported = False
            self.scan_notice.publish(String(f"{self.role} receives scans again."))
        if self.wants_scans:
            when_deskewed(self.tf, scan, "base_link", self.process_scan)

    @property
    def wants_scans(self) -> bool:
        """Whether scans are processed at present."""
        return True

    def process_scan(self, scan: LaserScan, odom: SE2) -> None:
        """Process a scan without skew, with the pose of base_link in odom at its stamp; here it is ignored."""

    @every(hz=1)
    def look_for_scans(self) -> None:
        """Report once that no scan arrives."""
        if not self._reported and self.now_ns - self._received_ns > MAX_SILENCE_NS:
            self._reported = True
            self.scan_notice.publish(String(f"{self.role} {self._missing()}."))

    def _missing(self) -> str:
        lidar = self.robot.sensors.lidar
        name = "depth camera" if lidar is None else "lidar"
        seconds = MAX_SILENCE_NS // 1_000_000_000
        return f"has received no scan for {seconds} s: look at the {name}, its cable and its driver"
