"""How far poses may be off: what odometry and the surfaces that keyframes have in common leave open.

Keyframes are the nodes of a pose graph. Its covariance shows where the map can bend although all scans agree: along a
corridor without features, or far from every loop closure.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from chefbot.slam.map_error.keyframes import Floats, Keyframes
from chefbot.slam.map_error.view_overlap import SEEN, Overlaps

SURFACE_STD = 0.03
"""Standard deviation of the distance between two views of a surface, m."""
INDEPENDENT_POINTS = 30.0
"""Largest number of independent points of two views."""
PASS_WEIGHT = 0.5
"""Weight of another pass beside that of the next keyframe: passes that overlap are not independent."""
MIN_SHARE = 0.3
"""Share of a keyframe's points that another pass must see so that it counts."""
ODOMETRY_STD = 0.02
"""Standard deviation of odometry per metre, m and rad."""
MIN_ODOMETRY_STD = 0.005
MIN_STEP = 0.5
"""Shortest distance of odometry, m: the robot also turns on the spot."""
JOINT_STD = 0.15
"""Standard deviation between the end of a drive and the begin of the next one, m and rad."""


def expected_std(frames: Keyframes, overlaps: Overlaps) -> Floats:
    """Return (n,) the standard deviation of each keyframe's position after the best rigid alignment of the map, m."""
    n = len(frames)
    information = np.zeros((3 * n, 3 * n))
    weights = _weights(frames, overlaps)
    _add_pairs(information, overlaps.pairs, weights, overlaps.information)
    steps = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    _add_pairs(information, steps, np.ones(n - 1), np.array([_odometry(frames, i) for i in range(n - 1)]))
    # The first pose is fixed, then the freedom of a rigid motion is taken out
    covariance = np.zeros_like(information)
    covariance[3:, 3:] = np.linalg.inv(information[3:, 3:])
    positions = np.arange(3 * n).reshape(n, 3)[:, :2].ravel()
    rest = np.eye(2 * n) - _rigid_motions(frames.poses[:, :2])
    aligned = rest @ covariance[np.ix_(positions, positions)] @ rest
    return np.sqrt(np.maximum(np.diag(aligned).reshape(n, 2).sum(axis=1), 0.0))


def _weights(frames: Keyframes, overlaps: Overlaps) -> Floats:
    """Return the weight (m,) of each pair's information, 1/m^2."""
    seen = overlaps.counts[:, SEEN]
    share = seen / np.maximum(frames.counts[overlaps.pairs[:, 0]], 1)
    counted = (seen > 0) & (overlaps.following | (share >= MIN_SHARE))
    independent = np.minimum(INDEPENDENT_POINTS, seen) / np.maximum(seen, 1.0)
    weights: Floats = counted * independent * np.where(overlaps.following, 1.0, PASS_WEIGHT) / SURFACE_STD**2
    return weights


def _odometry(frames: Keyframes, i: int) -> Floats:
    """Return the information (6, 6) of the motion from keyframe i to the next one."""
    dx, dy = frames.poses[i + 1, :2] - frames.poses[i, :2]
    length = max(frames.travel[i + 1] - frames.travel[i], MIN_STEP)
    same = frames.drive[i] == frames.drive[i + 1]
    std = ODOMETRY_STD * length + MIN_ODOMETRY_STD if same else JOINT_STD
    # Error of the relative pose by the errors of both: a turn of the first one moves the second
    jacobian = np.array(
        [[-1.0, 0.0, dy, 1.0, 0.0, 0.0], [0.0, -1.0, -dx, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0, 0.0, 0.0, 1.0]]
    )
    return jacobian.T @ jacobian / std**2


@njit(cache=True, nogil=True)
def _add_pairs(information, pairs, weights, blocks):  # type: ignore[no-untyped-def]
    """Add the information (m, 6, 6) of pairs of poses (m, 2), with weights (m,), to that of all (3n, 3n)."""
    for m in range(len(pairs)):
        if weights[m] == 0.0:
            continue
        for u in range(6):
            row = 3 * pairs[m, u // 3] + u % 3
            for v in range(6):
                information[row, 3 * pairs[m, v // 3] + v % 3] += weights[m] * blocks[m, u, v]


def _rigid_motions(path: Floats) -> Floats:
    """Return the projection (2n, 2n) onto the rigid motions of points (n, 2)."""
    n, centred = len(path), path - path.mean(axis=0)
    motions = np.zeros((2 * n, 3))
    motions[0::2, 0] = motions[1::2, 1] = 1.0
    motions[0::2, 2], motions[1::2, 2] = -centred[:, 1], centred[:, 0]
    basis, triangle = np.linalg.qr(motions)
    basis = basis[:, np.abs(np.diag(triangle)) > 1e-9]
    projection: Floats = basis @ basis.T
    return projection
