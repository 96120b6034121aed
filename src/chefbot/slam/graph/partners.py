"""Pairs of scans that probably see the same surfaces."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from chefbot.slam.graph.edges import Array

PARTNERS = 10
"""Number of partners of a scan."""
_NEIGHBOURS = 80
"""Number of nearest scans that they are chosen from."""
_METRES_PER_RADIAN = 2.0
"""A difference in heading counts as so much distance: fields of view that overlap less."""
_MAX_DISTANCE = 10.0
"""Largest distance of partners, m, heading included."""

Indices = NDArray[np.int64]


def partners(poses: Array) -> tuple[Indices, Indices]:
    """Return the pairs (m,), (m,) of scans at poses (n, 3) that are near in place and heading, each pair once.

    Of the scans around, near and far ones are chosen, by geometrically growing rank: near ones overlap most, far
    ones keep a chain of scans straight. The next scan but one is always a partner.
    """
    n = len(poses)
    order, valid = _by_distance(poses)
    step = np.arange(PARTNERS)
    rank = valid[:, None] ** (step / (PARTNERS - 1))
    rank = np.minimum(np.maximum(rank.astype(np.int64) - 1, step), valid[:, None] - 1)
    chosen = np.take_along_axis(order, np.maximum(rank, 0), axis=1)
    rows = np.broadcast_to(np.arange(n)[:, None], rank.shape)
    pairs = [np.column_stack([rows[rank >= 0], chosen[rank >= 0]])]
    pairs += [np.column_stack([np.arange(n - k), np.arange(k, n)]) for k in (1, 2) if n > k]
    unique = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0).astype(np.int64)
    return unique[:, 0], unique[:, 1]


def _by_distance(poses: Array) -> tuple[Indices, Indices]:
    """Return for each scan those around it (n, k) in order of distance, and how many are near enough (n,)."""
    n = len(poses)
    distance, near = cKDTree(poses[:, :2]).query(poses[:, :2], k=range(1, min(_NEIGHBOURS, n) + 1))
    turn = np.abs((poses[near, 2] - poses[:, None, 2] + math.pi) % (2.0 * math.pi) - math.pi)
    cost = distance + _METRES_PER_RADIAN * turn
    cost[(near == np.arange(n)[:, None]) | (cost > _MAX_DISTANCE)] = np.inf
    order = np.argsort(cost, axis=1, kind="stable")
    return np.take_along_axis(near, order, axis=1), np.isfinite(cost).sum(axis=1)
