"""Pairwise scan matching between the stations of a calibration drive.

Pairs of scans are matched point to line (Chen & Medioni 1991; Censi, An ICP variant using a point-to-line
metric, ICRA 2008) and become constraints of a pose graph that is solved as a whole (Lu & Milios, Globally
consistent range scan alignment for environment mapping, Autonomous Robots 4, 1997). An incremental map would
keep the odometry error of its first scans, which is the error to be calibrated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from chefbot.calibration.surface import END, Array, Surface
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

MATCH_DISTANCES = (0.3, 0.15, 0.08, 0.05)
"""Maximum distances of a correspondence, m, from the first guess to the last iterations."""
STEPS, CONVERGENCE_STEP = 3, 2e-4
"""Maximum iterations at each distance, and the step, m and rad, below which they stop early."""
MIN_NORMAL_COSINE = math.cos(math.radians(40.0))
"""Minimum cosine of the angle between the normals of a correspondence."""
MIN_COMMON_POINTS = 25
"""Minimum number of points that two scans must share."""
MIN_OVERLAP = 0.35
"""Minimum fraction of a scan's points that the other scan contains."""
MAX_LINKS = 8
"""Maximum number of links of a station to earlier ones, spread over the drive."""
MAX_CORRECTION = (0.15, 0.15)
"""Maximum distance of a match from its first guess, m and rad."""
DAMPING = np.diag([1.0 / 0.03**2, 1.0 / 0.03**2, 1.0 / 0.03**2])
"""Regularisation that keeps unobservable directions near the first guess; it is not counted as
information."""
DIRECTION_NOISE_FACTOR = 3.0
"""Factor on the apparent information from noise of the line directions, which is subtracted; 1 is its
mean."""
OUTLIER_POINTS = 8.0
"""Number of points constraining a direction that may be matched with a wrong wall."""
VIEWPOINT_COVARIANCE = np.diag([0.003**2, 0.003**2, 0.001**2])
"""Covariance, m^2 and rad^2, of the difference of scans from two places, where edges show other sides."""
SUBSAMPLING = 4


class ScanMatch(NamedTuple):
    """A constraint between two stations: `first_T_second` from their scans, and its information matrix.

    information: inverse covariance (3, 3) of x, y m and yaw rad. Along a single wall the pose is
    unobservable, and the information is zero.
    """

    first: int
    second: int
    pose: SE2
    information: Array


def link_stations(poses: Sequence[SE2], surfaces: Sequence[Surface], begin: int = 1) -> list[ScanMatch]:
    """Match all stations from `begin` on with earlier ones that overlap; `poses` are the first guess."""
    found = []
    for second in range(max(begin, 1), len(surfaces)):
        for first in _overlapping_stations(
            surfaces[second], poses[second], poses[:second], surfaces[:second]
        ):
            link = match(first, second, poses[first].between(poses[second]), surfaces)
            if link is not None:
                found.append(link)
    return found


def localize_station(surface: Surface, guess: SE2, poses: Sequence[SE2], surfaces: Sequence[Surface]) -> SE2:
    """Return the pose of a new station matched against all earlier ones; unobservable directions stay as
    guessed."""
    all_surfaces = [*surfaces, surface]
    information, weighted = DAMPING.copy(), np.zeros(3)
    # Sum the information of all matches in the frame of the poses
    for first in _overlapping_stations(surface, guess, poses, surfaces):
        link = match(first, len(surfaces), poses[first].between(guess), all_surfaces)
        if link is None:
            continue
        matched = poses[first] @ link.pose
        offset = np.array([matched.x - guess.x, matched.y - guess.y, wrap(matched.yaw - guess.yaw)])
        link_information = _rotate_information(link.information, poses[first].yaw)
        information, weighted = information + link_information, weighted + link_information @ offset
    # Information-weighted mean: (sum of information + damping) dx = sum of information * offset
    return SE2.of(guess.array() + np.linalg.solve(information, weighted))


def _rotate_information(information: Array, yaw: float) -> Array:
    """Return an information matrix rotated by `yaw` into the parent frame: R I R^T."""
    c, s = math.cos(yaw), math.sin(yaw)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(R @ information @ R.T)


def _overlapping_stations(
    surface: Surface, pose: SE2, poses: Sequence[SE2], surfaces: Sequence[Surface]
) -> list[int]:
    """Return indices of stations whose scans overlap, spread evenly over the drive."""
    points = pose.apply(surface.walls[::SUBSAMPLING])
    if len(points) * SUBSAMPLING < MIN_COMMON_POINTS:
        return []
    overlapping = []
    for index, (other, other_pose) in enumerate(zip(surfaces, poses, strict=True)):
        if len(other.walls) < MIN_COMMON_POINTS:
            continue
        distances, _ = other.tree.query(
            other_pose.inverse().apply(points), distance_upper_bound=MATCH_DISTANCES[0]
        )
        if np.isfinite(distances).mean() > MIN_OVERLAP:
            overlapping.append(index)
    if len(overlapping) <= MAX_LINKS:
        return overlapping
    return [overlapping[k] for k in np.linspace(0, len(overlapping) - 1, MAX_LINKS).round().astype(int)]


