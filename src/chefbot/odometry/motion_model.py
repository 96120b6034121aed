"""The motion model of a differential drive on a floor that may slope, and its Jacobians.

State (18,): position in odom, m; attitude as roll, pitch, yaw (REP-103: rotation about z, then y, then x),
rad; arc length and yaw increment of the axle since the last wheel reading, yaw increment since the last gyro
reading; then unknown constants: relative errors of left wheel, right wheel and separation against the robot
file, relative error of the gyro scale, biases of gyro (rad/s) and accelerometer (m/s^2). The yaw increments
are about the robot's own z axis. The increments are part of the state so that a gyro reading corrects
increments, pose and wheel errors at once, and so that the twist gets a covariance.

With wheel travels d_l, d_r the axle midpoint moves s = (d_l + d_r) / 2 along an arc of angle
a = (d_r - d_l) / l about the instantaneous centre of curvature, R = l / 2 (d_l + d_r) / (d_r - d_l) to the
left (Dudek & Jenkin 2010, 3.1.5). The chord 2 R sin(a / 2) = s sin(a / 2) / (a / 2) is exact and needs no R,
which is infinite on a straight line. The arc lies in the plane of the wheels, which the attitude tilts.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

X, Y, Z, ROLL, PITCH, YAW, DELTA_S, DELTA_YAW, DELTA_YAW_GYRO = range(9)
LEFT, RIGHT, SEPARATION, GYRO_SCALE, GYRO_BIAS_X, GYRO_BIAS_Y, GYRO_BIAS_Z, ACCEL_BIAS_X, ACCEL_BIAS_Y = (
    range(9, 18)
)
SIZE = 18
INPUTS = 6
"""Noisy inputs of a step: travel of left and right wheel, rotations about x and y, slides to the left and
up."""
Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def sinc(u: float) -> float:
    """Return sin(u) / u, continuous at zero."""
    return 1.0 - u * u / 6.0 if abs(u) < 1e-4 else math.sin(u) / u


@njit(cache=True, nogil=True)
def sinc_slope(u: float) -> float:
    """Return the derivative of `sinc`, by a series near zero where the closed form cancels."""
    return -u / 3.0 + u * u * u / 30.0 if abs(u) < 1e-2 else (math.cos(u) - math.sin(u) / u) / u


@njit(cache=True, nogil=True)
def arc(step: float, turn: float) -> tuple[float, float]:
    """Return (forward, left), m, reached by `step` metres along an arc that turns by `turn` radians."""
    # Chord of the arc, at half the turn to the left of the start heading
    chord = step * sinc(0.5 * turn)
    return chord * math.cos(0.5 * turn), chord * math.sin(0.5 * turn)


@njit(cache=True, nogil=True)
def _wheel_increments(
    state: Array, travel: Array, separation: float, by_state: Array, by_input: Array
) -> Array:
    """Return (delta_s, delta_yaw); fill their Jacobians by state (2, n) and by inputs (2, 6)."""
    # Corrected geometry: a = (d_r (1 + e_r) - d_l (1 + e_l)) / (l (1 + e_sep))
    base = separation * (1.0 + state[SEPARATION])
    left, right = travel[0] * (1.0 + state[LEFT]), travel[1] * (1.0 + state[RIGHT])
    turn = (right - left) / base
    # Jacobian by the wheel and separation errors
    by_state[0, LEFT], by_state[0, RIGHT] = 0.5 * travel[0], 0.5 * travel[1]
    by_state[1, LEFT], by_state[1, RIGHT] = -travel[0] / base, travel[1] / base
    by_state[1, SEPARATION] = -turn / (1.0 + state[SEPARATION])
    # Jacobian by the wheel travels
    by_input[0, 0], by_input[0, 1] = 0.5 * (1.0 + state[LEFT]), 0.5 * (1.0 + state[RIGHT])
    by_input[1, 0], by_input[1, 1] = -(1.0 + state[LEFT]) / base, (1.0 + state[RIGHT]) / base
    return np.array([0.5 * (left + right), turn])


@njit(cache=True, nogil=True)
def _rotation_matrix(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation matrix R_z(yaw) R_y(pitch) R_x(roll) (3, 3), base_link to odom."""
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
def _integrate_position(
    state: Array, predicted: Array, step: float, turn: float, F: Array, by_increment: Array, G: Array
) -> None:
    """Fill the position after the arc, its Jacobian by attitude (F), by increments and by slides (G)."""
    # Arc in the plane of the wheels, rotated into odom: p' = p + R (forward, left, 0)
    roll, pitch, yaw = state[ROLL], state[PITCH], state[YAW]
    R = _rotation_matrix(roll, pitch, yaw)
    forward, lateral = arc(step, turn)
    half = 0.5 * turn
    c, s, chord_ratio, chord_slope = math.cos(half), math.sin(half), sinc(half), 0.5 * step * sinc_slope(half)
    cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    for i in range(3):
        predicted[X + i] = state[X + i] + R[i, 0] * forward + R[i, 1] * lateral
        # Jacobian by arc length and yaw increment
        by_increment[X + i, 0] = chord_ratio * (R[i, 0] * c + R[i, 1] * s)
        by_forward, by_lateral = (
            chord_slope * c - 0.5 * step * chord_ratio * s,
            chord_slope * s + 0.5 * step * chord_ratio * c,
        )
        by_increment[X + i, 1] = R[i, 0] * by_forward + R[i, 1] * by_lateral
        # Jacobian by roll, and by slides along the robot's y and z axes
        F[X + i, ROLL] = R[i, 2] * lateral  # the y axis turns towards z
        G[X + i, 4], G[X + i, 5] = R[i, 1], R[i, 2]
    # Jacobian by pitch and yaw
    sr = math.sin(roll)
    F[X, PITCH] = cy * (-sp * forward + cp * sr * lateral)
    F[Y, PITCH] = sy * (-sp * forward + cp * sr * lateral)
    F[Z, PITCH] = -cp * forward - sp * sr * lateral
    F[X, YAW], F[Y, YAW] = state[Y] - predicted[Y], predicted[X] - state[X]


