"""Driver of depth cameras: images, their intrinsics, and the camera's health."""

from __future__ import annotations

from functools import partial

from chefbot.design.export.urdf_frames import OPTICAL_FRAME
from chefbot.devices.cameras.camera import CameraFrame, StreamRequest, opener_of
from chefbot.devices.cameras.camera_device import CameraDevice
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.node import NoParams, Out, topic
from chefbot.scan.camera import CameraModel

NO_DRIVER = (
    "Depth camera: the robot file names no driver (sensors.depth_camera.driver); images are expected from another"
    " machine."
)


class DepthCameraDevice(CameraDevice[CameraFrame]):
    """Publishes the images of the robot's depth camera, and is back after its cable was out.

    A robot whose file names no driver has its images from another node, and this one does nothing.
    """

    params: NoParams
    depth: Out[Image] = topic("camera/depth/image_raw")
    camera_info: Out[CameraInfo] = topic("camera/depth/camera_info")
    notice: Out[String] = topic("camera/notice")

    def start(self) -> None:
        """Begin to look for the camera. UserError if the SDK of its maker is not installed."""
        camera = self.robot.sensors.depth_camera
        if camera is None or not camera.driver:
            for port in (self.depth, self.camera_info, self.diagnostics, self.notice):
                port.unadvertise()
            self.announcement = "" if camera is None else NO_DRIVER
            return
        self._camera = camera
        request = StreamRequest(camera.serial, camera.width, camera.height, camera.rate)
        self.announcement = f"Depth camera: looking for {camera.driver}, serial number {camera.serial}."
        opened = partial(opener_of(camera.driver), request)
        self.connect(opened, camera.rate, "depth camera", camera.driver, OPTICAL_FRAME)

    def publish_image(self, image: CameraFrame, header: Header) -> None:
        """Publish an image with its intrinsics."""
        height, width = image.depth.shape
        limits = self._camera.range_min, self._camera.range_max
        model = CameraModel(width, height, *image.intrinsics, *limits)
        self.camera_info.publish(model.camera_info(header))
        self.depth.publish(Image.of(header, "16UC1", image.depth))
