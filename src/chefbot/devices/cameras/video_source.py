"""Images of a USB camera (V4L2) or of a video file, by OpenCV (extra `camera`)."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.devices.cameras.camera import MAX_AGE_NS, CameraError, StreamRequest
from chefbot.devices.cameras.v4l2 import camera_path
from chefbot.runtime.clock import wall_ns

MOTION_JPEG = "MJPG"
"""Pixel format that leaves several cameras room on one USB 2 bus."""
MIN_FILE_RATE, MAX_FILE_RATE = 1.0, 60.0
"""Range of rates at which a video file is played, Hz."""


class ColorImage(NamedTuple):
    """A colour image (h, w, 3), RGB, and the monotonic clock at its exposure, ns."""

    pixels: NDArray[np.uint8]
    taken_ns: int


class VideoSource:
    """An open USB camera, or a video file that is played again and again at its own rate."""

    def __init__(self, cv2: Any, path: Path, request: StreamRequest) -> None:
        """Open it. CameraError if that fails, or if its images have another size than requested."""
        self._cv2, self._path, self.name = cv2, path, str(path)
        self._is_camera = path.is_char_device()
        self._capture = cv2.VideoCapture(str(path), cv2.CAP_V4L2 if self._is_camera else cv2.CAP_ANY)
        if not self._capture.isOpened():
            raise CameraError(f"{path} {self._reason()}")
        if self._is_camera:
            self._configure(request)
        size = self._property("FRAME_WIDTH"), self._property("FRAME_HEIGHT")
        if size != (request.width, request.height):
            self.close()
            raise CameraError(
                f"{path} has images of {size[0]:g} x {size[1]:g} pixels, not of {request.width} x {request.height}:"
                " give the width, height and lens that it has in sensors.color_camera"
            )
        rate = self._property("FPS")
        self._period = 0.0 if self._is_camera else 1.0 / min(max(rate, MIN_FILE_RATE), MAX_FILE_RATE)
        self._next = time.monotonic()

    def _reason(self) -> str:
        if self._is_camera:
            return "is no camera that can be opened: another program uses it, or the user is not in the group video"
        return "is not a video that can be read"

    def _configure(self, request: StreamRequest) -> None:
        """Request the format, of which a driver takes the nearest one that the camera has."""
        cv2, capture = self._cv2, self._capture
        capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*MOTION_JPEG))
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, request.width)
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, request.height)
        capture.set(cv2.CAP_PROP_FPS, request.rate)
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)

    def _property(self, name: str) -> float:
        return float(self._capture.get(getattr(self._cv2, f"CAP_PROP_{name}")))

    def read(self, timeout: float) -> ColorImage | None:
        """Return the next image, or None without one; OpenCV's own timeout holds. CameraError if it is gone."""
        if not self._is_camera and not self._is_due(timeout):
            return None
        complete, image = self._capture.read()
        if not complete and not self._is_camera:
            self._capture.set(self._cv2.CAP_PROP_POS_FRAMES, 0)
            complete, image = self._capture.read()
        if not complete:
            if not self._path.exists():
                raise CameraError(f"the connection to {self.name} broke")
            return None
        return ColorImage(self._cv2.cvtColor(image, self._cv2.COLOR_BGR2RGB), self._taken_ns())

    def _is_due(self, timeout: float) -> bool:
        """Wait for the time of a file's next image; return False if it is not reached within `timeout` seconds."""
        wait = self._next - time.monotonic()
        time.sleep(min(max(wait, 0.0), timeout))
        if wait > timeout:
            return False
        self._next = max(self._next, time.monotonic() - self._period) + self._period
        return True

    def _taken_ns(self) -> int:
        """Return the time stamp of the driver, which is the monotonic clock's; now, if it cannot be right."""
        now_ns = wall_ns()
        stamp_ns = round(1e6 * self._property("POS_MSEC"))
        return stamp_ns if self._is_camera and 0 <= now_ns - stamp_ns <= MAX_AGE_NS else now_ns

    def close(self) -> None:
        """Stop the stream and release the camera."""
        self._capture.release()


def open_video(cv2: Any, request: StreamRequest) -> VideoSource:
    """Open the camera or file that `request.serial` names. CameraError if that fails."""
    return VideoSource(cv2, camera_path(request.serial), request)
