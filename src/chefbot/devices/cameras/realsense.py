"""Intel RealSense depth cameras, by librealsense (extra `realsense`)."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pyrealsense2 as rs

from chefbot.devices.cameras.camera import (
    CameraError,
    CameraFrame,
    Intrinsics,
    OpenCamera,
    StreamMode,
    StreamRequest,
    best_mode,
    monotonic_ns,
    selected,
    to_millimetres,
)
from chefbot.runtime.clock import wall_ns

QUEUE_LENGTH = 2


class RealSense:
    """A RealSense camera, or a software device of librealsense, whose depth sensor streams."""

    def __init__(self, device: Any, request: StreamRequest) -> None:
        """Start the depth stream. CameraError if the device has none, or is used by another program."""
        info = rs.camera_info
        self.name = f"{device.get_info(info.name)} {device.get_info(info.serial_number)}"
        try:
            self._sensor = device.first_depth_sensor()
            profile = _depth_profile(self._sensor, request)
            self._unit = self._sensor.get_option(rs.option.depth_units)
            if self._sensor.supports(rs.option.global_time_enabled):
                self._sensor.set_option(rs.option.global_time_enabled, 1.0)
            self._frames = rs.frame_queue(QUEUE_LENGTH)
            self._sensor.open(profile)
            self._sensor.start(self._frames)
        except RuntimeError as error:
            raise CameraError(f"{self.name} cannot be started: {error}") from error
        lens = profile.as_video_stream_profile().get_intrinsics()
        self._intrinsics = Intrinsics(lens.fx, lens.fy, lens.ppx, lens.ppy)

    def read(self, timeout: float) -> CameraFrame | None:
        """Return the next image, or None after `timeout` seconds."""
        arrived, frame = self._frames.try_wait_for_frame(int(1000 * timeout))
        if not arrived:
            return None
        pixels = np.asanyarray(frame.as_depth_frame().get_data())
        return CameraFrame(to_millimetres(pixels, self._unit), self._intrinsics, _taken_ns(frame))

    def close(self) -> None:
        """Stop the stream; a camera that is unplugged has stopped already."""
        with suppress(RuntimeError):
            self._sensor.stop()
            self._sensor.close()


def open_realsense(request: StreamRequest) -> OpenCamera[CameraFrame]:
    """Open the RealSense camera with a serial number, or the only one."""
    devices = {one.get_info(rs.camera_info.serial_number): one for one in rs.context().query_devices()}
    return RealSense(devices[selected(list(devices), request.serial, "RealSense")], request)


def _depth_profile(sensor: Any, request: StreamRequest) -> Any:
    profiles = [
        one
        for one in sensor.get_stream_profiles()
        if one.stream_type() == rs.stream.depth and one.format() == rs.format.z16
    ]
    videos = [one.as_video_stream_profile() for one in profiles]
    modes = [StreamMode(one.width(), one.height(), one.fps()) for one in videos]
    return profiles[best_mode(modes, request)]


def _taken_ns(frame: Any) -> int:
    """Return the time of exposure on the monotonic clock; a time stamp of the camera's own clock is not used."""
    if frame.get_frame_timestamp_domain() == rs.timestamp_domain.hardware_clock:
        return wall_ns()
    return monotonic_ns(int(1e6 * frame.get_timestamp()))
