"""Publishes the AprilTags in the pictures of the colour camera, and their frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.apriltag_msgs import AprilTagDetection, AprilTagDetectionArray, Point
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.sensors import TagSpec
from chefbot.runtime.node import In, Node, NoParams, Out, topic
from chefbot.scan.camera import color_camera_info
from chefbot.scan.color_image import rgb_pixels
from chefbot.tags.detector import Tag, TagDetector
from chefbot.tags.pose import tag_transform


class TagDetectorNode(Node):
    """Publishes `apriltag/detections` for each picture, and in `tf` a frame `FAMILY:NUMBER` for each tag.

    Topic, messages and frames are those of ROS's apriltag_ros: x right, y up, z out of the tag. The intrinsics are
    those of `camera_info`, and the robot file's before one has arrived. A robot whose file has no
    `sensors.color_camera.tags` detects none.
    """

    params: NoParams
    picture: In[Image] = topic("camera/color/image_raw")
    camera_info: In[CameraInfo] = topic("camera/color/camera_info")
    detections: Out[AprilTagDetectionArray] = topic("apriltag/detections")
    tf_out: Out[TFMessage] = topic("tf")

    def start(self) -> None:
        """Prepare the detector. UserError if OpenCV is not installed."""
        camera = self.robot.sensors.color_camera
        self._tags: TagSpec | None = None
        if camera is None or camera.tags is None:
            for port in (self.detections, self.tf_out):
                port.unadvertise()
            return
        self._tags, self._detector = camera.tags, TagDetector(camera.tags.family)
        self._use_intrinsics(color_camera_info(camera, Header()))

    def on_camera_info(self, info: CameraInfo) -> None:
        """Take over the camera's intrinsics, unless it has none."""
        if self._tags is not None and info.k[0] > 0.0 and info.k[4] > 0.0:
            self._use_intrinsics(info)

    def _use_intrinsics(self, info: CameraInfo) -> None:
        self._k: NDArray[np.float64] = info.k.reshape(3, 3)
        self._distortion: NDArray[np.float64] = info.d if len(info.d) else np.zeros(5)

    def on_picture(self, image: Image) -> None:
        """Publish the tags of a picture. ScanError if it is an image of depth."""
        if self._tags is None:
            return
        found = self._detector.detect(rgb_pixels(image))
        detections = tuple(self._detection(tag) for tag in found)
        self.detections.publish(AprilTagDetectionArray(image.header, detections))
        transforms = tuple(one for tag in found if (one := self._transform(tag, image.header)) is not None)
        if transforms:
            self.tf_out.publish(TFMessage(transforms))

    def _detection(self, tag: Tag) -> AprilTagDetection:
        assert self._tags is not None
        corners, h = tuple(Point(x, y) for x, y in tag.corners.tolist()), tag.homography
        return AprilTagDetection(
            self._tags.family,
            tag.id,
            tag.hamming,
            decision_margin=tag.margin,
            centre=Point(float(h[2] / h[8]), float(h[5] / h[8])),
            corners=corners,
            homography=h,
        )

    def _transform(self, tag: Tag, header: Header) -> TransformStamped | None:
        assert self._tags is not None
        transform = tag_transform(tag.corners, self._tags.size, self._k, self._distortion)
        if transform is None:
            return None
        return TransformStamped(header, f"{self._tags.family}:{tag.id}", transform)
