"""Publishes the depth images as point clouds."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.design.export.urdf_frames import OPTICAL_FRAME
from chefbot.msgs.sensor_msgs import CameraInfo, Image, PointCloud2
from chefbot.runtime.node import In, Node, Out, topic
from chefbot.scan.camera import CameraModel, depth_image
from chefbot.scan.point_cloud import PointCloudConverter, point_cloud_message


class PointCloudParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the point cloud: its resolution."""

    step: Annotated[
        int, Meta(ge=1, le=64, description="every how many pixels of a row and of a column there is a point")
    ] = 4


class PointCloudNode(Node):
    """Publishes `camera/depth/points` for each depth image, ordered as its pixels, with the stamp of the image.

    The intrinsics are those of the camera's `camera_info`; images of another size than theirs, or than the robot
    file's before one has arrived, are left out. A robot without depth camera has no point cloud.
    """

    params: PointCloudParams
    depth: In[Image] = topic("camera/depth/image_raw")
    camera_info: In[CameraInfo] = topic("camera/depth/camera_info")
    points: Out[PointCloud2] = topic("camera/depth/points")

    def start(self) -> None:
        """Prepare the conversion from the robot file's camera."""
        camera = self.robot.sensors.depth_camera
        self._model = CameraModel.of(camera) if camera is not None else None
        if self._model is None:
            self.points.unadvertise()
            return
        self._converter = PointCloudConverter(self._model, self.params.step)

    def on_camera_info(self, info: CameraInfo) -> None:
        """Take over the camera's intrinsics. ScanError if they describe no depth camera."""
        if self._model is None:
            return
        model = CameraModel.from_camera_info(info, self._model.range_min, self._model.range_max)
        if model != self._model:
            self._model, self._converter = model, PointCloudConverter(model, self.params.step)

    def on_depth(self, image: Image) -> None:
        """Publish the points of an image. ScanError if it is no depth image."""
        if self._model is None or (image.width, image.height) != (self._model.width, self._model.height):
            return
        size = (image.height, image.width, image.step)
        depth = depth_image(image.data, image.encoding, *size, bool(image.is_bigendian))
        header = msgspec.structs.replace(image.header, frame_id=OPTICAL_FRAME)
        self.points.publish(point_cloud_message(header, self._converter.points(depth)))