@njit(cache=True, nogil=True)
def _integrate_attitude(
    state: Array, predicted: Array, rotation: Array, turn: float, F: Array, by_increment: Array, G: Array
) -> None:
    """Fill the attitude after rotations (2,) about x and y and `turn` about z (Titterton & Weston 2004,
    3.6.2)."""
    # Euler angle rates from body rates
    roll, pitch = state[ROLL], state[PITCH]
    c, s, t, n = math.cos(roll), math.sin(roll), math.tan(pitch), 1.0 / math.cos(pitch)
    yaw_component, pitch_change = rotation[1] * s + turn * c, rotation[1] * c - turn * s
    predicted[ROLL] = roll + rotation[0] + yaw_component * t
    predicted[PITCH] = pitch + pitch_change
    predicted[YAW] = state[YAW] + yaw_component * n
    # Jacobians by attitude, by yaw increment and by the rotations about x and y
    F[ROLL, ROLL], F[ROLL, PITCH] = 1.0 + pitch_change * t, yaw_component * n * n
    F[PITCH, ROLL] = -yaw_component
    F[YAW, ROLL], F[YAW, PITCH] = pitch_change * n, yaw_component * t * n
    by_increment[ROLL, 1], by_increment[PITCH, 1], by_increment[YAW, 1] = c * t, -s, c * n
    G[ROLL, 2], G[ROLL, 3], G[PITCH, 3], G[YAW, 3] = 1.0, s * t, c, s * n


@njit(cache=True, nogil=True)
def _add_congruence(matrix: Array, covariance: Array, out: Array) -> None:
    """Add the transpose of `matrix @ covariance @ matrix.T` to out (n, n), skipping the zeros of the matrix.

    Loops, unlike `@`, add in the same order on every processor. The rows of the results are contiguous.
    """
    rows, inner = matrix.shape
    product = np.zeros((rows, inner))
    # A P
    for i in range(rows):
        for k in range(inner):
            if matrix[i, k] != 0.0:
                for j in range(inner):
                    product[i, j] += matrix[i, k] * covariance[k, j]
    # ((A P) A^T)^T = A (A P)^T
    transposed = product.T.copy()
    for j in range(rows):
        for k in range(inner):
            if matrix[j, k] != 0.0:
                for i in range(rows):
                    out[j, i] += transposed[k, i] * matrix[j, k]


