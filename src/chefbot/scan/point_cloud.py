"""Converts depth images to point clouds in the optical frame of the camera (REP-103: z forward, x right, y down)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.sensor_msgs import PointCloud2, PointField
from chefbot.msgs.std_msgs import Header
from chefbot.scan.camera import CameraModel, Depth

FLOAT32 = 7
"""Type number of 32-bit floating point numbers in sensor_msgs/PointField."""
FIELDS = tuple(PointField(name, offset, FLOAT32, 1) for name, offset in (("x", 0), ("y", 4), ("z", 8)))
POINT_STEP = 12
"""Bytes of a point."""
METRES_PER_UNIT = {np.dtype(np.uint16): np.float32(1e-3), np.dtype(np.float32): np.float32(1.0)}


class PointCloudConverter:
    """Converts the depth images of a camera; one pixel in `step` of a row and of a column becomes a point."""

    def __init__(self, model: CameraModel, step: int) -> None:
        self._model, self._step = model, step
        # directions of the pixels at a depth of 1 m (pinhole model of sensor_msgs/CameraInfo)
        self._right = ((np.arange(0, model.width, step) - model.cx) / model.fx).astype(np.float32)
        self._down = ((np.arange(0, model.height, step) - model.cy) / model.fy).astype(np.float32)[:, None]

    def points(self, depth: Depth) -> NDArray[np.float32]:
        """Return the points (rows, columns, 3), m; NaN without a reading in the camera's range.

        Raise ScanError for an image of another size or type than the camera's.
        """
        self._model.check(depth)
        z = depth[:: self._step, :: self._step] * METRES_PER_UNIT[depth.dtype]
        with np.errstate(invalid="ignore"):  # NaN and infinite depths are no readings either
            valid = (z >= self._model.range_min) & (z <= self._model.range_max)
        z = np.where(valid, z, np.float32(np.nan))
        return np.stack((self._right * z, self._down * z, z), axis=-1)


def point_cloud_message(header: Header, points: NDArray[np.float32]) -> PointCloud2:
    """Return the message with points (rows, columns, 3), m, in the order of the image."""
    rows, columns = points.shape[:2]
    data = np.ascontiguousarray(points, "<f4").view(np.uint8).reshape(-1)
    return PointCloud2(header, rows, columns, FIELDS, False, POINT_STEP, columns * POINT_STEP, data)
