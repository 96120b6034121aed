"""Joint adjustment of all scan poses: scans that see the same surfaces are registered with each other."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from chefbot.slam.graph.pair_matching import linearize_pairs
from chefbot.slam.graph.pose_graph import Edges, optimized
from chefbot.slam.graph.scan_features import ScanFeatures

Array = NDArray[np.float64]
_SCALES = (0.2, 0.15, 0.1, 0.08, 0.08, 0.08)
_PARTNERS = 10
_NEIGHBOURS = 80
_METRES_PER_RADIAN = 2.0
_MAX_DISTANCE = 10.0
_NOISE = 0.03
_BEAMS = 60.0
_MIN_PAIRED, _MIN_SHARE = 15.0, 0.25


class Adjustment:
    """The scans of a graph as flat arrays."""

    def __init__(self, features: list[ScanFeatures]) -> None:
        self._points = np.concatenate([f.points for f in features])
        sensors = np.repeat([f.sensor for f in features], [len(f.points) for f in features], axis=0)
        offset = self._points - sensors
        self._directions = offset / np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-6)[:, None]
        self.range_offset = 0.0
        self.debug = []
        self._normals = np.concatenate([f.normals for f in features])
        self._bearings = np.concatenate([f.bearings for f in features])
        self._sensors = np.array([f.sensor for f in features])
        self._begin = np.concatenate([[0], np.cumsum([len(f.points) for f in features])])

    def adjusted(self, poses: Array, odometry: Edges) -> Array:
        """Return the adjusted poses (n, 3). odometry: the edges between consecutive scans."""
        for k, scale in enumerate(_SCALES):
            if k in (0, 3):
                of, to = partners(poses)
            pairs = self._edges(poses, of, to, scale)
            poses = optimized(poses, Edges.concatenated([odometry, pairs]), 3)
        return poses

    def _edges(self, poses: Array, of: NDArray[np.int64], to: NDArray[np.int64], scale: float) -> Edges:
        h, g, counts = linearize_pairs(
            of, to, poses, self._points, self._normals, self._bearings, self._begin, self._sensors, scale
        )
        total = np.minimum(counts[:, 1], (self._begin[1:] - self._begin[:-1])[of])
        good = (counts[:, 0] >= _MIN_PAIRED) & (counts[:, 0] >= _MIN_SHARE * total)
        of, to, h, g, paired = of[good], to[good], h[good], g[good], counts[good, 0]
        self._shift_ranges(h, g)
        h, g = h[:, :3, :3], g[:, :3]
        # The minimum of each pair's quadratic, held where no surface decides
        step = -np.linalg.solve(h + 1e-3 * np.eye(3), g[:, :, None])[:, :, 0]
        weight = np.minimum(1.0, _BEAMS / paired) / _NOISE**2 * 2.0 / _PARTNERS
        information = h * weight[:, None, None]
        measured = _relative(poses[of], poses[to]) + step
        return Edges(of, to, measured, information, np.full(len(of), np.inf))

    def _shift_ranges(self, h: Array, g: Array) -> None:
        """Move all points along their beams by the offset that lets the pairs agree best, whatever their poses."""
        cross = h[:, :3, 3]
        inner = np.linalg.solve(h[:, :3, :3] + 1e-3 * np.eye(3), np.stack([cross, g[:, :3]], axis=2))
        stiffness = (h[:, 3, 3] - (cross * inner[:, :, 0]).sum(axis=1)).sum()
        slope = (g[:, 3] - (cross * inner[:, :, 1]).sum(axis=1)).sum()
        step = -slope / stiffness
        self.range_offset += step
        self.debug.append((step, math.sqrt(_NOISE**2/stiffness)))
        self._points += np.float32(step) * self._directions


def partners(poses: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return pairs of scans that probably see the same surfaces: near in place and heading."""
    n = len(poses)
    distance, near = cKDTree(poses[:, :2]).query(poses[:, :2], k=min(_NEIGHBOURS, n))
    turn = np.abs((poses[near, 2] - poses[:, None, 2] + math.pi) % (2 * math.pi) - math.pi)
    cost = distance + _METRES_PER_RADIAN * turn
    cost[(near == np.arange(n)[:, None]) | (cost > _MAX_DISTANCE)] = np.inf
    order = np.argsort(cost, axis=1, kind="stable")
    # Near partners and far ones: far ones keep chains of scans straight
    valid = np.isfinite(cost).sum(axis=1)
    rank = np.minimum((valid[:, None] ** np.linspace(0.0, 1.0, _PARTNERS)).astype(np.int64), valid[:, None]) - 1
    step = np.arange(_PARTNERS)
    rank = np.minimum(np.maximum(rank, step), valid[:, None] - 1)
    rows = np.repeat(np.arange(n), _PARTNERS)[(rank >= 0).ravel()]
    rank = rank.ravel()[(rank >= 0).ravel()]
    ends = np.sort(np.column_stack([rows, near[rows, order[rows, rank]]]), axis=1)
    following = np.concatenate([np.column_stack([np.arange(n - k), np.arange(k, n)]) for k in (1, 2) if n > k] or [np.zeros((0,2),int)])
    pairs = np.unique(np.concatenate([ends, following]), axis=0)
    return pairs[:, 0].astype(np.int64), pairs[:, 1].astype(np.int64)


def _relative(a: Array, b: Array) -> Array:
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    dx, dy = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1]
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, b[:, 2] - a[:, 2]])
