"""Joint adjustment of all poses: scans that see the same surfaces are registered with each other.

Lu & Milios, Globally Consistent Range Scan Alignment for Environment Mapping, Autonomous Robots 4, 1997, with the
distance to lines (Censi, An ICP variant using a point-to-line metric, ICRA 2008) and the ranges' common offset.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from chefbot.slam.graph.edges import Array, Edges
from chefbot.slam.graph.pair_matching import linearize_pairs
from chefbot.slam.graph.partners import PARTNERS, Indices, partners
from chefbot.slam.graph.pose_graph import optimized
from chefbot.slam.graph.range_calibration import MAX_OFFSET, range_equation
from chefbot.slam.graph.refinement import SURFACE_NOISE
from chefbot.slam.graph.relative_poses import relative
from chefbot.slam.graph.scan_features import ScanFeatures, directions

_SCALES = (0.2, 0.15, 0.1, 0.08, 0.08, 0.08)
"""Width of the robust kernel in each round, m."""
_NEW_PARTNERS = (0, 3)
"""Rounds before which partners are chosen."""
_ITERATIONS = 3
"""Iterations of the solver in a round."""
_BEAMS = 60.0
"""A pair counts as at most so many independent points."""
_MIN_POINTS, _MIN_SHARE = 15.0, 0.25
"""Smallest weight of paired points of a pair, and its share of the points of the smaller scan."""
_STIFFNESS = 1e-3
"""Weight that keeps a pair as it is where no surface decides."""


class Adjustment:
    """The scans of a graph as flat arrays, and the offset of their ranges found so far."""

    def __init__(self, features: list[ScanFeatures], calibrates_ranges: bool = True) -> None:
        """calibrates_ranges: whether an offset of all ranges is estimated."""
        self._calibrates_ranges = calibrates_ranges
        sizes = [len(f.points) for f in features]
        self._begin = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        self._points = np.concatenate([f.points for f in features])
        self._normals = np.concatenate([f.normals for f in features])
        self._bearings = np.concatenate([f.bearings for f in features])
        self._sensors = np.array([f.sensor for f in features])
        self._directions = directions(self._points, np.repeat(self._sensors, sizes, axis=0))
        # Undo what the ranges were corrected by so far, and correct all alike
        applied = np.array([f.range_offset for f in features], np.float32)
        self.range_offset = float(applied[-1])
        self._points += np.repeat(applied[-1] - applied, sizes)[:, None] * self._directions

    def adjusted(self, poses: Array, held: Callable[[Array], Edges]) -> Array:
        """Return the adjusted poses (n, 3). held: returns further edges, as of odometry and closures, at poses."""
        for k, scale in enumerate(_SCALES):
            if k in _NEW_PARTNERS:
                of, to = partners(poses)
            edges = self._registered(poses, of, to, scale)
            poses = optimized(poses, Edges.concatenated([held(poses), edges]), _ITERATIONS)
        return poses

    def _registered(self, poses: Array, of: Indices, to: Indices, scale: float) -> Edges:
        """Return an edge for each pair that overlaps: the minimum of its quadratic, with its curvature."""
        h, g, counts = linearize_pairs(
            of, to, poses, self._points, self._normals, self._bearings, self._begin, self._sensors, scale
        )
        smaller = np.minimum(counts[:, 1], np.diff(self._begin)[of])
        good = (counts[:, 0] >= _MIN_POINTS) & (counts[:, 0] >= _MIN_SHARE * smaller)
        if not good.any():
            return Edges.empty()
        of, to, h, g, weight = of[good], to[good], h[good], g[good], counts[good, 0]
        if self._calibrates_ranges:
            self._shift_ranges(h, g)
        step = -np.linalg.solve(h[:, :3, :3] + _STIFFNESS * np.eye(3), g[:, :3, None])[:, :, 0]
        # A scan's information is shared by its pairs
        scaled = np.minimum(1.0, _BEAMS / weight) / SURFACE_NOISE**2 * (2.0 / PARTNERS)
        information = h[:, :3, :3] * scaled[:, None, None]
        return Edges(of, to, relative(poses[of], poses[to]) + step, information, np.full(len(of), np.inf))

    def _shift_ranges(self, h: Array, g: Array) -> None:
        """Move all points along their beams by the offset at which the pairs fit best."""
        stiffness, slope = range_equation(h, g)
        offset = float(np.clip(self.range_offset - slope / max(stiffness, 1e-9), -MAX_OFFSET, MAX_OFFSET))
        self._points += np.float32(offset - self.range_offset) * self._directions
        self.range_offset = offset
