"""The motion of two driven wheels on a floor that may slope, and its linearisation.

State (18,): position in odom, m; attitude as roll, pitch, yaw (REP-103: turn about z, then y, then x), rad;
travel and turn of the axle since the last reading of the wheels, turn since the last one of the gyro; then
constants that are unknown: shares by which the robot differs from its file, share by which the gyro's
sensitivity is off, offsets of gyro (rad/s) and accelerometer (m/s^2). The turns are about the robot's own
vertical. The last step is part of the state so that a gyro can correct step, pose and shares at once, and so
that the twist gets a covariance.

With the travel of the rims d_l, d_r the axle's middle goes s = (d_l + d_r) / 2 along an arc of angle
a = (d_r - d_l) / l about the instantaneous centre of curvature, R = l / 2 (d_l + d_r) / (d_r - d_l) to the
left (Dudek & Jenkin 2010, 3.1.5). The chord 2 R sin(a / 2) = s sin(a / 2) / (a / 2) is exact and needs no R,
which is infinite on a straight line. The arc lies in the plane of the wheels, which the attitude tilts.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

X, Y, Z, ROLL, PITCH, YAW, STEP, TURN, SWING = range(9)
LEFT, RIGHT, SEPARATION, GAIN, BIAS_X, BIAS_Y, BIAS_Z, FORCE_X, FORCE_Y = range(9, 18)
SIZE = 18
INPUTS = 6
"""Travel of left and right rim; angles about x and y; slides to the left and up: what has noise in a step."""
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
def _wheels(state: Array, rims: Array, separation: float, by_state: Array, by_input: Array) -> Array:
    """(step, turn); into by_state (2, n), by_input (2, 6) their derivatives by state and inputs."""
    base = separation * (1.0 + state[SEPARATION])
    left, right = rims[0] * (1.0 + state[LEFT]), rims[1] * (1.0 + state[RIGHT])
    turn = (right - left) / base
    by_state[0, LEFT], by_state[0, RIGHT] = 0.5 * rims[0], 0.5 * rims[1]
    by_state[1, LEFT], by_state[1, RIGHT] = -rims[0] / base, rims[1] / base
    by_state[1, SEPARATION] = -turn / (1.0 + state[SEPARATION])
    by_input[0, 0], by_input[0, 1] = 0.5 * (1.0 + state[LEFT]), 0.5 * (1.0 + state[RIGHT])
    by_input[1, 0], by_input[1, 1] = -(1.0 + state[LEFT]) / base, (1.0 + state[RIGHT]) / base
    return np.array([0.5 * (left + right), turn])


@njit(cache=True, nogil=True)
def _axes(roll: float, pitch: float, yaw: float) -> Array:
    """(3, 3): the robot's axes x, y, z in odom, as columns."""
    cr, sr, cp, sp, cy, sy = (
        math.cos(roll),
        math.sin(roll),
        math.cos(pitch),
        math.sin(pitch),
        math.cos(yaw),
        math.sin(yaw),
    )
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


@njit(cache=True, nogil=True)
def _move(state: Array, moved: Array, step: float, turn: float, F: Array, by_step: Array, G: Array) -> None:
    """Position after the arc into `moved`; derivatives by attitude into F, by step and turn into by_step."""
    roll, pitch, yaw = state[ROLL], state[PITCH], state[YAW]
    axes = _axes(roll, pitch, yaw)
    forward, aside = arc(step, turn)
    half = 0.5 * turn
    c, s, along, bend = math.cos(half), math.sin(half), sinc(half), 0.5 * step * sinc_slope(half)
    cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    for i in range(3):
        moved[X + i] = state[X + i] + axes[i, 0] * forward + axes[i, 1] * aside
        by_step[X + i, 0] = along * (axes[i, 0] * c + axes[i, 1] * s)
        by_forward, by_aside = bend * c - 0.5 * step * along * s, bend * s + 0.5 * step * along * c
        by_step[X + i, 1] = axes[i, 0] * by_forward + axes[i, 1] * by_aside
        F[X + i, ROLL] = axes[i, 2] * aside  # the y axis turns towards z
        G[X + i, 4], G[X + i, 5] = axes[i, 1], axes[i, 2]
    sr = math.sin(roll)
    F[X, PITCH] = cy * (-sp * forward + cp * sr * aside)
    F[Y, PITCH] = sy * (-sp * forward + cp * sr * aside)
    F[Z, PITCH] = -cp * forward - sp * sr * aside
    F[X, YAW], F[Y, YAW] = state[Y] - moved[Y], moved[X] - state[X]


