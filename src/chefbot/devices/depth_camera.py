"""Driver of depth cameras: images, their intrinsics, and the camera's health."""

from __future__ import annotations

import threading
from collections import deque
from functools import partial

from chefbot.design.export.urdf_frames import OPTICAL_FRAME
from chefbot.devices.depth_cameras.camera import (
    CameraError,
    CameraFrame,
    OpenCamera,
    StreamRequest,
    opener_of,
)
from chefbot.errors import ScanError
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Device, NoParams, Out, every, topic
from chefbot.scan.camera import CameraModel

READ_TIMEOUT, RETRY_PERIOD, STOP_TIMEOUT = 0.2, 1.0, 5.0
"""Time to wait for one image, between two attempts to open the camera, and for an SDK to release it, s."""
SILENCE_NS = 2_000_000_000
"""Time without an image after which the camera is opened again, ns."""
MIN_PERIOD_SHARE = 0.75
"""Share of the period after which the next image is taken; a camera that is faster than the robot file skips some."""
NO_DRIVER = (
    "Depth camera: the robot file names no driver (sensors.depth_camera.driver); images are expected from another"
    " machine."
)


class DepthCameraDevice(Device):
    """Publishes the images of the robot's depth camera, and is back after its cable was out.

    A thread opens and reads it. An image that the loop has no time for is replaced by the next. A robot whose file
    names no driver has its images from another node, and this one does nothing.
    """

    params: NoParams
    depth: Out[Image] = topic("camera/depth/image_raw")
    camera_info: Out[CameraInfo] = topic("camera/depth/camera_info")
    diagnostics: Out[DiagnosticArray]
    notice: Out[String] = topic("camera/notice")

    def start(self) -> None:
        """Begin to look for the camera. UserError if the SDK of its maker is not installed."""
        camera = self.robot.sensors.depth_camera
        self._thread: threading.Thread | None = None
        if camera is None or not camera.driver:
            for port in (self.depth, self.camera_info, self.diagnostics, self.notice):
                port.unadvertise()
            self.announcement = "" if camera is None else NO_DRIVER
            return
        self._camera = camera
        self._open = opener_of(camera.driver)
        self._name, self._problem = "", "the camera has not been found yet"
        self._published, self._newest_ns = 0, 0
        self._frames: deque[CameraFrame] = deque(maxlen=1)
        self._closing = threading.Event()
        self.announcement = f"Depth camera: looking for {camera.driver}, serial number {camera.serial}."
        self._thread = threading.Thread(target=self._run, name="depth camera", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the stream and release the camera."""
        super().stop()
        if self._thread is not None:
            self._closing.set()
            self._thread.join(STOP_TIMEOUT)

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish whether the camera sends images."""
        if self._thread is None:
            return
        problem = self._problem
        text = f"{problem[0].upper()}{problem[1:]}." if problem else "The depth camera sends images."
        values = (KeyValue("driver", self._camera.driver), KeyValue("images", str(self._published)))
        status = DiagnosticStatus(ERROR if problem else OK, "depth camera", text, self._name, values)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, OPTICAL_FRAME), (status,)))

    # -- in the loop

    def _on_open(self, name: str) -> None:
        self._name, self._problem = name, ""
        self.notice.publish(String(f"Depth camera: {name}."))

    def _on_problem(self, reason: str) -> None:
        if reason != self._problem:
            self.notice.publish(String(f"Warning: {reason}; looking for the depth camera."))
        self._problem = reason
        self.publish_health()

    def _publish(self) -> None:
        """Publish the newest image with its intrinsics, stamped with the time of its exposure."""
        if not self._frames:
            return  # an earlier call has published it
        frame = self._frames.pop()
        stamp_ns = self.now_ns - max(0, wall_ns() - frame.taken_ns)
        if stamp_ns <= self._newest_ns:
            return
        height, width = frame.depth.shape
        try:
            limits = self._camera.range_min, self._camera.range_max
            model = CameraModel(width, height, *frame.intrinsics, *limits)
        except ScanError as error:
            self._on_problem(str(error))
            return
        self._newest_ns, self._published = stamp_ns, self._published + 1
        header = Header.of(stamp_ns, OPTICAL_FRAME)
        self.camera_info.publish(model.camera_info(header))
        self.depth.publish(Image.of(header, "16UC1", frame.depth))

    # -- in the thread

    def _run(self) -> None:
        spec = self._camera
        request = StreamRequest(spec.serial, spec.width, spec.height, spec.rate)
        while not self._closing.is_set():
            try:
                camera = self._open(request)
                try:
                    self.post(partial(self._on_open, camera.name))
                    self._read(camera)
                finally:
                    camera.close()
            except CameraError as error:
                self._fail(str(error))
            except Exception as error:  # an SDK may raise anything; the camera is opened again
                self._fail(f"the driver of the depth camera failed: {type(error).__name__}: {error}")

    def _fail(self, reason: str) -> None:
        self.post(partial(self._on_problem, reason))
        self._closing.wait(RETRY_PERIOD)

    def _read(self, camera: OpenCamera) -> None:
        """Read images until the node stops. CameraError if the camera sends none."""
        period_ns = MIN_PERIOD_SHARE * 1e9 / self._camera.rate
        taken_ns, received_ns = 0, wall_ns()
        while not self._closing.is_set():
            frame = camera.read(READ_TIMEOUT)
            if frame is None:
                if wall_ns() - received_ns > SILENCE_NS:
                    raise CameraError(f"{camera.name} has sent no image for {SILENCE_NS // 1_000_000_000} s")
                continue
            received_ns = wall_ns()
            if frame.taken_ns - taken_ns >= period_ns:
                taken_ns = frame.taken_ns
                self._frames.append(frame)
                self.post(self._publish)
