"""The levels of a multi-resolution map: scan matching and scan insertion at one resolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.slam.matching import match_all, place_all
from chefbot.slam.scan_beams import thinned
from chefbot.slam.shared_tiles import TileMaps

_SPACING = np.float32(0.5)
"""Minimum distance between the points of a scan, cells."""
_NOMINAL_BEAMS = 150
"""A scan with fewer points weighs proportionally less: a depth camera's, or one of a mostly empty hall."""
_MATCH_MARGIN = 1.0
"""Margin of the maps beyond the beams, m: the largest correction of the scan matcher."""


@dataclass(frozen=True)
class HillClimbParams:
    """Parameters of the hill climbing: initial steps in m and rad, and the number of times they are halved."""

    linear: float
    angular: float
    halvings: int


@dataclass(frozen=True, eq=False)
class OdometryPrior:
    """The odometry prior of each particle: mean poses (p, 3) and the variances (3,) of their errors.

    axes: (p,) rad, direction of the first variance; the second is across it, the third that of the heading.
    """

    poses: NDArray[np.float64]
    variance: NDArray[np.float64]
    axes: NDArray[np.float64]


class MapLevel:
    """The maps of all particles at one resolution: cells of `resolution` m, likelihood width `sigma` m."""

    def __init__(
        self,
        particles: int,
        resolution: float,
        sigma: float,
        search: HillClimbParams,
        independent_beams: float,
        max_cells: int,
    ) -> None:
        self.maps = TileMaps(particles, max_cells)
        self._scale = np.array([resolution, resolution, 1.0])
        self._resolution = resolution
        self._sharpness = np.float32((resolution / sigma) ** 2)
        self._climb = search
        self._independent_beams = independent_beams

    def points(self, surfaces: NDArray[np.float32]) -> NDArray[np.float32]:
        """Convert ends of beams (n, 2) in metres into thinned points (m, 2) in cells of this level."""
        return thinned(surfaces / np.float32(self._resolution), _SPACING)

    def grow_to(self, poses: NDArray[np.float64], max_range: float) -> None:
        """Grow the maps to hold beams of `max_range` metres from any of the particles at `poses` (p, 3)."""
        # Bounding box of all particles, enlarged by the range and the matching margin
        low, high = poses[:, :2].min(axis=0), poses[:, :2].max(axis=0)
        margin = max_range + _MATCH_MARGIN
        self.maps.grow_to((low - margin) / self._resolution, (high + margin) / self._resolution)

    def match(
        self, points: NDArray[np.float32], poses: NDArray[np.float64], prior: OdometryPrior
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the maximum a posteriori poses (p, 3) near `poses` and the scan's log likelihoods (p,)."""
        search = self._climb
        # Neighbouring beams are correlated: a scan weighs as much as `independent_beams` of them
        weight = self._independent_beams / max(len(points), _NOMINAL_BEAMS)
        local = self._local(poses)
        # Prior variances in the units of this level: cells, cells, rad
        scores = match_all(
            points, local, self._local(prior.poses), self._scale**2 / prior.variance, prior.axes, weight,
            np.array([search.linear / self._resolution, search.angular, search.halvings]), self._sharpness,
            self.maps.table, self.maps.mean_x, self.maps.mean_y,
        )  # fmt: skip
        return (local + self._corner()) * self._scale, weight * scores

    def add(self, points: NDArray[np.float32], poses: NDArray[np.float64]) -> None:
        """Insert the points, transformed by each particle's pose, into that particle's map."""
        for particle, ends in enumerate(place_all(points, self._local(poses))):
            self.maps.add(particle, ends)

    def _corner(self) -> NDArray[np.float64]:
        return np.array([*self.maps.corner, 0.0])

    def _local(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return poses (p, 3) with x, y in cells relative to the corner of the tile tables."""
        return poses / self._scale - self._corner()
