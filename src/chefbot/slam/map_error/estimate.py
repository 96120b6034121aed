"""An estimate of the error of a map, of the whole and by region, with its cause."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from chefbot.errors import ScanError
from chefbot.maths.se2 import SE2
from chefbot.slam.map_error.expected_error import expected_std
from chefbot.slam.map_error.keyframes import Floats, Keyframes, select_keyframes
from chefbot.slam.map_error.view_overlap import DENIED, SEEN, SQUARES, Overlaps, overlaps_of
from chefbot.slam.session import Session

REGION = 2.0
"""Side of a region, m."""
EXPECTED_FACTOR = 3.0
"""Real error in expected standard deviations; chosen on even seeds of `bench/bench_map_error.py`."""
DENIED_ERROR, DENIED_SHARE = 0.7, 0.5
"""Error that counts for a surface that other passes see through, m, and the share of their views that must do so: the
edge of a door is seen through by some. Chosen likewise."""
NOISE_FACTOR = 2.0
"""Mean square distance between passes over a map without any error, in that between views that follow one another:
other passes see a surface from elsewhere. Chosen likewise."""
MIN_KEYFRAMES, MIN_POINTS = 2, 5
"""Numbers below which a map, and a region, are not judged."""
MIN_COMPARED = 20
"""Number of compared points of a region below which contradictions in it are chance."""


class MapRegion(NamedTuple):
    """A square of REGION m with its south-west corner, m.

    drift: error that poses may have there although no scan contradicts another, m. contradiction: distance between
    what passes see of the same surfaces, beyond the noise, m.
    """

    x: float
    y: float
    drift: float
    contradiction: float

    @property
    def error(self) -> float:
        """Estimated error of the map in this region, m."""
        return math.hypot(self.drift, self.contradiction)

    @property
    def centre(self) -> tuple[float, float]:
        """Coordinates of its centre, m."""
        return self.x + REGION / 2, self.y + REGION / 2

    @property
    def cause(self) -> str:
        """The larger one of both, in words."""
        if self.contradiction > self.drift:
            return "passes contradict each other"
        return "no loop closure or feature holds it"


class MapErrorEstimate(NamedTuple):
    """The estimated error of a map after the best rigid alignment with the building, of the whole and by region.

    drift, contradiction: as of MapRegion, root mean square over the map, m.
    """

    drift: float
    contradiction: float
    compared: float
    """Share of the surfaces that another pass has seen again."""
    regions: list[MapRegion]

    @property
    def error(self) -> float:
        """Root mean square error of the map, m."""
        return math.hypot(self.drift, self.contradiction)

    @property
    def worst(self) -> MapRegion:
        """The region with the largest error."""
        return max(self.regions, key=lambda region: region.error)


def estimate_map_error(
    sessions: Sequence[Session], poses: Sequence[SE2], range_offset: float
) -> MapErrorEstimate:
    """Estimate the error of a map from its drives and the poses of their used scans.

    range_offset: correction of all ranges, m. Raises ScanError for a map without motion or surfaces, or one that
    lacks scans.
    """
    if not sessions:
        raise ScanError("a map without its drives: its error cannot be estimated")
    frames = select_keyframes(sessions, poses, range_offset)
    if len(frames) < MIN_KEYFRAMES or not frames.counts.any():
        raise ScanError(
            "the robot of this map has stood, or only turned, or has seen no wall: its error cannot be estimated"
        )
    overlaps = overlaps_of(frames)
    by_point, noise = _without_edges(overlaps.by_point), _noise(overlaps)
    drift = EXPECTED_FACTOR * expected_std(frames, overlaps)
    seen_again, regions = by_point[..., :SQUARES].sum(axis=2) > 0, _regions(frames, by_point, noise, drift)
    if not regions:
        raise ScanError(
            "the robot of this map has seen too little of any wall: its error cannot be estimated"
        )
    return MapErrorEstimate(
        float(np.sqrt(np.mean(drift**2))),
        float(_contradiction(by_point.sum(axis=(0, 1)), noise)),
        float(seen_again.sum() / frames.counts.sum()),
        regions,
    )


def _without_edges(by_point: Floats) -> Floats:
    """Return the counts without the denials of points that most other passes do not deny."""
    kept = by_point.copy()
    denials = by_point[..., DENIED]
    kept[..., DENIED] = np.where(denials >= DENIED_SHARE * (denials + by_point[..., SEEN]), denials, 0.0)
    return kept


def _noise(overlaps: Overlaps) -> float:
    """Return the mean square distance between passes over a map without any error, m^2."""
    seen, _, squares = overlaps.counts[overlaps.following].sum(axis=0)
    return float(NOISE_FACTOR * squares / max(seen, 1.0))


def _contradiction(counts: Floats, noise: float) -> Floats:
    """Return the distance between what passes see, beyond the noise, m; counts: (..., 3) as in Overlaps."""
    seen, denied = counts[..., SEEN], counts[..., DENIED]
    square = (counts[..., SQUARES] + denied * DENIED_ERROR**2) / np.maximum(seen + denied, 1.0)
    distance: Floats = np.sqrt(np.maximum(square - noise, 0.0))
    return distance


def _regions(frames: Keyframes, by_point: Floats, noise: float, drift: Floats) -> list[MapRegion]:
    """Return the regions that the surfaces lie in."""
    valid = np.arange(frames.points.shape[1]) < frames.counts[:, None]
    cells, region = np.unique(np.floor(frames.points[valid] / REGION), axis=0, return_inverse=True)
    region = region.ravel()
    points = np.bincount(region).astype(float)
    drifts = np.bincount(region, np.repeat(drift**2, frames.counts)) / points
    counts: Floats = np.stack([np.bincount(region, by_point[valid][:, k]) for k in range(3)], axis=1)
    compared = counts[:, SEEN] + counts[:, DENIED] >= MIN_COMPARED
    contradictions = np.where(compared, _contradiction(counts, noise), 0.0)
    return [
        MapRegion(REGION * x, REGION * y, math.sqrt(drifts[k]), float(contradictions[k]))
        for k, (x, y) in enumerate(cells.tolist())
        if points[k] >= MIN_POINTS
    ]
