"""The measurement update of the Kalman filter and the chi-square gate on the innovation."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.odometry.motion_model import SIZE, Array

Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]
ALL: Flags = np.ones(SIZE, np.bool_)
"""Mask of an ordinary update: every element of the state is estimated."""

CHI2_GATE = 25.0
"""Largest squared Mahalanobis distance of an innovation that is accepted: five standard deviations."""


@njit(cache=True, nogil=True, error_model="numpy")
def cholesky(matrix: Array) -> Array:
    """Return the Cholesky factor L (m, m) with L L^T = matrix (Golub & Van Loan 2013, 4.2.3).

    The result has elements that are not finite if the matrix is not positive definite.
    """
    m = matrix.shape[0]
    lower = np.zeros((m, m))
    for j in range(m):
        for i in range(j, m):
            remainder = matrix[i, j]
            for k in range(j):
                remainder -= lower[i, k] * lower[j, k]
            lower[i, j] = np.sqrt(remainder) if i == j else remainder / lower[j, j]
    return lower


@njit(cache=True, nogil=True, error_model="numpy")
def whiten(lower: Array, values: Array) -> Array:
    """Return L^-1 values (m, k) by forward substitution."""
    out = values.copy()
    for j in range(values.shape[1]):
        for i in range(values.shape[0]):
            for k in range(i):
                out[i, j] -= lower[i, k] * out[k, j]
            out[i, j] /= lower[i, i]
    return out


@njit(cache=True, nogil=True)
def innovation_covariance(covariance: Array, H: Array, noise: Array) -> tuple[Array, Array]:
    """Return H P (m, n) and the innovation covariance S = H P H^T + R (m, m)."""
    m, n = H.shape
    # H P, skipping the zeros of H
    HP, S = np.zeros((m, n)), noise.copy()
    for i in range(m):
        for k in range(n):
            if H[i, k] != 0.0:
                for j in range(n):
                    HP[i, j] += H[i, k] * covariance[k, j]
    # S = (H P) H^T + R
    for i in range(m):
        for j in range(m):
            for k in range(n):
                if H[j, k] != 0.0:
                    S[i, j] += HP[i, k] * H[j, k]
    return HP, S


@njit(cache=True, nogil=True)
def distance(covariance: Array, innovation: Array, H: Array, noise: Array) -> tuple[float, Array]:
    """Return the squared Mahalanobis distance of an innovation (m,), and its covariance S (m, m)."""
    # d^2 = y^T S^-1 y = |L^-1 y|^2 with S = L L^T
    _, S = innovation_covariance(covariance, H, noise)
    whitened = whiten(cholesky(S), innovation.reshape(-1, 1))
    return float(np.sum(whitened * whitened)), S


@njit(cache=True, nogil=True)
def correct(
    state: Array, covariance: Array, innovation: Array, H: Array, noise: Array, estimated: Flags
) -> tuple[Array, Array]:
    """Return state (n,) and covariance (n, n) after the measurement update with `innovation` (m,).

    H (m, n): Jacobian of the measurement. noise: R (m, m), positive definite. estimated (n,): mask of the
    elements that are estimated; the others are consider states, whose rows of the gain are zero (Schmidt
    1966, "Application of state-space methods to navigation problems"). With S = L L^T and W = L^-1 H P the
    gain is K = W^T L^-1 and the covariance decreases by W^T W where one of the two elements is estimated,
    which is exactly symmetric (Thrun, Burgard & Fox 2005, table 3.3, in square-root form).
    """
    # S = H P H^T + R = L L^T, W = L^-1 H P, whitened innovation L^-1 y
    HP, S = innovation_covariance(covariance, H, noise)
    lower = cholesky(S)
    W, whitened = whiten(lower, HP), whiten(lower, innovation.reshape(-1, 1))
    corrected, corrected_covariance = state.copy(), covariance.copy()
    # x += K y = W^T (L^-1 y) and P -= W^T W, row by row of W
    for k in range(H.shape[0]):
        for i in range(state.size):
            if estimated[i]:
                corrected[i] += W[k, i] * whitened[k, 0]
            for j in range(state.size):
                if estimated[i] or estimated[j]:
                    corrected_covariance[i, j] -= W[k, i] * W[k, j]
    return corrected, corrected_covariance


@njit(cache=True, nogil=True)
def forget(state: Array, covariance: Array, i: int) -> tuple[Array, Array]:
    """Return state and covariance with element `i` reset to an exactly known zero."""
    reset_state, reset_covariance = state.copy(), covariance.copy()
    # Zero mean, zero variance, no correlation
    reset_state[i] = 0.0
    reset_covariance[i, :] = 0.0
    reset_covariance[:, i] = 0.0
    return reset_state, reset_covariance
