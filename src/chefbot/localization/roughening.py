"""Smoothing of a particle set that is too sparse for the likelihood it was weighted with.

Regularized particle filter: Musso, Oudjane, Le Gland 2001, Improving regularised particle filters, section
12.2.2; roughening: Gordon, Salmond, Smith 1993. The bandwidth is computed per bin, so that one hypothesis
among many is smoothed by its own spread and not by the distance between hypotheses.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.pose_bins import BIN_METRES, BIN_YAWS, PoseBins

DIMENSIONS = 3
GAUSSIAN_FACTOR = (4.0 / (DIMENSIONS + 2.0)) ** (1.0 / (DIMENSIONS + 4.0))
"""Factor A in the optimal bandwidth A n^(-1/(d+4)) of a Gaussian kernel (Silverman 1986, 4.14)."""
SINGLE_STD = np.array([BIN_METRES, BIN_METRES, 2.0 * math.pi / BIN_YAWS]) / math.sqrt(12.0)
"""Standard deviations for a particle alone in its bin: those of a uniform distribution over the bin."""


@njit(cache=True, nogil=True)
def _jitter(
    particles: NDArray[np.float64],
    particle_bins: NDArray[np.int32],
    mean: NDArray[np.float64],
    shrink: NDArray[np.float64],
    bandwidth: NDArray[np.float64],
    rng: np.random.Generator,
) -> None:
    """Replace x by mean + shrink (x - mean) + bandwidth * noise, with the values (k, 3) or (k,) of its bin."""
    two_pi = 2.0 * math.pi
    for i in range(particles.shape[0]):
        k = particle_bins[i]
        for axis in range(3):
            deviation = shrink[k] * (particles[i, axis] - mean[k, axis])
            particles[i, axis] = mean[k, axis] + deviation + bandwidth[k, axis] * rng.standard_normal()
        # Wrap the yaw to [-pi, pi)
        yaw = particles[i, 2] + math.pi
        particles[i, 2] = yaw - two_pi * math.floor(yaw / two_pi) - math.pi


@njit(cache=True, nogil=True)
def _bin_moments(
    particles: NDArray[np.float64], particle_bins: NDArray[np.int32], bins: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return count (k,), means and standard deviations (k, 3) of the particles of each bin.

    Within a bin no yaw wraps.
    """
    count = np.zeros(bins)
    mean = np.zeros((bins, 3))
    square = np.zeros((bins, 3))
    for i in range(particles.shape[0]):
        k = particle_bins[i]
        count[k] += 1.0
        for axis in range(3):
            deviation = particles[i, axis] - mean[k, axis]
            # Welford's online mean and variance
            mean[k, axis] += deviation / count[k]
            square[k, axis] += deviation * (particles[i, axis] - mean[k, axis])
    for k in range(bins):
        for axis in range(3):
            square[k, axis] = math.sqrt(square[k, axis] / count[k])
    return count, mean, square


def roughen(
    particles: NDArray[np.float64], distinct: float, bins: PoseBins, rng: np.random.Generator
) -> None:
    """Spread copies apart in place; `distinct` is the share of the particles (n, 3) that are not copies.

    A bin with several distinct particles keeps its mean and variance: they are shrunk towards the mean by
    what the kernel adds (Liu & West 2001, Combined parameter and state estimation, equation 10.3.8).
    """
    particle_bins, occupied = bins.label(particles)
    bins.clear(occupied)
    count, mean, std = _bin_moments(particles, particle_bins, occupied.size)
    # Effective number of distinct particles per bin
    effective = np.maximum(count * distinct, 1.0)
    single = effective < 2.0
    # Silverman's bandwidth in units of the bin's standard deviation
    h = np.where(single, 1.0, GAUSSIAN_FACTOR * effective ** (-1.0 / (DIMENSIONS + 4.0)))
    # Shrinkage a with a^2 + h^2 = 1 keeps the variance
    shrink = np.where(single, 1.0, np.sqrt(1.0 - h**2))
    bandwidth = h[:, None] * np.where(single[:, None], SINGLE_STD, std)
    _jitter(particles, particle_bins, mean, shrink, bandwidth, rng)