def match(first: int, second: int, guess: SE2, surfaces: Sequence[Surface]) -> ScanMatch | None:
    """Match two stations by point-to-line ICP; return None if they overlap too little or the match is
    implausible."""
    target, source, estimate = surfaces[first], surfaces[second], guess
    # ICP with shrinking correspondence distance
    for max_distance in MATCH_DISTANCES:
        for _ in range(STEPS):
            pairs = _correspond(estimate, source, target, max_distance)
            if pairs is None:
                return None
            error, J, _ = pairs
            # Gauss-Newton: (J^T J / sigma^2 + damping) dx = J^T r / sigma^2
            step = np.linalg.solve(J.T @ J / END**2 + DAMPING, J.T @ error / END**2)
            estimate = SE2.of(estimate.array() - step)
            if np.abs(step).max() < CONVERGENCE_STEP:
                break
    moved = guess.between(estimate)
    if math.hypot(moved.x, moved.y) > MAX_CORRECTION[0] or abs(moved.yaw) > MAX_CORRECTION[1]:
        return None  # it slid along a wall to another one that looks alike
    pairs = _correspond(estimate, source, target, MATCH_DISTANCES[-1])
    return None if pairs is None else ScanMatch(first, second, estimate, _match_information(pairs))


class _Correspondences(NamedTuple):
    """The correspondences of a match.

    error: distances of points from their lines (n,), m. jacobian: their Jacobian by x, y, yaw (n, 3).
    jacobian_noise: standard deviation of the Jacobian from the uncertain line directions (n, 3).
    """

    error: Array
    jacobian: Array
    jacobian_noise: Array


def _correspond(
    estimate: SE2, source: Surface, target: Surface, max_distance: float
) -> _Correspondences | None:
    """Return the correspondences of the source's points with walls of similar normal within `max_distance`,
    or None if few.

    Near a corner the closest wall is often the one around it, and would push the match along its own wall;
    rejecting pairs by their normals is Pulli's criterion (Rusinkiewicz & Levoy, Efficient variants of the ICP
    algorithm, 3DIM 2001).
    """
    # Nearest neighbours on straight walls
    points = estimate.apply(source.points)
    distances, nearest = target.tree.query(points, distance_upper_bound=max_distance)
    valid = np.isfinite(distances) & source.flat
    valid[valid] = target.flat[nearest[valid]]
    points, nearest, source_normals = points[valid], nearest[valid], source.normals[valid]
    normals = target.normals[nearest]
    # Reject pairs whose normals differ
    c, s = math.cos(estimate.yaw), math.sin(estimate.yaw)
    similar = (
        np.abs((normals * (source_normals @ np.array([[c, s], [-s, c]]))).sum(axis=1)) > MIN_NORMAL_COSINE
    )
    if similar.sum() < MIN_COMMON_POINTS:
        return None
    points, nearest, normals = points[similar], nearest[similar], normals[similar]
    # Point-to-line residual and its Jacobian
    lever = points - (estimate.x, estimate.y)
    error = ((points - target.middles[nearest]) * normals).sum(axis=1)
    along = np.column_stack([normals[:, 1], -normals[:, 0]])
    return _Correspondences(
        error,
        _point_jacobian(normals, lever),
        np.sqrt(target.tilts[nearest])[:, None] * _point_jacobian(along, lever),
    )


def _point_jacobian(axes: Array, lever: Array) -> Array:
    """Return the Jacobian (n, 3) by x, y, yaw of the motion of points at `lever` (n, 2) along `axes` (n,
    2)."""
    return np.column_stack([axes, axes[:, 1] * lever[:, 0] - axes[:, 0] * lever[:, 1]])


def _match_information(pairs: _Correspondences) -> Array:
    """Return the information matrix (3, 3) of a match, with negative eigenvalues set to zero."""
    # J^T J / sigma^2 less the share of noisy directions and of wrong pairs
    J, jacobian_noise = pairs.jacobian, pairs.jacobian_noise
    values, axes = np.linalg.eigh(
        (J.T @ J - DIRECTION_NOISE_FACTOR * jacobian_noise.T @ jacobian_noise - OUTLIER_POINTS * np.eye(3))
        / END**2
    )
    information = (axes * np.maximum(values, 0.0)) @ axes.T
    # (information^-1 + VIEWPOINT_COVARIANCE)^-1, which exists even if `information` is singular
    return np.asarray(
        information
        - information @ np.linalg.solve(information + np.linalg.inv(VIEWPOINT_COVARIANCE), information)
    )
