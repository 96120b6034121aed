"""The pinhole models of depth and colour cameras, and the decoding of depth images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ScanError, name_hint
from chefbot.msgs.sensor_msgs import CameraInfo
from chefbot.msgs.std_msgs import Header
from chefbot.robot.sensors import MAX_FIELD_OF_VIEW, MAX_IMAGE_PIXELS, ColorCamera, DepthCamera

Depth = NDArray[np.uint16] | NDArray[np.float32]
"""A depth image (h, w) along the optical axis: uint16 millimetres with 0 for no reading, or float32 metres
with NaN or inf for none (REP-118)."""

_ENCODINGS = {"16UC1": "u2", "32FC1": "f4"}
MAX_SIDE = 4096
"""Maximum width and height of an image, pixels."""
MIN_FIELD_OF_VIEW = math.radians(1.0)
"""Horizontal field of view below which intrinsics are wrong, rad."""
MAX_PIXEL_ASPECT = 10.0
"""Ratio of the focal lengths of columns and rows above which they are wrong: binned pixels are not square."""


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

    @staticmethod
    def from_camera_info(info: CameraInfo, range_min: float, range_max: float) -> CameraModel:
        """Return the model of the images that a message describes.

        K is that of the full image. An image is its region of interest, of which each pixel combines `binning_x`
        columns and `binning_y` rows (sensor_msgs/CameraInfo). range_min, range_max: valid depths, m. Raise ScanError
        for a camera that is not calibrated, or whose image no depth camera has.
        """
        fx, fy, cx, cy = (float(info.k[i]) for i in (0, 4, 2, 5))
        if not (math.isfinite(fx) and math.isfinite(fy) and fx > 0.0 and fy > 0.0):
            raise ScanError(
                "camera_info has no focal length in K: calibrate the camera, or configure its driver"
            )
        bin_x, bin_y = max(1, info.binning_x), max(1, info.binning_y)
        left, above, width, height = info.roi.x_offset, info.roi.y_offset, info.roi.width, info.roi.height
        if not (width and height):
            left, above, width, height = 0, 0, info.width, info.height
        width, height = width // bin_x, height // bin_y
        if max(width, height) > MAX_SIDE or width * height > MAX_IMAGE_PIXELS:
            raise ScanError(
                f"camera_info is of an image of {width} x {height} pixels, too large for a depth camera"
            )
        # Pixel centres have whole numbers: the centre of the first binned pixel is (bin - 1) / 2
        cx, cy = (cx - left - (bin_x - 1) / 2) / bin_x, (cy - above - (bin_y - 1) / 2) / bin_y
        model = CameraModel(width, height, fx / bin_x, fy / bin_y, cx, cy, range_min, range_max)
        if not MIN_FIELD_OF_VIEW <= model.field_of_view <= MAX_FIELD_OF_VIEW:
            degrees = math.degrees(model.field_of_view)
            raise ScanError(f"camera_info is of a view of {degrees:.3g} degrees; check fx and width")
        if not 1.0 / MAX_PIXEL_ASPECT <= model.fx / model.fy <= MAX_PIXEL_ASPECT:
            raise ScanError(
                f"camera_info has focal lengths of {model.fx:.3g} and {model.fy:.3g} pixels; check fx and fy"
            )
        return model

    def camera_info(self, header: Header) -> CameraInfo:
        """Return the message that describes the images of this camera, which are not distorted."""
        size, pinhole = (self.width, self.height), (self.fx, self.fy, self.cx, self.cy)
        return _camera_info(header, size, pinhole, np.zeros(5))

    @property
    def field_of_view(self) -> float:
        """Horizontal field of view, rad, between the outer edges of the image."""
        return math.atan((self.cx + 0.5) / self.fx) + math.atan((self.width - 0.5 - self.cx) / self.fx)

    def check(self, depth: Depth) -> None:
        """Raise ScanError if an image has another size than the camera or is not a depth image."""
        if depth.shape != (self.height, self.width):
            raise ScanError(
                f"depth image of shape {depth.shape}, but the camera has {self.height} rows"
                f" and {self.width} columns"
            )
        if depth.dtype not in (np.uint16, np.float32):
            raise ScanError(f"depth image of {depth.dtype}; it must be uint16 (mm) or float32 (m)")


def color_camera_info(camera: ColorCamera, header: Header) -> CameraInfo:
    """Return the message that describes the images of a robot file's colour camera."""
    lens = camera.intrinsics
    pinhole = lens.fx, lens.fy, lens.cx, lens.cy
    return _camera_info(header, (camera.width, camera.height), pinhole, np.array(lens.distortion))


def _camera_info(
    header: Header,
    size: tuple[int, int],
    pinhole: tuple[float, float, float, float],
    distortion: NDArray[np.float64],
) -> CameraInfo:
    """Return intrinsics for images (width, height) that are not rectified; pinhole: fx, fy, cx, cy."""
    fx, fy, cx, cy = pinhole
    k = np.array([fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])
    p = np.array([fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0])
    return CameraInfo(header, size[1], size[0], d=distortion, k=k, r=np.eye(3).reshape(9), p=p)


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
