"""Driver of USB cameras: colour images, their intrinsics, and the camera's health."""

from __future__ import annotations

from functools import partial

from chefbot.design.export.urdf_frames import COLOR_OPTICAL_FRAME
from chefbot.devices.cameras.camera import StreamRequest
from chefbot.devices.cameras.camera_device import CameraDevice
from chefbot.devices.cameras.video_source import ColorImage, open_video
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.node import NoParams, Out, topic
from chefbot.scan.camera import color_camera_info
from chefbot.tags.opencv import load_opencv

NO_DRIVER = (
    "Colour camera: the robot file names no driver (sensors.color_camera.driver); images are expected from another"
    " machine."
)


class ColorCameraDevice(CameraDevice[ColorImage]):
    """Publishes the images of the robot's colour camera, and is back after its cable was out.

    A robot whose file names no driver has its images from another node, and this one does nothing.
    """

    params: NoParams
    picture: Out[Image] = topic("camera/color/image_raw")
    camera_info: Out[CameraInfo] = topic("camera/color/camera_info")
    notice: Out[String] = topic("color_camera/notice")

    def start(self) -> None:
        """Begin to look for the camera. UserError if OpenCV is not installed."""
        camera = self.robot.sensors.color_camera
        if camera is None or not camera.driver:
            for port in (self.picture, self.camera_info, self.diagnostics, self.notice):
                port.unadvertise()
            self.announcement = "" if camera is None else NO_DRIVER
            return
        self._camera = camera
        cv2 = load_opencv(f"sensors.color_camera.driver: {camera.driver}")
        request = StreamRequest(camera.device, camera.width, camera.height, camera.rate)
        self.announcement = f"Colour camera: looking for {camera.driver}, device {camera.device}."
        opened = partial(open_video, cv2, request)
        self.connect(opened, camera.rate, "colour camera", camera.driver, COLOR_OPTICAL_FRAME)

    def publish_image(self, image: ColorImage, header: Header) -> None:
        """Publish an image with its intrinsics."""
        self.camera_info.publish(color_camera_info(self._camera, header))
        self.picture.publish(Image.of(header, "rgb8", image.pixels))
