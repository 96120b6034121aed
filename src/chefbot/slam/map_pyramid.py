"""One resolution of the particles' maps: matching scans against it and adding them to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.slam.matching import match_all, place_all
from chefbot.slam.scan_beams import thinned
from chefbot.slam.shared_tiles import TileMaps

_SPACING = np.float32(0.5)
"""Cells between the points of a scan."""
_USUAL_BEAMS = 150
"""A scan with fewer points than this is worth proportionally less: a camera's, or one of a mostly empty hall."""
_SLACK = 1.0
"""Metres the maps reach further than the beams: as far as the matcher may push a particle."""


@dataclass(frozen=True)
class Climb:
    """How the matcher searches: first steps in m and rad, and how often it halves them."""

    linear: float
    angular: float
    halvings: int


@dataclass(frozen=True, eq=False)
class Belief:
    """What odometry says of each particle: poses (p, 3), and the variances (3,) of their errors.

    axes: (p,) rad, direction of the first variance; the second is across it, the third that of the heading.
    """

    poses: NDArray[np.float64]
    variance: NDArray[np.float64]
    axes: NDArray[np.float64]


class Level:
    """Maps of all particles: cells of `resolution` metres, surfaces blurred by `sigma` metres."""

    def __init__(
        self,
        particles: int,
        resolution: float,
        sigma: float,
        climb: Climb,
        independent_beams: float,
        max_cells: int,
    ) -> None:
        self.maps = TileMaps(particles, max_cells)
        self._scale = np.array([resolution, resolution, 1.0])
        self._resolution = resolution
        self._sharpness = np.float32((resolution / sigma) ** 2)
        self._climb = climb
        self._independent_beams = independent_beams

    def points(self, surfaces: NDArray[np.float32]) -> NDArray[np.float32]:
        """Ends of beams (n, 2) in metres as points (m, 2) in cells of this level."""
        return thinned(surfaces / np.float32(self._resolution), _SPACING)

    def cover(self, poses: NDArray[np.float64], far: float) -> None:
        """Let the maps reach as far as any particle at `poses` (p, 3) sees, `far` metres."""
        low, high = poses[:, :2].min(axis=0), poses[:, :2].max(axis=0)
        slack = far + _SLACK
        self.maps.cover((low - slack) / self._resolution, (high + slack) / self._resolution)

    def match(
        self, points: NDArray[np.float32], poses: NDArray[np.float64], belief: Belief
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The poses (p, 3) near `poses` that suit scan and odometry best, and log likelihoods (p,) there."""
        c = self._climb
        weight = self._independent_beams / max(len(points), _USUAL_BEAMS)
        local = self._local(poses)
        fits = match_all(
            points, local, self._local(belief.poses), self._scale**2 / belief.variance, belief.axes, weight,
            np.array([c.linear / self._resolution, c.angular, c.halvings]), self._sharpness,
            self.maps.table, self.maps.mean_x, self.maps.mean_y,
        )  # fmt: skip
        return (local + self._corner()) * self._scale, weight * fits

    def add(self, points: NDArray[np.float32], poses: NDArray[np.float64]) -> None:
        """Mark the points seen from each particle in its map."""
        for particle, ends in enumerate(place_all(points, self._local(poses))):
            self.maps.add(particle, ends)

    def _corner(self) -> NDArray[np.float64]:
        return np.array([*self.maps.corner, 0.0])

    def _local(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Poses (p, 3) with x, y in cells relative to the corner of the tables."""
        return poses / self._scale - self._corner()