@njit(cache=True, nogil=True)
def _linearise(
    state: Array, travel: Array, angles: Array, seconds: float, separation: float
) -> tuple[Array, Array, Array]:
    """Return the state after a step, with Jacobians F (n, n) by the state before and G (n, 6) by the
    inputs."""
    n = state.size
    F, G, predicted = np.eye(n), np.zeros((n, INPUTS)), state.copy()
    by_state, by_input, by_increment = np.zeros((2, n)), np.zeros((2, INPUTS)), np.zeros((n, 2))
    # Arc length and yaw increment from the wheel travels
    step, turn = _wheel_increments(state, travel, separation, by_state, by_input)
    # Gyro rotations without bias
    rotation = angles.copy()
    rotation[0] -= state[GYRO_BIAS_X] * seconds
    rotation[1] -= state[GYRO_BIAS_Y] * seconds
    # Mean of position, attitude and accumulated increments
    _integrate_position(state, predicted, step, turn, F, by_increment, G)
    _integrate_attitude(state, predicted, rotation, turn, F, by_increment, G)
    predicted[DELTA_S], predicted[DELTA_YAW], predicted[DELTA_YAW_GYRO] = (
        state[DELTA_S] + step,
        state[DELTA_YAW] + turn,
        state[DELTA_YAW_GYRO] + turn,
    )
    by_increment[DELTA_S, 0], by_increment[DELTA_YAW, 1], by_increment[DELTA_YAW_GYRO, 1] = 1.0, 1.0, 1.0
    # Chain rule: through the increments to wheel errors and travels, and to the gyro biases
    for i in range(DELTA_YAW_GYRO + 1):
        for k in range(2):
            for j in range(LEFT, SEPARATION + 1):
                F[i, j] += by_increment[i, k] * by_state[k, j]
            for j in range(2):
                G[i, j] += by_increment[i, k] * by_input[k, j]
        F[i, GYRO_BIAS_X] -= G[i, 2] * seconds
        F[i, GYRO_BIAS_Y] -= G[i, 3] * seconds
    return predicted, F, G


@njit(cache=True, nogil=True)
def predict(
    state: Array,
    covariance: Array,
    travel: Array,
    angles: Array,
    seconds: float,
    noise: Array,
    separation: float,
    settling: float,
    slope: float,
) -> tuple[Array, Array]:
    """Propagate state (n,) and covariance (n, n) over one step: the prediction step of the EKF.

    travel (2,): travel of left and right wheel, m. angles (2,): rotations about x and y by the gyro over
    `seconds`, rad; their biases are subtracted, so `seconds` is 0 without a gyro. noise (6, 6): covariance of
    the inputs. Without a gyro the tilt follows the floor: a first-order Gauss-Markov process that decays to
    level by the fraction `settling` and keeps the standard deviation `slope`, rad. First-order propagation
    (Thrun, Burgard & Fox 2005, 3.3); relative errors are constants, so that a wrong diameter makes the pose
    error grow with the distance and not only with its square root.
    """
    # x' = f(x, u), F = df/dx, G = df/du
    predicted, F, G = _linearise(state, travel, angles, seconds, separation)
    # Gauss-Markov decay of roll and pitch to level
    for i in (ROLL, PITCH):
        predicted[i] *= 1.0 - settling
        F[i] *= 1.0 - settling
        G[i] *= 1.0 - settling
    # P' = F P F^T + G Q G^T
    predicted_covariance = np.zeros((state.size, state.size))
    _add_congruence(F, covariance, predicted_covariance)
    _add_congruence(G, noise, predicted_covariance)
    # Process noise that keeps the standard deviation of the tilt
    for i in (ROLL, PITCH):
        predicted_covariance[i, i] += slope * slope * settling * (2.0 - settling)
    # Symmetrise against rounding
    for i in range(state.size):
        for j in range(i):
            predicted_covariance[i, j] = predicted_covariance[j, i] = 0.5 * (
                predicted_covariance[i, j] + predicted_covariance[j, i]
            )
    return predicted, predicted_covariance
