"""Converts depth images to a planar laser scan and to an obstacle scan of all heights."""

from __future__ import annotations

import math
from functools import cached_property

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.urdf_frames import DEPTH_FRAME
from chefbot.errors import ScanError
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import CameraInfo, Image, LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.geometry.layout import overall_height
from chefbot.runtime.node import In, Node, Out, topic
from chefbot.scan.camera import CameraModel, depth_image
from chefbot.scan.depth_to_scan import DepthToScan, DepthToScanParams
from chefbot.scan.drop_offs import FloorLimits
from chefbot.scan.obstacle_scan import ObstacleScanner, ObstacleScanParams, without_floor_gaps

OVERHEAD_CLEARANCE = 0.05
"""Height above the robot's top that must be free as well, m."""
FIELD_OF_VIEW_TOLERANCE = 0.1
"""Share by which a camera's field of view may differ from that of the robot file without a warning."""
NO_CAMERA = "the robot file has no depth camera, so its images cannot be placed; add it there"
WAITING_NS = 1_000_000_000
"""Time for which images that do not fit the robot file wait for a camera_info, ns."""


class DepthToScanNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the two conversions."""

    scan: DepthToScanParams = DepthToScanParams()
    obstacles: ObstacleScanParams = ObstacleScanParams()


class DepthToScanNode(Node):
    """Publishes the planar scan on `scan` if the robot has no lidar, else on `depth_scan` for display.

    The intrinsics are those of the camera's `camera_info`; until one arrives, the images must be those of the robot
    file's camera. Distorted images are used as they are.
    """

    params: DepthToScanNodeParams
    depth: In[Image] = topic("camera/depth/image_raw")
    camera_info: In[CameraInfo] = topic("camera/depth/camera_info")
    scan: Out[LaserScan]
    depth_scan: Out[LaserScan]
    obstacles: Out[ObstacleScan]
    notice: Out[String] = topic("camera/notice")

    def start(self) -> None:
        """Prepare the conversions from the robot file's camera."""
        camera = self.robot.sensors.depth_camera
        if camera is None:
            for port in (self.scan, self.depth_scan, self.obstacles, self.notice):
                port.unadvertise()
            return  # the robot has no depth camera
        self._camera = camera
        self._out, unused = self.scan, self.depth_scan
        if self.robot.sensors.lidar is not None:
            self._out, unused = unused, self._out
        unused.unadvertise()
        self._has_info = False
        self._first_ns: int | None = None
        self._set_model(CameraModel.of(camera))

    def on_camera_info(self, info: CameraInfo) -> None:
        """Take over the camera's intrinsics. ScanError if they describe no depth camera."""
        if self.robot.sensors.depth_camera is None:
            return
        model = CameraModel.from_camera_info(info, self._camera.range_min, self._camera.range_max)
        if model != self._model:
            self._set_model(model)
        if not self._has_info:
            self._has_info = True
            self._compare_with_robot_file(model, info)

    def on_depth(self, image: Image) -> None:
        """Convert a depth image; the scans keep its stamp. ScanError if the robot has no depth camera."""
        if self.robot.sensors.depth_camera is None:
            raise ScanError(NO_CAMERA)
        if not self._is_placed(image):
            return
        size = (image.height, image.width, image.step)
        depth = depth_image(image.data, image.encoding, *size, bool(image.is_bigendian))
        header = msgspec.structs.replace(image.header, frame_id=DEPTH_FRAME)
        points = self._obstacles.scan(depth)
        angles = self._obstacles.angles
        ranges = without_floor_gaps(self._converter.convert(depth), self._converter.angles, points, angles)
        self._out.publish(self._laser_scan(header, ranges))
        first, step = float(angles[0]), float(angles[1] - angles[0])
        self.obstacles.publish(ObstacleScan(header, first, step, self._camera.range_max, *points))

    def _set_model(self, model: CameraModel) -> None:
        """Prepare the conversions for a camera model."""
        camera, params = self._camera, self.params
        self._model = model
        self._converter = DepthToScan(model, params.scan)
        max_height = overall_height(self.robot) + OVERHEAD_CLEARANCE
        floor = FloorLimits.of(self.robot, camera, params.obstacles.pitch_tolerance)
        self._obstacles = ObstacleScanner(model, camera.mount, max_height, floor, params.obstacles)

    def _is_placed(self, image: Image) -> bool:
        """Return whether the intrinsics of an image are known. ScanError if its camera_info has not come in time."""
        if self._has_info or (image.width, image.height) == (self._model.width, self._model.height):
            return True
        if self._first_ns is None:
            self._first_ns = self.now_ns
        if self.now_ns - self._first_ns < WAITING_NS:
            return False
        raise ScanError(
            f"depth image of {image.width} x {image.height} pixels, but the robot file's camera has"
            f" {self._model.width} x {self._model.height}, and its driver publishes no camera_info"
        )

    def _compare_with_robot_file(self, model: CameraModel, info: CameraInfo) -> None:
        """Warn of a field of view that differs from the robot file's, and of images that are distorted."""
        seen, given = model.field_of_view, self._camera.field_of_view
        if abs(seen - given) > FIELD_OF_VIEW_TOLERANCE * given:
            text = (
                f"the depth camera sees {math.degrees(seen):.0f} degrees, but the robot file has"
                f" {math.degrees(given):.0f}: correct sensors.depth_camera.field_of_view"
            )
            self.notice.publish(String(f"Warning: {text}."))
        if info.d.any():
            self.notice.publish(String("Warning: the depth images are distorted; use rectified ones."))

    def _laser_scan(self, header: Header, ranges: NDArray[np.float32]) -> LaserScan:
        scan, limits = self._converter, (self._camera.range_min, self._camera.range_max)
        angles = (scan.angle_min, scan.angle_max, scan.angle_increment)
        return LaserScan(header, *angles, 0.0, self._period, *limits, ranges)

    @cached_property
    def _period(self) -> float:
        return 1.0 / self._camera.rate
