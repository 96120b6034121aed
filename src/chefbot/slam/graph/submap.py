"""Submaps: the surfaces of a stretch of the path in a frame of their own, and scan matching against them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ChefbotError
from chefbot.slam.graph.correlation import correlate
from chefbot.slam.graph.least_squares import inverse
from chefbot.slam.graph.refinement import refine
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.graph.surface_grid import CELL, SurfaceGrid
from chefbot.slam.scan_beams import Beams

Array = NDArray[np.float64]
_SIGMAS = 3.0
"""Half width of the search window in standard deviations of odometry."""
_MIN_WINDOW, _MAX_WINDOW = np.array([0.1, 0.03]), np.array([1.0, 0.8])
"""Limits of the half widths, m and rad."""
_MIN_TURN, _MAX_TURN = 0.01, 0.05
"""Limits of the coarse angular step, rad."""
_COARSE_POINTS = 120
"""Number of points that the correlative search uses."""


@dataclass(eq=False)
class ScanNode:
    """A processed scan: its beams for the map, its features for matching, and where it was.

    submap: index of the submap whose frame `pose` (3,) is in. motion, motion_covariance: odometry (3,) since the node
    before and its covariance (3, 3), in the frame of that node.
    """

    beams: Beams
    features: ScanFeatures
    submap: int
    pose: Array
    motion: Array
    motion_covariance: Array


class FinishedSubmapError(ChefbotError):
    """A submap whose surfaces have been discarded, where they are needed."""


class Match(NamedTuple):
    """A matched pose (3,) in a submap, the scan's information (3, 3) about it, and the share of inliers."""

    pose: Array
    information: Array
    inliers: float


@dataclass(eq=False)
class Submap:
    """A stretch of the path: its own nodes, those before it that overlap, and the surfaces of both.

    `overlap` holds nodes of the submap before with their poses in this one's frame. `grid` is None once the
    surfaces have been discarded; they can be drawn again from the nodes.
    """

    nodes: list[int] = field(default_factory=list)
    overlap: list[tuple[int, Array]] = field(default_factory=list)
    grid: SurfaceGrid | None = None
    travel: float = 0.0
    reach: float = 0.0
    """Distance from the origin within which most of its surfaces lie, m."""
    added_covariance: Array = field(default_factory=lambda: np.zeros((3, 3)))
    """Covariance (3, 3) of the steps whose scans fitted poorly, summed."""

    def insert(self, features: ScanFeatures, pose: Array) -> None:
        """Add the surfaces of a scan at `pose` (3,) in this submap's frame."""
        self.reach = max(self.reach, float(np.hypot(pose[0], pose[1])) + features.reach)
        if self.grid is not None:
            self.grid.add(features.outline, pose)

    def match(self, features: ScanFeatures, prior: Array, covariance: Array, beams: float) -> Match:
        """Match a scan near the odometry prior (3,) with its covariance (3, 3), in this submap's frame."""
        if self.grid is None:
            raise FinishedSubmapError("scans are matched against the submap under construction only")
        information = inverse(covariance)
        points, normals = features.points, features.normals
        if not len(points):
            return Match(prior, np.zeros((3, 3)), 0.0)
        deviation = np.sqrt([max(covariance[0, 0], covariance[1, 1]), covariance[2, 2]])
        window = np.clip(_SIGMAS * deviation, _MIN_WINDOW, _MAX_WINDOW)
        coarse = points[:: 1 + len(points) // _COARSE_POINTS]
        turn = min(max(CELL / max(features.reach, CELL), _MIN_TURN), _MAX_TURN)
        start, _ = correlate(
            coarse,
            prior,
            information,
            beams,
            window,
            np.array([CELL, turn]),
            self.grid.field,
            self.grid.origin,
        )
        return Match(
            *refine(
                points,
                normals,
                start,
                prior,
                information,
                beams,
                self.grid.slot,
                self.grid.totals,
                self.grid.origin,
            )
        )
