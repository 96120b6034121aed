"""Conversion of a depth image to a laser scan, by the rules of ROS's depthimage_to_laserscan.

Each column of a band of rows around the optical centre gives the nearest depth within the limits; its range
is the distance in the camera's horizontal plane. A LaserScan has equal angle increments, whereas columns have
equal increments of the tangent: each bin takes the columns whose angle rounds to it, and an empty bin the
column nearest in angle.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numba import njit
from numpy.typing import NDArray

from chefbot.errors import ScanError
from chefbot.scan.camera import CameraModel, Depth

Floats = NDArray[np.float32]
Millimetres = NDArray[np.uint16]
Indices = NDArray[np.int32]


class DepthToScanParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The parameters of the `DepthToScan` conversion."""

    scan_height: Annotated[
        int,
        Meta(
            ge=1, le=10_000, description="number of rows around the optical centre used for the scan, pixels"
        ),
    ] = 1


@njit(cache=True, nogil=True)
def _nearest_mm(band: Millimetres, low: Millimetres, high: Millimetres, out: Floats) -> None:
    """Fill out[u] with the nearest depth, m, of column u within [low[u], high[u]] mm, NaN for none.

    The unsigned subtraction wraps depths below the minimum, including 0, to values above all valid ones, so
    that a single minimum per pixel remains, which vectorises.
    """
    width = band.shape[1]
    # Column minimum of z - low, modulo 2^16
    offset = np.full(width, 65535, np.uint16)
    for row in range(band.shape[0]):
        for u in range(width):
            offset[u] = min(offset[u], np.uint16(band[row, u] - low[u]))
    # Valid minima to metres
    for u in range(width):
        if low[u] <= high[u] and offset[u] <= high[u] - low[u]:
            out[u] = np.float32(offset[u] + low[u]) * np.float32(0.001)
        else:
            out[u] = np.nan


@njit(cache=True, nogil=True)
def _nearest_m(band: Floats, low: Floats, high: Floats, out: Floats) -> None:
    """Fill out[u] with the nearest depth of column u within [low[u], high[u]], m, or an infinity, or NaN for
    none."""
    # Column minimum of the valid depths
    out[:] = np.inf
    for row in range(band.shape[0]):
        for u in range(band.shape[1]):
            z = band[row, u]
            out[u] = z if low[u] <= z <= high[u] and z < out[u] else out[u]
    # Columns without a valid depth
    for u in range(band.shape[1]):
        if out[u] == np.inf:
            out[u] = _column_infinity(band, u)


@njit(cache=True, nogil=True)
def _column_infinity(band: Floats, u: int) -> float:
    """Return an infinity of the column if there is one (REP-117: +inf out of range, -inf too near), else
    NaN."""
    found = np.nan
    for row in range(band.shape[0]):
        if np.isinf(band[row, u]):
            found = band[row, u]
            if found < 0.0:
                break
    return found


@njit(cache=True, nogil=True)
def _bin_ranges(column: Floats, stretch: Floats, first: Indices, last: Indices, out: Floats) -> None:
    """Fill out[i] with the nearest range column * stretch over columns first[i] .. last[i], NaN only if all
    are."""
    # Range in the horizontal plane r = z * hypot(1, tan a), minimum over the columns of a bin
    for i in range(out.size):
        nearest = column[first[i]] * stretch[first[i]]
        for u in range(first[i] + 1, last[i] + 1):
            r = column[u] * stretch[u]
            if np.isnan(nearest) or (np.isfinite(r) and not nearest < r):
                nearest = r
        out[i] = nearest


class DepthToScan:
    """A converter of depth images of one camera to ranges, right to left (REP-103), in camera_depth_frame.

    angles: (width,) float64 angles of the ranges, rad; angle_min, angle_max, angle_increment as in
    sensor_msgs/LaserScan.
    """

    def __init__(self, camera: CameraModel, params: DepthToScanParams) -> None:
        self.camera = camera
        self._first_row = int(camera.cy - params.scan_height / 2.0)
        self._rows = params.scan_height
        if camera.cy < params.scan_height / 2.0 or self._first_row + self._rows > camera.height:
            raise ScanError(
                f"scan_height {self._rows} about row {camera.cy:g} does not fit an image of"
                f" {camera.height} rows"
            )
        tangent = (camera.cx - np.arange(camera.width)) / camera.fx
        self._set_bins(np.arctan(tangent))
        stretch = np.hypot(1.0, tangent)
        self._stretch = stretch.astype(np.float32)
        low, high = camera.range_min / stretch, camera.range_max / stretch
        self._limits_m = (low.astype(np.float32), high.astype(np.float32))
        self._limits_mm = (
            np.clip(np.ceil(low * 1000.0 - 1e-6), 1, 65535).astype(np.uint16),
            np.clip(np.floor(high * 1000.0 + 1e-6), 1, 65534).astype(np.uint16),
        )

    def _set_bins(self, column_angles: NDArray[np.float64]) -> None:
        """Set the columns first[i] .. last[i] of each bin from the decreasing angles of the columns."""
        width = column_angles.size
        self.angle_min, self.angle_max = float(column_angles[-1]), float(column_angles[0])
        self.angle_increment = (self.angle_max - self.angle_min) / (width - 1)
        self.angles = self.angle_min + self.angle_increment * np.arange(width)
        # Round each column to a bin; an empty bin takes the column nearest in angle
        bins = np.rint((column_angles - self.angle_min) / self.angle_increment).astype(np.int64)
        closest = np.abs(self.angles[:, None] - column_angles[None, :]).argmin(axis=1)
        first, last = np.full(width, width), np.full(width, -1)
        np.minimum.at(first, bins, np.arange(width))
        np.maximum.at(last, bins, np.arange(width))
        empty = last < 0
        self._first = np.where(empty, closest, first).astype(np.int32)
        self._last = np.where(empty, closest, last).astype(np.int32)

    @property
    def scan_rows(self) -> tuple[int, int]:
        """First row of the band, and the row after its last one."""
        return self._first_row, self._first_row + self._rows

    def convert(self, depth: Depth) -> Floats:
        """Convert an image (h, w) of uint16 mm or float32 m to ranges (width,), m, at `angles`.

        A range is NaN without a reading within the limits, and +-inf with infinite readings only. Raise
        ScanError for an image of another size or type.
        """
        self.camera.check(depth)
        band = depth[self._first_row : self._first_row + self._rows]
        # Nearest depth per column, then nearest range per bin
        column = np.empty(self.camera.width, np.float32)
        if band.dtype == np.uint16:
            _nearest_mm(band, *self._limits_mm, column)
        else:
            _nearest_m(band, *self._limits_m, column)
        ranges = np.empty_like(column)
        _bin_ranges(column, self._stretch, self._first, self._last, ranges)
        return ranges
