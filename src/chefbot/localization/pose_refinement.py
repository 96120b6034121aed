"""Refinement of the reported pose: the mean of the cluster is moved to the maximum a posteriori pose.

Particles are too sparse for a pose accurate to a centimetre. Gauss-Newton on the distance field, with the
cluster's Gaussian as prior, yields the maximum a posteriori pose under the filter's own model (Probabilistic
Robotics, 3.2; registration to a distance field as in Fitzgibbon 2003, Robust registration of 2D and 3D point
sets). A direction that the scan does not constrain, as along a corridor, keeps the particles' estimate.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

MAX_ITERATIONS = 8
CONVERGENCE_STEP = 1e-4
"""Step size in metres and radians below which the iteration ends."""


@njit(cache=True, nogil=True)
def _sample(field: NDArray[np.float32], u: float, v: float, per_metre: float) -> tuple[float, float, float]:
    """Return the bilinearly interpolated distance at (column u, row v) and its gradient in x and y (m/m).

    Cell centres are at integers.
    """
    # Clamp to the field; `> 0` also keeps NaN from becoming an index
    u = min(u, field.shape[1] - 1.001) if u > 0.0 else 0.0
    v = min(v, field.shape[0] - 1.001) if v > 0.0 else 0.0
    col, row = int(u), int(v)
    a, b = u - col, v - row
    d00, d01 = field[row, col], field[row, col + 1]
    d10, d11 = field[row + 1, col], field[row + 1, col + 1]
    # Interpolate along the two rows, then between them
    low, high = d00 + a * (d01 - d00), d10 + a * (d11 - d10)
    slope_x = (1.0 - b) * (d01 - d00) + b * (d11 - d10)
    return low + b * (high - low), slope_x * per_metre, (high - low) * per_metre


@njit(cache=True, nogil=True)
def _normal_equations(
    pose: NDArray[np.float64],
    points: NDArray[np.float64],
    field: NDArray[np.float32],
    frame: tuple[float, float, float],
    sigma: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return J'WJ (3, 3), J'Wd (3,) and the robust cost of all points.

    Geman-McClure weights with scale 2 sigma reject outliers.
    """
    H = np.zeros((3, 3))
    g = np.zeros(3)
    cost = 0.0
    scale = (2.0 * sigma) ** 2
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(points.shape[0]):
        # Rotate the beam's end and look up its distance d to the map with gradient (gx, gy)
        rx, ry = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
        u = (pose[0] + rx - frame[0]) * frame[2] - 0.5
        v = (pose[1] + ry - frame[1]) * frame[2] - 0.5
        d, gx, gy = _sample(field, u, v, frame[2])
        # Geman-McClure loss and its weight
        cost += scale * d * d / (scale + d * d)
        w = (scale / (scale + d * d)) ** 2
        # Jacobian of d with respect to x, y, yaw
        J = (gx, gy, -gx * ry + gy * rx)
        for a in range(3):
            g[a] += w * J[a] * d
            for b in range(3):
                H[a, b] += w * J[a] * J[b]
    return H, g, cost


@njit(cache=True, nogil=True)
def _product(A: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the product of A (3, 3) and x (3,)."""
    out = np.empty(3)
    for i in range(3):
        out[i] = A[i, 0] * x[0] + A[i, 1] * x[1] + A[i, 2] * x[2]
    return out


@njit(cache=True, nogil=True)
def _solve(A: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve A x = b for a positive definite A (3, 3) by Cholesky; LAPACK's takes seconds to compile."""
    # A = L L'; forward substitution L y = b in the same loop
    L, x = np.zeros((3, 3)), b.copy()
    for i in range(3):
        for j in range(i + 1):
            remainder = A[i, j]
            for k in range(j):
                remainder -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(remainder) if i == j else remainder / L[j, j]
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    # Back substitution L' x = y
    for i in range(2, -1, -1):
        for k in range(i + 1, 3):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
    return x


@njit(cache=True, nogil=True)
def _gauss_newton(
    start: NDArray[np.float64],
    information: NDArray[np.float64],
    points: NDArray[np.float64],
    field: NDArray[np.float32],
    frame: tuple[float, float, float],
    sigma: float,
    precision: float,
) -> NDArray[np.float64]:
    """Return the pose (3,) of minimum cost visited by Gauss-Newton from `start`."""
    pose, best = start.copy(), start.copy()
    min_cost = np.inf
    for _ in range(MAX_ITERATIONS):
        H, g, cost = _normal_equations(pose, points, field, frame, sigma)
        # Total cost: beams plus Mahalanobis distance to the prior
        deviation = pose - start
        prior_gradient = _product(information, deviation)
        total_cost = (
            precision * cost
            + deviation[0] * prior_gradient[0]
            + deviation[1] * prior_gradient[1]
            + deviation[2] * prior_gradient[2]
        )
        # Stop when the cost rises
        if total_cost >= min_cost:
            break
        best, min_cost = pose, total_cost
        # Gauss-Newton step: (J'WJ + P^-1) step = J'Wd + P^-1 (x - x0)
        step = _solve(precision * H + information, precision * g + prior_gradient)
        pose = pose - step
        if max(abs(step[0]), abs(step[1]), abs(step[2])) < CONVERGENCE_STEP:
            break
    return best


def refine(
    prior: SE2,
    covariance: NDArray[np.float64],
    points: NDArray[np.float64],
    field: LikelihoodField,
    sigma: float,
    exponent: float,
) -> SE2:
    """Return the pose of highest posterior near `prior`; the prior itself where nothing better is found.

    points: beam ends (m, 2), metres, base frame. exponent: tempering exponent, the weight of one beam.
    """
    frame = (field.origin_x, field.origin_y, 1.0 / field.grid.resolution)
    information = np.linalg.inv(covariance + np.diag([1e-6, 1e-6, 1e-6]))
    precision = exponent / sigma**2
    x, y, yaw = _gauss_newton(prior.array(), information, points, field.distance, frame, sigma, precision)
    return SE2(float(x), float(y), wrap(float(yaw)))


def explained(pose: SE2, points: NDArray[np.float64], field: LikelihoodField, within: float) -> float:
    """Return the share of the beam ends (m, 2), base frame, within that many metres of an obstacle; or 0."""
    if points.shape[0] == 0:
        return 0.0
    ends = pose.apply(points)
    rows = np.floor((ends[:, 1] - field.origin_y) / field.grid.resolution).astype(np.int64)
    cols = np.floor((ends[:, 0] - field.origin_x) / field.grid.resolution).astype(np.int64)
    height, width = field.distance.shape
    distances = field.distance[np.clip(rows, 0, height - 1), np.clip(cols, 0, width - 1)]
    return float(np.mean(distances <= within))
