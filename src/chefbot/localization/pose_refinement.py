"""The reported pose: the belief's mean, moved to where the scan fits the map best as far as the belief
allows.

Particles are too coarse to say a pose to a centimetre. Gauss-Newton on the distance field, with the
cluster's Gaussian as prior, is the maximum a posteriori pose under the filter's own model (Probabilistic
Robotics, 3.2; scan to field as in Fitzgibbon 2003, Robust registration of 2D and 3D point sets). A direction
that the scan does not show, as along a corridor, keeps the particles' answer.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

ITERATIONS = 8
ENOUGH = 1e-4
"""Metres and radians: a smaller step ends the iteration."""


@njit(cache=True, nogil=True)
def _sample(field: NDArray[np.float32], u: float, v: float, per_metre: float) -> tuple[float, float, float]:
    """Bilinear distance at (column u, row v), cell centres at whole numbers, and its slope in x and y
    (m/m)."""
    # `> 0` also keeps NaN from becoming an index
    u = min(u, field.shape[1] - 1.001) if u > 0.0 else 0.0
    v = min(v, field.shape[0] - 1.001) if v > 0.0 else 0.0
    col, row = int(u), int(v)
    a, b = u - col, v - row
    d00, d01 = field[row, col], field[row, col + 1]
    d10, d11 = field[row + 1, col], field[row + 1, col + 1]
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
    """J'WJ (3, 3), J'Wd (3,) and robust cost of all points; Geman-McClure weights with scale 2 sigma drop
    strangers."""
    H = np.zeros((3, 3))
    g = np.zeros(3)
    cost = 0.0
    scale = (2.0 * sigma) ** 2
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(points.shape[0]):
        rx, ry = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
        u = (pose[0] + rx - frame[0]) * frame[2] - 0.5
        v = (pose[1] + ry - frame[1]) * frame[2] - 0.5
        d, gx, gy = _sample(field, u, v, frame[2])
        cost += scale * d * d / (scale + d * d)
        w = (scale / (scale + d * d)) ** 2
        J = (gx, gy, -gx * ry + gy * rx)
        for a in range(3):
            g[a] += w * J[a] * d
            for b in range(3):
                H[a, b] += w * J[a] * J[b]
    return H, g, cost


@njit(cache=True, nogil=True)
def _times(A: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """A x for three unknowns."""
    out = np.empty(3)
    for i in range(3):
        out[i] = A[i, 0] * x[0] + A[i, 1] * x[1] + A[i, 2] * x[2]
    return out


@njit(cache=True, nogil=True)
def _solve(A: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """x (3,) of A x = b for a positive definite A (3, 3), by Cholesky; LAPACK's takes seconds to compile."""
    L, x = np.zeros((3, 3)), b.copy()
    for i in range(3):
        for j in range(i + 1):
            rest = A[i, j]
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(rest) if i == j else rest / L[j, j]
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
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
    """The pose (3,) of least cost met on the way down from `start`."""
    pose, best = start.copy(), start.copy()
    least = np.inf
    for _ in range(ITERATIONS):
        H, g, cost = _normal_equations(pose, points, field, frame, sigma)
        off = pose - start
        pull = _times(information, off)
        total = precision * cost + off[0] * pull[0] + off[1] * pull[1] + off[2] * pull[2]
        if total >= least:
            break
        best, least = pose, total
        step = _solve(precision * H + information, precision * g + pull)
        pose = pose - step
        if max(abs(step[0]), abs(step[1]), abs(step[2])) < ENOUGH:
            break
    return best


def refine(
    prior: SE2,
    covariance: NDArray[np.float64],
    points: NDArray[np.float64],
    field: LikelihoodField,
    sigma: float,
    trust: float,
) -> SE2:
    """The pose of highest posterior near `prior`; the prior itself where nothing better is found.

    points: beam ends (m, 2), metres, base frame. trust: how much one beam counts (see tempering).
    """
    frame = (field.origin_x, field.origin_y, 1.0 / field.grid.resolution)
    information = np.linalg.inv(covariance + np.diag([1e-6, 1e-6, 1e-6]))
    precision = trust / sigma**2
    x, y, yaw = _gauss_newton(prior.array(), information, points, field.distance, frame, sigma, precision)
    return SE2(float(x), float(y), wrap(float(yaw)))


def explained(pose: SE2, points: NDArray[np.float64], field: LikelihoodField, within: float) -> float:
    """Share of the beam ends (m, 2), base frame, that lie within so many metres of something mapped; 0 for
    none."""
    if points.shape[0] == 0:
        return 0.0
    seen = pose.apply(points)
    rows = np.floor((seen[:, 1] - field.origin_y) / field.grid.resolution).astype(np.int64)
    cols = np.floor((seen[:, 0] - field.origin_x) / field.grid.resolution).astype(np.int64)
    height, width = field.distance.shape
    distances = field.distance[np.clip(rows, 0, height - 1), np.clip(cols, 0, width - 1)]
    return float(np.mean(distances <= within))
