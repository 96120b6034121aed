"""Luxonis OAK stereo cameras, by DepthAI 3 (extra `oak`): depth is computed on the camera."""

from __future__ import annotations

from contextlib import suppress
from datetime import timedelta
from typing import Any

import depthai as dai
import numpy as np

from chefbot.devices.cameras.camera import (
    MILLIMETRE,
    CameraError,
    CameraFrame,
    Intrinsics,
    OpenCamera,
    StreamMode,
    StreamRequest,
    best_mode,
    selected,
    to_millimetres,
)

SIZES = ((320, 200), (640, 400), (1280, 800))
"""Sizes of the stereo pair that every OAK scales to, pixels."""
MAX_RATE = 30.0
"""Rate of stereo depth that every OAK reaches, Hz."""


class Oak:
    """An OAK camera whose stereo depth streams, in the frame of its rectified right camera."""

    def __init__(self, device: Any, request: StreamRequest) -> None:
        """Start the depth stream. CameraError if the device has no stereo pair."""
        self.name = f"{device.getDeviceName()} {device.getDeviceId()}"
        mode = mode_for(request)
        try:
            self._pipeline = dai.Pipeline(device)
            stereo = self._pipeline.create(dai.node.StereoDepth).build(
                autoCreateCameras=True,
                presetMode=dai.node.StereoDepth.PresetMode.ROBOTICS,
                size=(mode.width, mode.height),
                fps=mode.rate,
            )
            self._frames = stereo.depth.createOutputQueue(maxSize=2, blocking=False)
            self._pipeline.start()
        except RuntimeError as error:
            raise CameraError(f"{self.name} cannot be started: {error}") from error

    def read(self, timeout: float) -> CameraFrame | None:
        """Return the next image, or None after `timeout` seconds. CameraError if the camera is gone."""
        try:
            message = self._frames.get(timedelta(seconds=timeout))
        except (RuntimeError, dai.MessageQueue.QueueException) as error:
            raise CameraError(f"the connection to {self.name} broke: {error}") from error
        return None if message is None else frame_of(message)

    def close(self) -> None:
        """Stop the stream; a camera that is unplugged has stopped already."""
        with suppress(RuntimeError):
            self._pipeline.stop()


def open_oak(request: StreamRequest) -> OpenCamera[CameraFrame]:
    """Open the OAK camera with a serial number (its device id), or the only one."""
    found = [one.getDeviceId() for one in dai.Device.getAllAvailableDevices()]
    try:
        device = dai.Device(dai.DeviceInfo(selected(found, request.serial, "OAK")))
    except RuntimeError as error:
        raise CameraError(f"the OAK camera cannot be opened: {error}") from error
    return Oak(device, request)


def mode_for(request: StreamRequest) -> StreamMode:
    """Return the size and rate of stereo depth for a request."""
    modes = [StreamMode(*size, min(request.rate, MAX_RATE)) for size in SIZES]
    return modes[best_mode(modes, request)]


def frame_of(message: Any) -> CameraFrame:
    """Return the image of an ImgFrame (RAW16, mm); its time stamp is on the computer's monotonic clock."""
    k = message.getTransformation().getIntrinsicMatrix()
    depth = to_millimetres(np.asarray(message.getFrame(), np.uint16), MILLIMETRE)
    taken_ns = int(message.getTimestamp() / timedelta(microseconds=1)) * 1000
    return CameraFrame(depth, Intrinsics(k[0][0], k[1][1], k[0][2], k[1][2]), taken_ns)
