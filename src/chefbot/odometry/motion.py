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
    return -u / 3.0 + u**3 / 30.0 if abs(u) < 1e-2 else (math.cos(u) - math.sin(u) / u) / u


@njit(cache=True, nogil=True)
def arc(step: float, turn: float) -> tuple[float, float]:
    """(forward, left) reached by `step` metres on an arc that turns by `turn` radians."""
    chord = step * sinc(0.5 * turn)
    return chord * math.cos(0.5 * turn), chord * math.sin(0.5 * turn)


@njit(cache=True, nogil=True)
def _step_jacobians(state: Array, left: float, right: float, separation: float) -> tuple[Array, Array, Array]:
    """The step (2,) and its derivatives by the state (2, n) and by the travel of the rims (2, 2)."""
    base = separation * (1.0 + state[SEPARATION])
    d_left, d_right = left * (1.0 + state[LEFT]), right * (1.0 + state[RIGHT])
    step = np.array([0.5 * (d_left + d_right), (d_right - d_left) / base])
    by_state = np.zeros((2, state.size))
    by_state[0, LEFT], by_state[0, RIGHT] = 0.5 * left, 0.5 * right
    by_state[1, LEFT], by_state[1, RIGHT] = -left / base, right / base
    by_state[1, SEPARATION] = -step[1] / (1.0 + state[SEPARATION])
    by_rims = np.array([[0.5, 0.5], [-1.0 / base, 1.0 / base]])
    return step, by_state, by_rims


@njit(cache=True, nogil=True)
def _pose_by_step(yaw: float, step: float, turn: float) -> Array:
    """Derivative (3, 2) of the pose reached by step and turn."""
    half = 0.5 * turn
    c, s = math.cos(yaw + half), math.sin(yaw + half)
    along, bend = sinc(half), 0.5 * step * sinc_slope(half)
    across = 0.5 * step * along
    return np.array([[along * c, bend * c - across * s], [along * s, bend * s + across * c], [0.0, 1.0]])


@njit(cache=True, nogil=True)
def predict(
    state: Array, covariance: Array, left: float, right: float, variance: Array, separation: float
) -> tuple[Array, Array]:
    """State (n,) and covariance (n, n) after the rims travelled `left`, `right` with `variance` (2,).

    First-order propagation (Thrun, Burgard & Fox 2005, 3.3); shares keep their error, so that a wrong
    diameter makes the pose's error grow with the distance and not only with its root.
    """
    step, by_state, by_rims = _step_jacobians(state, left, right, separation)
    forward, aside = arc(step[0], step[1])
    c, s = math.cos(state[YAW]), math.sin(state[YAW])
    dx, dy = c * forward - s * aside, s * forward + c * aside
    moved = state.copy()
    moved[X] += dx
    moved[Y] += dy
    moved[YAW] += step[1]
    moved[STEP : TURN + 1] = step
    by_step = _pose_by_step(state[YAW], step[0], step[1])
    F = np.eye(state.size)
    F[X, YAW], F[Y, YAW] = -dy, dx
    F[: YAW + 1] += by_step @ by_state
    F[STEP : TURN + 1] = by_state
    G = np.zeros((state.size, 2))
    G[: YAW + 1] = by_step @ by_rims
    G[STEP : TURN + 1] = by_rims
    return moved, F @ covariance @ F.T + (G * variance) @ G.T
