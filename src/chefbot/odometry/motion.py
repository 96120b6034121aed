"""The motion model of two driven wheels and its linearisation.

State (n,), n >= 8: pose in odom; then the last step itself; then the shares by which the robot differs from
its file, constant over a run but unknown; more may follow. The step is part of the state so that a gyro can
correct step, pose and shares at once, and so that the twist gets a covariance.

With the travel of the rims d_l, d_r the axle's middle goes s = (d_l + d_r) / 2 along an arc of angle
a = (d_r - d_l) / l about the instantaneous centre of curvature, R = l / 2 (d_l + d_r) / (d_r - d_l) to the
left (Dudek & Jenkin 2010, 3.1.5). The chord 2 R sin(a / 2) = s sin(a / 2) / (a / 2) is exact and needs no R,
which is infinite on a straight line.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

X, Y, YAW, STEP, TURN, LEFT, RIGHT, SEPARATION = range(8)
Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def sinc(u: float) -> float:
    """sin(u) / u."""
    return 1.0 - u * u / 6.0 if abs(u) < 1e-4 else math.sin(u) / u


@njit(cache=True, nogil=True)
def sinc_slope(u: float) -> float:
    """Derivative of `sinc`; by series where the difference below would lose its digits."""
    return -u / 3.0 + u * u * u / 30.0 if abs(u) < 1e-2 else (math.cos(u) - math.sin(u) / u) / u


@njit(cache=True, nogil=True)
def arc(step: float, turn: float) -> tuple[float, float]:
    """(forward, left) reached by `step` metres on an arc that turns by `turn` radians."""
    chord = step * sinc(0.5 * turn)
    return chord * math.cos(0.5 * turn), chord * math.sin(0.5 * turn)


@njit(cache=True, nogil=True)
def _step_jacobians(
    state: Array, left: float, right: float, separation: float, by_state: Array, by_rims: Array
) -> tuple[float, float]:
    """(step, turn); into by_state (2, n), by_rims (2, 2) their derivatives by state and travel of the rims."""
    base = separation * (1.0 + state[SEPARATION])
    d_left, d_right = left * (1.0 + state[LEFT]), right * (1.0 + state[RIGHT])
    step, turn = 0.5 * (d_left + d_right), (d_right - d_left) / base
    by_state[:] = 0.0
    by_state[0, LEFT], by_state[0, RIGHT] = 0.5 * left, 0.5 * right
    by_state[1, LEFT], by_state[1, RIGHT] = -left / base, right / base
    by_state[1, SEPARATION] = -turn / (1.0 + state[SEPARATION])
    by_rims[0, 0], by_rims[0, 1] = 0.5, 0.5
    by_rims[1, 0], by_rims[1, 1] = -1.0 / base, 1.0 / base
    return step, turn


@njit(cache=True, nogil=True)
def _pose_by_step(yaw: float, step: float, turn: float, out: Array) -> None:
    """Into out (3, 2) the derivative of the pose reached by step and turn."""
    half = 0.5 * turn
    c, s = math.cos(yaw + half), math.sin(yaw + half)
    along, bend = sinc(half), 0.5 * step * sinc_slope(half)
    across = 0.5 * step * along
    out[0, 0], out[0, 1] = along * c, bend * c - across * s
    out[1, 0], out[1, 1] = along * s, bend * s + across * c
    out[2, 0], out[2, 1] = 0.0, 1.0


@njit(cache=True, nogil=True)
def _chain(outer: Array, inner: Array, out: Array) -> None:
    """Derivative of pose and step by what `inner` (2, m) derives the step by, added to out (5, m)."""
    for j in range(inner.shape[1]):
        for i in range(3):
            out[i, j] += outer[i, 0] * inner[0, j] + outer[i, 1] * inner[1, j]
        out[STEP, j], out[TURN, j] = inner[0, j], inner[1, j]


@njit(cache=True, nogil=True)
def _spread(matrix: Array, covariance: Array, out: Array) -> None:
    """Add `matrix @ covariance @ matrix.T` to out (n, n); loops compile in a tenth of the time of `@`."""
    rows, inner = matrix.shape
    half = np.zeros((rows, inner))
    for i in range(rows):
        for k in range(inner):
            if matrix[i, k] != 0.0:
                for j in range(inner):
                    half[i, j] += matrix[i, k] * covariance[k, j]
    for i in range(rows):
        for j in range(rows):
            for k in range(inner):
                out[i, j] += half[i, k] * matrix[j, k]


@njit(cache=True, nogil=True)
def predict(
    state: Array, covariance: Array, left: float, right: float, variance: Array, separation: float
) -> tuple[Array, Array]:
    """State (n,) and covariance (n, n) after the rims travelled `left`, `right` with `variance` (2,).

    First-order propagation (Thrun, Burgard & Fox 2005, 3.3); shares keep their error, so that a wrong
    diameter makes the pose's error grow with the distance and not only with its root.
    """
    n = state.size
    by_state, by_rims, by_step = np.empty((2, n)), np.empty((2, 2)), np.empty((3, 2))
    step, turn = _step_jacobians(state, left, right, separation, by_state, by_rims)
    forward, aside = arc(step, turn)
    c, s = math.cos(state[YAW]), math.sin(state[YAW])
    dx, dy = c * forward - s * aside, s * forward + c * aside
    moved = state.copy()
    moved[X], moved[Y], moved[YAW] = state[X] + dx, state[Y] + dy, state[YAW] + turn
    moved[STEP], moved[TURN] = step, turn
    _pose_by_step(state[YAW], step, turn, by_step)
    F, G, rims = np.zeros((n, n)), np.zeros((n, 2)), np.zeros((2, 2))
    for i in range(n):
        F[i, i] = 1.0
    F[X, YAW], F[Y, YAW] = -dy, dx
    _chain(by_step, by_state, F)
    _chain(by_step, by_rims, G)
    rims[0, 0], rims[1, 1] = variance[0], variance[1]
    spread = np.zeros((n, n))
    _spread(F, covariance, spread)
    _spread(G, rims, spread)
    return moved, spread
