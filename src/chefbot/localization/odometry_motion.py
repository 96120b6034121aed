"""Odometry motion model (Thrun, Burgard, Fox: Probabilistic Robotics, 5.4, table 5.6)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.params import AmclParams
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

STANDING = 0.01
"""Metres: below this the direction of travel is noise, and the motion is taken as a turn on the spot."""


@njit(cache=True, nogil=True)
def _sample(
    particles: NDArray[np.float64],
    turn: float,
    travel: float,
    second_turn: float,
    spread: tuple[float, float, float],
    rng: np.random.Generator,
) -> None:
    two_pi = 2.0 * math.pi
    for i in range(particles.shape[0]):
        first = turn + spread[0] * rng.standard_normal()
        length = travel + spread[1] * rng.standard_normal()
        second = second_turn + spread[2] * rng.standard_normal()
        heading = particles[i, 2] + first
        particles[i, 0] += length * math.cos(heading)
        particles[i, 1] += length * math.sin(heading)
        yaw = heading + second + math.pi
        particles[i, 2] = yaw - two_pi * math.floor(yaw / two_pi) - math.pi


def decompose(motion: SE2) -> tuple[float, float, float]:
    """Turn, straight travel, second turn (radians, metres) that make up a motion seen from its start; for a
    robot that backs up the travel is negative rather than the turns half circles."""
    travel = math.hypot(motion.x, motion.y)
    if travel < STANDING:
        return 0.0, motion.x, motion.yaw
    turn = math.atan2(motion.y, motion.x)
    if abs(turn) > math.pi / 2:
        turn, travel = wrap(turn + math.pi), -travel
    return turn, travel, wrap(motion.yaw - turn)


def spread(motion: SE2, params: AmclParams) -> tuple[float, float, float]:
    """Standard deviations of the three parts: variances alpha1 turn^2 + alpha2 travel^2 and so on (table
    5.6)."""
    turn, travel, second = decompose(motion)
    return (
        math.hypot(
            params.rotation_noise_from_rotation * turn, params.rotation_noise_from_translation * travel
        ),
        math.sqrt(
            (params.translation_noise_from_translation * travel) ** 2
            + params.translation_noise_from_rotation**2 * (turn**2 + second**2)
        ),
        math.hypot(
            params.rotation_noise_from_rotation * second, params.rotation_noise_from_translation * travel
        ),
    )


def move(particles: NDArray[np.float64], motion: SE2, params: AmclParams, rng: np.random.Generator) -> None:
    """Moves particles (n, 3) in place by odometry's motion (new base frame seen from the old one) with its
    noise."""
    turn, travel, second = decompose(motion)
    _sample(particles, turn, travel, second, spread(motion, params), rng)