@njit(cache=True, nogil=True)
def _tilt(state: Array, moved: Array, rates: Array, turn: float, F: Array, by_step: Array, G: Array) -> None:
    """Attitude after the angles (2,) about x and y and `turn` about z (Titterton & Weston 2004, 3.6.2)."""
    roll, pitch = state[ROLL], state[PITCH]
    c, s, t, n = math.cos(roll), math.sin(roll), math.tan(pitch), 1.0 / math.cos(pitch)
    about, dip = rates[1] * s + turn * c, rates[1] * c - turn * s
    moved[ROLL] = roll + rates[0] + about * t
    moved[PITCH] = pitch + dip
    moved[YAW] = state[YAW] + about * n
    F[ROLL, ROLL], F[ROLL, PITCH] = 1.0 + dip * t, about * n * n
    F[PITCH, ROLL] = -about
    F[YAW, ROLL], F[YAW, PITCH] = dip * n, about * t * n
    by_step[ROLL, 1], by_step[PITCH, 1], by_step[YAW, 1] = c * t, -s, c * n
    G[ROLL, 2], G[ROLL, 3], G[PITCH, 3], G[YAW, 3] = 1.0, s * t, c, s * n


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
        for k in range(inner):
            for j in range(rows):
                if matrix[j, k] != 0.0:
                    out[i, j] += half[i, k] * matrix[j, k]


@njit(cache=True, nogil=True)
def _linearise(
    state: Array, rims: Array, angles: Array, seconds: float, separation: float
) -> tuple[Array, Array, Array]:
    """The state after a step, and its derivatives F (n, n) by the state before and G (n, 6) by the inputs."""
    n = state.size
    F, G, moved = np.eye(n), np.zeros((n, INPUTS)), state.copy()
    by_state, by_input, by_step = np.zeros((2, n)), np.zeros((2, INPUTS)), np.zeros((n, 2))
    step, turn = _wheels(state, rims, separation, by_state, by_input)
    rates = angles.copy()
    rates[0] -= state[BIAS_X] * seconds
    rates[1] -= state[BIAS_Y] * seconds
    _move(state, moved, step, turn, F, by_step, G)
    _tilt(state, moved, rates, turn, F, by_step, G)
    moved[STEP], moved[TURN], moved[SWING] = state[STEP] + step, state[TURN] + turn, state[SWING] + turn
    by_step[STEP, 0], by_step[TURN, 1], by_step[SWING, 1] = 1.0, 1.0, 1.0
    for i in range(SWING + 1):
        for k in range(2):
            for j in range(LEFT, SEPARATION + 1):
                F[i, j] += by_step[i, k] * by_state[k, j]
            for j in range(2):
                G[i, j] += by_step[i, k] * by_input[k, j]
        F[i, BIAS_X] -= G[i, 2] * seconds
        F[i, BIAS_Y] -= G[i, 3] * seconds
    return moved, F, G


@njit(cache=True, nogil=True)
def predict(
    state: Array,
    covariance: Array,
    rims: Array,
    angles: Array,
    seconds: float,
    noise: Array,
    separation: float,
    settling: float,
    slope: float,
) -> tuple[Array, Array]:
    """State (n,) and covariance (n, n) after a step.

    rims (2,): travel of left and right, m. angles (2,): by the gyro about x and y over `seconds`, rad; offsets
    are taken off, so `seconds` is 0 when there was no gyro. noise (6, 6): covariance of the inputs.
    Without a gyro the tilt follows the floor: it returns to level by the share `settling` of the step, and
    wanders so that its standard deviation stays `slope`, rad. First-order propagation (Thrun, Burgard & Fox
    2005, 3.3); shares keep their error, so that a wrong diameter makes the pose's error grow with the
    distance and not only with its root.
    """
    moved, F, G = _linearise(state, rims, angles, seconds, separation)
    for i in (ROLL, PITCH):
        moved[i] *= 1.0 - settling
        F[i] *= 1.0 - settling
        G[i] *= 1.0 - settling
    spread = np.zeros((state.size, state.size))
    _spread(F, covariance, spread)
    _spread(G, noise, spread)
    for i in (ROLL, PITCH):
        spread[i, i] += slope * slope * settling * (2.0 - settling)
    for i in range(state.size):
        for j in range(i):
            spread[i, j] = spread[j, i] = 0.5 * (spread[i, j] + spread[j, i])
    return moved, spread
