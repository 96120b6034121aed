"""The driver of RealSense cameras, on a software device of librealsense."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from chefbot.devices.cameras.camera import CameraError, StreamRequest
from chefbot.robot.sensors import AUTO

rs = pytest.importorskip(
    "pyrealsense2", reason="needs pip install 'chefbot[realsense]', and libusb", exc_type=ImportError
)
REQUEST = StreamRequest(AUTO, 320, 240, 15.0)
FOCAL = 288.7


class SoftwareCamera:
    """A software device that sends one value of depth, until `close`."""

    def __init__(self, unit: float, raw: int) -> None:
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.name, "Software D435")
        self.device.register_info(rs.camera_info.serial_number, "123")
        self._sensor = self.device.add_sensor("Depth")
        self._profiles = [self._add_stream(i, *size) for i, size in enumerate(((640, 480), (320, 240)))]
        self._sensor.add_read_only_option(rs.option.depth_units, unit)
        self._unit, self._raw = unit, raw
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._send)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._thread.join()

    def _add_stream(self, number: int, width: int, height: int) -> Any:
        lens = rs.intrinsics()
        lens.width, lens.height = width, height
        lens.fx = lens.fy = FOCAL * width / 320
        lens.ppx, lens.ppy = width / 2 + 3.0, height / 2 - 2.0
        stream = rs.video_stream()
        stream.type, stream.index, stream.uid = rs.stream.depth, 0, number
        stream.width, stream.height, stream.fps, stream.bpp = width, height, 30, 2
        stream.fmt, stream.intrinsics = rs.format.z16, lens
        return self._sensor.add_video_stream(stream)

    def _send(self) -> None:
        number = 0
        while not self._closing.wait(0.02):
            frame = rs.software_video_frame()
            frame.pixels = np.full((240, 320), self._raw, np.uint16)
            frame.stride, frame.bpp, frame.frame_number = 640, 2, number
            frame.timestamp = 1e3 * (time.time() - 0.1)
            frame.domain, frame.depth_units = rs.timestamp_domain.system_time, self._unit
            frame.profile = self._profiles[1].as_video_stream_profile()
            self._sensor.on_video_frame(frame)
            number += 1


@pytest.fixture(params=[(1e-3, 1234), (1e-4, 12340)])
def camera(request: pytest.FixtureRequest) -> Iterator[SoftwareCamera]:
    camera = SoftwareCamera(*request.param)
    yield camera
    camera.close()


def test_an_image_has_its_depth_intrinsics_and_time(camera: SoftwareCamera) -> None:
    from chefbot.devices.cameras.realsense import RealSense

    opened = RealSense(camera.device, REQUEST)
    try:
        assert opened.name == "Software D435 123"
        frame = next(frame for frame in iter(lambda: opened.read(1.0), ()) if frame is not None)
        assert frame.depth.shape == (240, 320) and (frame.depth == 1234).all()
        assert frame.intrinsics == pytest.approx((FOCAL, FOCAL, 163.0, 118.0), rel=1e-6)
        age_ns = time.monotonic_ns() - frame.taken_ns
        assert age_ns >= 90_000_000
    finally:
        opened.close()


def test_reading_a_silent_camera_times_out(camera: SoftwareCamera) -> None:
    from chefbot.devices.cameras.realsense import RealSense

    opened = RealSense(camera.device, REQUEST)
    camera.close()
    for _ in range(4):  # what was under way
        opened.read(0.05)
    assert opened.read(0.05) is None
    opened.close()
    opened.close()


def test_no_camera_is_connected() -> None:
    from chefbot.devices.cameras.realsense import open_realsense

    if len(rs.context().query_devices()):
        pytest.skip("a RealSense camera is connected")
    with pytest.raises(CameraError, match="no RealSense camera is connected"):
        open_realsense(REQUEST)
