"""Linearized least squares of a pose graph: residuals, normal equations, and their sparse solution."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu

from chefbot.slam.graph.edges import Edges

Array = NDArray[np.float64]
_MIN_DIAGONAL = 1e-9
"""Keeps a pose that no edge holds where it is."""


def edge_costs(poses: Array, edges: Edges) -> Array:
    """Return the robust cost (m,) of each edge, half the squared Mahalanobis distance where no kernel acts."""
    return _costs(poses, edges.of, edges.to, edges.measured, edges.information, edges.kernel)


def squared_distances(poses: Array, edges: Edges) -> Array:
    """Return the squared Mahalanobis distances (m,) of the edges' errors."""
    none = np.full(len(edges), np.inf)
    return 2.0 * _costs(poses, edges.of, edges.to, edges.measured, edges.information, none)


def linearized(poses: Array, edges: Edges) -> tuple[csc_matrix, Array]:
    """Return the Hessian approximation (3n, 3n) and the gradient (3n,)."""
    rows, columns, values, gradient = _linearize(
        poses, edges.of, edges.to, edges.measured, edges.information, edges.kernel
    )
    size = 3 * len(poses)
    return csc_matrix((values, (rows, columns)), shape=(size, size)), gradient


def solved(hessian: csc_matrix, gradient: Array, damping: float) -> Array:
    """Return the step (n, 3) that minimizes the damped quadratic; the first pose does not move."""
    free = hessian[3:, 3:]
    index = np.arange(free.shape[0])
    damped = free + csc_matrix((damping * free.diagonal() + _MIN_DIAGONAL, (index, index)))
    step = np.zeros(len(gradient))
    step[3:] = factorized(damped).solve(-gradient[3:])
    return step.reshape(-1, 3)


def factorized(matrix: csc_matrix) -> SuperLU:
    """Return the sparse factorization of a symmetric positive definite matrix, ordered by minimum degree."""
    return splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def inverse(matrices: Array) -> Array:
    """Return the inverse of a matrix (3, 3), or of each of (m, 3, 3)."""
    return np.asarray(np.linalg.inv(matrices), np.float64)


@njit(cache=True, nogil=True)
def _error(a, b, z):  # type: ignore[no-untyped-def]
    """Return the error of a measurement z of pose b in the frame of pose a, in the axes of a."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    c, s = math.cos(a[2]), math.sin(a[2])
    turn = b[2] - a[2] - z[2]
    turn -= 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
    return c * dx + s * dy - z[0], c * dy - s * dx - z[1], turn


@njit(cache=True, nogil=True)
def _costs(poses, of, to, measured, information, kernel):  # type: ignore[no-untyped-def]
    costs = np.empty(len(of))
    e = np.empty(3)
    for m in range(len(of)):
        e[0], e[1], e[2] = _error(poses[of[m]], poses[to[m]], measured[m])
        distance = 0.0
        for a in range(3):
            for b in range(3):
                distance += e[a] * information[m, a, b] * e[b]
        # Geman-McClure: saturates at the kernel's width
        costs[m] = 0.5 * distance
        if kernel[m] < np.inf:
            costs[m] = 0.5 * distance * kernel[m] / (kernel[m] + distance)
    return costs


@njit(cache=True, nogil=True)
def _linearize(poses, of, to, measured, information, kernel):  # type: ignore[no-untyped-def]
    """Return rows, columns and values of the Hessian's blocks (36 an edge) and the gradient."""
    rows, columns = np.empty(36 * len(of), np.int64), np.empty(36 * len(of), np.int64)
    values, gradient = np.empty(36 * len(of)), np.zeros(3 * len(poses))
    e, j, w = np.empty(3), np.zeros((3, 6)), np.empty((3, 6))
    k = 0
    for m in range(len(of)):
        a, b, z, omega = poses[of[m]], poses[to[m]], measured[m], information[m]
        e[0], e[1], e[2] = _error(a, b, z)
        # Jacobian of the error by both poses
        c, s = math.cos(a[2]), math.sin(a[2])
        dx, dy = b[0] - a[0], b[1] - a[1]
        j[0, 0], j[0, 1], j[0, 2] = -c, -s, -s * dx + c * dy
        j[1, 0], j[1, 1], j[1, 2] = s, -c, -c * dx - s * dy
        j[2, 2] = -1.0
        j[0, 3], j[0, 4], j[1, 3], j[1, 4], j[2, 5] = c, s, -s, c, 1.0
        # Weight of the robust kernel
        distance = 0.0
        for p in range(3):
            for q in range(3):
                distance += e[p] * omega[p, q] * e[q]
        weight = 1.0
        if kernel[m] < np.inf:
            weight = (kernel[m] / (kernel[m] + distance)) ** 2
        for p in range(3):
            for q in range(6):
                w[p, q] = weight * (omega[p, 0] * j[0, q] + omega[p, 1] * j[1, q] + omega[p, 2] * j[2, q])
        for p in range(6):
            row = 3 * (of[m] if p < 3 else to[m]) + p % 3
            gradient[row] += w[0, p] * e[0] + w[1, p] * e[1] + w[2, p] * e[2]
            for q in range(6):
                rows[k] = row
                columns[k] = 3 * (of[m] if q < 3 else to[m]) + q % 3
                values[k] = w[0, p] * j[0, q] + w[1, p] * j[1, q] + w[2, p] * j[2, q]
                k += 1
    return rows, columns, values, gradient
