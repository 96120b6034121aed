"""The offset that all ranges of a laser share, found from scans that see the same surfaces from different places.

A laser that rounds ranges up, or whose zero is off, sees every room too large. A wall then lies elsewhere when it is
seen squarely than when it is seen at a grazing angle, and the map bends by degrees over a hundred metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.slam.graph.pair_matching import linearize_pairs
from chefbot.slam.graph.refinement import SURFACE_NOISE
from chefbot.slam.graph.scan_features import ScanFeatures

Array = NDArray[np.float64]
MAX_OFFSET = 0.15
"""Largest offset that is accepted, m."""
MIN_FIELD_OF_VIEW = 3.0
"""Angle between the first and the last beam from which the offset shows, rad. To a sensor that looks ahead, too long
ranges and too much travel look the same."""
_PRIOR_DEVIATION = 0.03
"""Standard deviation of the offset of any laser, m."""
_SCALE = 0.1
"""Width of the robust kernel, m."""
_LAGS = (1, 2, 4)
"""A scan is compared with the ones this many before it."""
_NODES = 150
"""Number of scans after which the offset is known well enough."""
_CORRELATION = 20.0
"""Factor on the variance of a point: errors of neighbouring points and of their pairing are not independent."""


class RangeCalibration:
    """Estimates the range offset while the first scans come in."""

    def __init__(self) -> None:
        self._stiffness = _CORRELATION * (SURFACE_NOISE / _PRIOR_DEVIATION) ** 2
        self._slope = 0.0
        self._seen = 0

    @property
    def offset(self) -> float:
        """The correction of all ranges, m."""
        return float(np.clip(-self._slope / self._stiffness, -MAX_OFFSET, MAX_OFFSET))

    def observe(self, features: list[ScanFeatures], poses: Array) -> None:
        """Learn from the last of some consecutive scans, given with poses (n, 3) in one frame."""
        if self._seen >= _NODES:
            return
        self._seen += 1
        last = len(features) - 1
        for other in (last - lag for lag in _LAGS if lag <= last):
            pair = [features[other], features[last]]
            stiffness, slope = range_equation(*linearized(pair, poses[[other, last]], _SCALE))
            # Both scans are corrected already; the equation is for the rest
            applied = 0.5 * (pair[0].range_offset + pair[1].range_offset)
            self._stiffness += stiffness
            self._slope += slope - stiffness * applied


def linearized(pair: list[ScanFeatures], poses: Array, scale: float) -> tuple[Array, Array]:
    """Return the normal equations (1, 4, 4) and (1, 4) of two scans at poses (2, 3)."""
    points = np.concatenate([f.points for f in pair])
    normals = np.concatenate([f.normals for f in pair])
    bearings = np.concatenate([f.bearings for f in pair])
    begin = np.array([0, len(pair[0].points), len(points)])
    sensors = np.array([f.sensor for f in pair])
    h, g, _ = linearize_pairs(
        np.array([0]), np.array([1]), poses, points, normals, bearings, begin, sensors, scale
    )
    return h, g


def range_equation(h: Array, g: Array) -> tuple[float, float]:
    """Return second and first derivative of the pairs' cost by the range offset, their relative poses eliminated.

    h: (m, 4, 4), g: (m, 4), see `linearize_pairs`. The Schur complement of the poses.
    """
    cross = h[:, :3, 3]
    inner = np.linalg.solve(h[:, :3, :3] + 1e-3 * np.eye(3), np.stack([cross, g[:, :3]], axis=2))
    stiffness = (h[:, 3, 3] - (cross * inner[:, :, 0]).sum(axis=1)).sum()
    slope = (g[:, 3] - (cross * inner[:, :, 1]).sum(axis=1)).sum()
    return float(stiffness), float(slope)


def has_wide_view(angles: NDArray[np.float32]) -> bool:
    """Return whether scans with beams at these angles (n,), rad, show the offset of their ranges."""
    return bool(len(angles)) and float(np.ptp(angles)) >= MIN_FIELD_OF_VIEW
