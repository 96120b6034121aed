"""Orbbec depth cameras (Gemini 2 and 330 series, Femto, Astra 2), by Orbbec SDK 2 (extra `orbbec`)."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pyorbbecsdk as ob

from chefbot.devices.cameras.camera import (
    MILLIMETRE,
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


class Orbbec:
    """An Orbbec camera whose depth sensor streams."""

    def __init__(self, device: Any, request: StreamRequest) -> None:
        """Start the depth stream. CameraError if the device has none, or is used by another program."""
        info = device.get_device_info()
        self.name = f"{info.get_name()} {info.get_serial_number()}"
        try:
            self._pipeline = ob.Pipeline(device)
            profile = _depth_profile(
                self._pipeline.get_stream_profile_list(ob.OBSensorType.DEPTH_SENSOR), request
            )
            config = ob.Config()
            config.enable_stream(profile)
            self._pipeline.start(config)
        except (RuntimeError, ob.OBError) as error:
            raise CameraError(f"{self.name} cannot be started: {error}") from error
        lens = profile.get_intrinsic()
        self._intrinsics = Intrinsics(lens.fx, lens.fy, lens.cx, lens.cy)

    def read(self, timeout: float) -> CameraFrame | None:
        """Return the next image, or None after `timeout` seconds. CameraError if the camera is gone."""
        try:
            frames = self._pipeline.wait_for_frames(int(1000 * timeout))
            frame = None if frames is None else frames.get_depth_frame()
        except (RuntimeError, ob.OBError) as error:
            raise CameraError(f"the connection to {self.name} broke: {error}") from error
        return None if frame is None else frame_of(frame, self._intrinsics)

    def close(self) -> None:
        """Stop the stream; a camera that is unplugged has stopped already."""
        with suppress(RuntimeError, ob.OBError):
            self._pipeline.stop()


def open_orbbec(request: StreamRequest) -> OpenCamera[CameraFrame]:
    """Open the Orbbec camera with a serial number, or the only one."""
    # else the SDK writes a folder of logs where the program was started
    ob.Context.set_logger_level(ob.OBLogLevel.NONE)
    devices = ob.Context().query_devices()
    found = [devices.get_device_serial_number_by_index(i) for i in range(devices.get_count())]
    serial = selected(found, request.serial, "Orbbec")
    try:
        device = devices.get_device_by_serial_number(serial)
    except (RuntimeError, ob.OBError) as error:
        raise CameraError(f"the Orbbec camera {serial} cannot be opened: {error}") from error
    return Orbbec(device, request)


def _depth_profile(profiles: Any, request: StreamRequest) -> Any:
    every = [profiles.get_stream_profile_by_index(i) for i in range(profiles.get_count())]
    videos = [one.as_video_stream_profile() for one in every if one.get_format() == ob.OBFormat.Y16]
    modes = [StreamMode(one.get_width(), one.get_height(), one.get_fps()) for one in videos]
    return videos[best_mode(modes, request)]


def frame_of(frame: Any, intrinsics: Intrinsics) -> CameraFrame:
    """Return the image of a depth frame (Y16); its system time stamp is the wall clock at its arrival."""
    pixels = np.frombuffer(frame.get_data(), np.uint16).reshape(frame.get_height(), frame.get_width())
    depth = to_millimetres(pixels, frame.get_depth_scale() * MILLIMETRE)
    return CameraFrame(depth, intrinsics, monotonic_ns(1000 * frame.get_system_timestamp_us()))
