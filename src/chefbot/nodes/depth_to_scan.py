"""Converts depth images to a planar laser scan and to an obstacle scan of all heights."""

from __future__ import annotations

from functools import cached_property

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.urdf_frames import DEPTH_FRAME
from chefbot.errors import ScanError
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.geometry.layout import overall_height
from chefbot.runtime.node import In, Node, Out, topic
from chefbot.scan.camera import CameraModel, depth_image
from chefbot.scan.depth_to_scan import DepthToScan, DepthToScanParams
from chefbot.scan.drop_offs import FloorLimits
from chefbot.scan.obstacle_scan import ObstacleScanner, ObstacleScanParams, without_floor_gaps

OVERHEAD = 0.05
"""Height above the robot's top that must be free as well, m."""
NO_CAMERA = "the robot file has no depth camera, so its images cannot be placed; add it there"


class DepthToScanNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the two conversions."""

    scan: DepthToScanParams = DepthToScanParams()
    obstacles: ObstacleScanParams = ObstacleScanParams()


class DepthToScanNode(Node):
    """Publishes the planar scan on `scan` if the robot has no lidar, else on `depth_scan` for display."""

    params: DepthToScanNodeParams
    depth: In[Image] = topic("camera/depth/image_raw")
    scan: Out[LaserScan]
    depth_scan: Out[LaserScan]
    obstacles: Out[ObstacleScan]

    def start(self) -> None:
        """Prepare the conversions from the robot's camera model."""
        camera = self.robot.sensors.depth_camera
        if camera is None:
            for port in (self.scan, self.depth_scan, self.obstacles):
                port.unadvertise()
            return  # the robot has no depth camera
        self._camera = camera
        self._out, unused = self.scan, self.depth_scan
        if self.robot.sensors.lidar is not None:
            self._out, unused = unused, self._out
        unused.unadvertise()
        self._model = CameraModel.of(camera)
        self._converter = DepthToScan(self._model, self.params.scan)
        max_height = overall_height(self.robot) + OVERHEAD
        floor = FloorLimits.of(self.robot, camera, self.params.obstacles.pitch_tolerance)
        self._obstacles = ObstacleScanner(self._model, camera.mount, max_height, floor, self.params.obstacles)

    def on_depth(self, image: Image) -> None:
        """Convert a depth image; the scans keep its stamp. ScanError if the robot has no depth camera."""
        if self.robot.sensors.depth_camera is None:
            raise ScanError(NO_CAMERA)
        size = (image.height, image.width, image.step)
        depth = depth_image(image.data, image.encoding, *size, bool(image.is_bigendian))
        header = msgspec.structs.replace(image.header, frame_id=DEPTH_FRAME)
        points = self._obstacles.scan(depth)
        angles = self._obstacles.angles
        ranges = without_floor_gaps(self._converter.convert(depth), self._converter.angles, points, angles)
        self._out.publish(self._laser_scan(header, ranges))
        first, step = float(angles[0]), float(angles[1] - angles[0])
        self.obstacles.publish(ObstacleScan(header, first, step, self._camera.range_max, *points))

    def _laser_scan(self, header: Header, ranges: NDArray[np.float32]) -> LaserScan:
        scan, limits = self._converter, (self._camera.range_min, self._camera.range_max)
        angles = (scan.angle_min, scan.angle_max, scan.angle_increment)
        return LaserScan(header, *angles, 0.0, self._period, *limits, ranges)

    @cached_property
    def _period(self) -> float:
        return 1.0 / self._camera.rate
