"""Odometry motion model (Thrun, Burgard, Fox: Probabilistic Robotics, 5.4, table 5.6)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.params import AmclParams
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

MIN_TRANSLATION = 0.01
"""Distance in m below which the direction of travel is noise, and the motion is taken as a rotation in place."""


@njit(cache=True, nogil=True)
def _sample(
    particles: NDArray[np.float64],
    rot1: float,
    trans: float,
    rot2: float,
    std: tuple[float, float, float],
    rng: np.random.Generator,
) -> None:
    """Sample from the odometry motion model for every particle (table 5.6)."""
    two_pi = 2.0 * math.pi
    for i in range(particles.shape[0]):
        # Perturb rotation, translation, rotation
        rot1_sample = rot1 + std[0] * rng.standard_normal()
        trans_sample = trans + std[1] * rng.standard_normal()
        rot2_sample = rot2 + std[2] * rng.standard_normal()
        # Apply the sampled motion to the particle
        heading = particles[i, 2] + rot1_sample
        particles[i, 0] += trans_sample * math.cos(heading)
        particles[i, 1] += trans_sample * math.sin(heading)
        # Wrap the yaw to [-pi, pi)
        yaw = heading + rot2_sample + math.pi
        particles[i, 2] = yaw - two_pi * math.floor(yaw / two_pi) - math.pi


def decompose(motion: SE2) -> tuple[float, float, float]:
    """Decompose a motion into rotation, translation, rotation (rad, m, rad).

    For a robot that drives backwards the translation is negative, instead of two rotations by half a turn.
    """
    trans = math.hypot(motion.x, motion.y)
    if trans < MIN_TRANSLATION:
        return 0.0, motion.x, motion.yaw
    rot1 = math.atan2(motion.y, motion.x)
    # Driving backwards
    if abs(rot1) > math.pi / 2:
        rot1, trans = wrap(rot1 + math.pi), -trans
    return rot1, trans, wrap(motion.yaw - rot1)


def spread(motion: SE2, params: AmclParams) -> tuple[float, float, float]:
    """Return the standard deviations of rot1, trans and rot2 (table 5.6).

    The variances are alpha1 rot1^2 + alpha2 trans^2 and so on.
    """
    noise = params.odometry_noise
    rot1, trans, rot2 = decompose(motion)
    return (
        math.hypot(noise.rotation_from_rotation * rot1, noise.rotation_from_translation * trans),
        math.sqrt(
            (noise.translation_from_translation * trans) ** 2
            + noise.translation_from_rotation**2 * (rot1**2 + rot2**2)
        ),
        math.hypot(noise.rotation_from_rotation * rot2, noise.rotation_from_translation * trans),
    )


def move(particles: NDArray[np.float64], motion: SE2, params: AmclParams, rng: np.random.Generator) -> None:
    """Propagate particles (n, 3) in place with a noisy odometry motion (new base frame in the old one)."""
    rot1, trans, rot2 = decompose(motion)
    _sample(particles, rot1, trans, rot2, spread(motion, params), rng)
