"""The measurement update of the Kalman filter, and the test whether a reading can be believed."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.odometry.motion_model import SIZE, Array

Flags = NDArray[np.bool_]
ALL: Flags = np.ones(SIZE, np.bool_)
"""Every element of the state may change."""

GATE = 25.0
"""Squared standard deviations from what is expected that chance explains: five of them."""


@njit(cache=True, nogil=True, error_model="numpy")
def cholesky(matrix: Array) -> Array:
    """Lower triangle L (m, m) with L L^T = matrix, positive definite (Golub & Van Loan 2013, 4.2.3).

    Of a matrix that is not, what follows is not finite.
    """
    m = matrix.shape[0]
    lower = np.zeros((m, m))
    for j in range(m):
        for i in range(j, m):
            rest = matrix[i, j]
            for k in range(j):
                rest -= lower[i, k] * lower[j, k]
            lower[i, j] = np.sqrt(rest) if i == j else rest / lower[j, j]
    return lower


@njit(cache=True, nogil=True, error_model="numpy")
def whiten(lower: Array, values: Array) -> Array:
    """L^-1 values (m, k), by substitution."""
    out = values.copy()
    for j in range(values.shape[1]):
        for i in range(values.shape[0]):
            for k in range(i):
                out[i, j] -= lower[i, k] * out[k, j]
            out[i, j] /= lower[i, i]
    return out


@njit(cache=True, nogil=True)
def _expected(covariance: Array, H: Array, noise: Array) -> tuple[Array, Array]:
    """H P (m, n) and the covariance of the innovation S = H P H^T + R (m, m)."""
    m, n = H.shape
    spread, total = np.zeros((m, n)), noise.copy()
    for i in range(m):
        for k in range(n):
            if H[i, k] != 0.0:
                for j in range(n):
                    spread[i, j] += H[i, k] * covariance[k, j]
    for i in range(m):
        for j in range(m):
            for k in range(n):
                if H[j, k] != 0.0:
                    total[i, j] += spread[i, k] * H[j, k]
    return spread, total


@njit(cache=True, nogil=True)
def distance(covariance: Array, error: Array, H: Array, noise: Array) -> tuple[float, Array]:
    """Squared Mahalanobis distance of the innovation `error` (m,), and its covariance S (m, m)."""
    _, total = _expected(covariance, H, noise)
    white = whiten(cholesky(total), error.reshape(-1, 1))
    return float(np.sum(white * white)), total


@njit(cache=True, nogil=True)
def correct(
    state: Array, covariance: Array, error: Array, H: Array, noise: Array, open_: Flags
) -> tuple[Array, Array]:
    """State and covariance after a reading that is `error` (m,) off what H (m, n) linearises.

    noise: R (m, m), positive definite. open_ (n,): which elements may change; the others are only considered,
    which is the update with their rows of the gain zero (Schmidt 1966, "Application of state-space methods to
    navigation problems"). With S = L L^T and W = L^-1 H P the gain is W^T L^-1 and the covariance falls by
    W^T W where one of the two elements is open, which is symmetric to the last bit (Thrun, Burgard & Fox 2005,
    table 3.3, in square-root form).
    """
    spread, total = _expected(covariance, H, noise)
    lower = cholesky(total)
    W, white = whiten(lower, spread), whiten(lower, error.reshape(-1, 1))
    corrected, certain = state.copy(), covariance.copy()
    for k in range(H.shape[0]):
        for i in range(state.size):
            if open_[i]:
                corrected[i] += W[k, i] * white[k, 0]
            for j in range(state.size):
                if open_[i] or open_[j]:
                    certain[i, j] -= W[k, i] * W[k, j]
    return corrected, certain


@njit(cache=True, nogil=True)
def forget(state: Array, covariance: Array, i: int) -> tuple[Array, Array]:
    """State and covariance where element `i` begins anew at an exact zero."""
    fresh, rest = state.copy(), covariance.copy()
    fresh[i] = 0.0
    rest[i, :] = 0.0
    rest[:, i] = 0.0
    return fresh, rest
