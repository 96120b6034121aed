"""The pinhole model of a depth camera, and the decoding of its images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ScanError, name_hint
from chefbot.robot.sensors import DepthCamera

Depth = NDArray[np.uint16] | NDArray[np.float32]
"""A depth image (h, w) along the optical axis: uint16 millimetres with 0 for no reading, or float32 metres
with NaN or inf for none (REP-118)."""

_ENCODINGS = {"16UC1": "u2", "32FC1": "f4"}


@dataclass(frozen=True)
class CameraModel:
    """The intrinsics of a rectified depth image in pixels (K of sensor_msgs/CameraInfo), and its valid
    depths, m."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    range_min: float
    range_max: float

    def __post_init__(self) -> None:
        if not (self.fx > 0 and self.fy > 0 and self.width >= 2 and self.height >= 1):
            raise ScanError(f"camera {self} has no image; give fx, fy > 0 and a width of at least 2 pixels")
        if not (0 <= self.cx <= self.width - 1 and 0 <= self.cy <= self.height - 1):
            raise ScanError(f"camera {self} has its optical axis outside the image; check cx and cy")
        if not 0 < self.range_min < self.range_max:
            raise ScanError(f"camera {self} needs 0 < range_min < range_max")

    @staticmethod
    def of(camera: DepthCamera) -> CameraModel:
        """Return the ideal camera model of a robot file's depth camera."""
        f, cx, cy = camera.focal_length_px, (camera.width - 1) / 2.0, (camera.height - 1) / 2.0
        return CameraModel(camera.width, camera.height, f, f, cx, cy, camera.range_min, camera.range_max)

    def check(self, depth: Depth) -> None:
        """Raise ScanError if an image has another size than the camera or is not a depth image."""
        if depth.shape != (self.height, self.width):
            raise ScanError(
                f"depth image of shape {depth.shape}, but the camera has {self.height} rows"
                f" and {self.width} columns"
            )
        if depth.dtype not in (np.uint16, np.float32):
            raise ScanError(f"depth image of {depth.dtype}; it must be uint16 (mm) or float32 (m)")


def depth_image(
    data: bytes | NDArray[np.uint8],
    encoding: str,
    height: int,
    width: int,
    step: int,
    is_bigendian: bool = False,
) -> Depth:
    """Return the pixels (h, w), read-only, of a sensor_msgs/Image of encoding 16UC1 or 32FC1.

    step: bytes per row. Raise ScanError for another encoding or for too little data.
    """
    if encoding not in _ENCODINGS:
        raise ScanError(f"image encoding {encoding!r} is not one of depth{name_hint(encoding, _ENCODINGS)}")
    kind = np.dtype((">" if is_bigendian else "<") + _ENCODINGS[encoding])
    if step < width * kind.itemsize or len(data) < step * height:
        raise ScanError(
            f"image of {len(data)} bytes, {step} per row, is too short for"
            f" {width} x {height} pixels of {encoding}"
        )
    rows = np.frombuffer(data, np.uint8, step * height).reshape(height, step)[:, : width * kind.itemsize]
    pixels: Depth = np.ascontiguousarray(rows).view(kind).astype(kind.newbyteorder("="), copy=False)
    pixels.flags.writeable = False  # the message's own memory, and one type for the kernels
    return pixels
