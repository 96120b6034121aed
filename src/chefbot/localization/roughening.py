"""Smoothing of a population that is too thin for the likelihood it met (regularised particle filter: Musso,
Oudjane, Le Gland 2001, Improving regularised particle filters, section 12.2.2; roughening: Gordon, Salmond,
Smith 1993).

The bandwidth is taken bin by bin, so that one hypothesis among many is smoothed by its own spread and not by
the distance between hypotheses.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.pose_bins import BIN_METRES, BIN_YAWS, PoseBins

DIMENSIONS = 3
GAUSSIAN_FACTOR = (4.0 / (DIMENSIONS + 2.0)) ** (1.0 / (DIMENSIONS + 4.0))
"""A in the optimal bandwidth A n^(-1/(d+4)) of a Gaussian kernel (Silverman 1986, 4.14)."""
LONE_SPREAD = np.array([BIN_METRES, BIN_METRES, 2.0 * math.pi / BIN_YAWS]) / math.sqrt(12.0)
"""Of a particle alone in its bin: it may stand for any pose in there."""


@njit(cache=True, nogil=True)
def _jitter(
    particles: NDArray[np.float64],
    labelled: NDArray[np.int32],
    mean: NDArray[np.float64],
    shrink: NDArray[np.float64],
    bandwidth: NDArray[np.float64],
    rng: np.random.Generator,
) -> None:
    """x -> mean + shrink (x - mean) + bandwidth * noise, with the means (k, 3) and so on of each particle's
    bin."""
    two_pi = 2.0 * math.pi
    for i in range(particles.shape[0]):
        k = labelled[i]
        for a in range(3):
            off = shrink[k] * (particles[i, a] - mean[k, a])
            particles[i, a] = mean[k, a] + off + bandwidth[k, a] * rng.standard_normal()
        yaw = particles[i, 2] + math.pi
        particles[i, 2] = yaw - two_pi * math.floor(yaw / two_pi) - math.pi


@njit(cache=True, nogil=True)
def _bin_moments(
    particles: NDArray[np.float64], labelled: NDArray[np.int32], bins: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Count (k,), means and standard deviations (k, 3) of the particles of each bin; within one no yaw
    wraps."""
    count = np.zeros(bins)
    mean = np.zeros((bins, 3))
    square = np.zeros((bins, 3))
    for i in range(particles.shape[0]):
        k = labelled[i]
        count[k] += 1.0
        for a in range(3):
            off = particles[i, a] - mean[k, a]
            mean[k, a] += off / count[k]
            square[k, a] += off * (particles[i, a] - mean[k, a])
    for k in range(bins):
        for a in range(3):
            square[k, a] = math.sqrt(square[k, a] / count[k])
    return count, mean, square


def roughen(
    particles: NDArray[np.float64], distinct: float, bins: PoseBins, rng: np.random.Generator
) -> None:
    """Spreads copies apart in place; `distinct` is the share of the particles (n, 3) that are no copies.

    A bin with several distinct particles keeps its mean and variance: they are drawn towards the mean by
    what the kernel adds (Liu & West 2001, Combined parameter and state estimation, equation 10.3.8).
    """
    labelled, occupied = bins.label(particles)
    bins.clear(occupied)
    count, mean, spread = _bin_moments(particles, labelled, occupied.size)
    effective = np.maximum(count * distinct, 1.0)
    lone = effective < 2.0
    h = np.where(lone, 1.0, GAUSSIAN_FACTOR * effective ** (-1.0 / (DIMENSIONS + 4.0)))
    shrink = np.where(lone, 1.0, np.sqrt(1.0 - h**2))
    bandwidth = h[:, None] * np.where(lone[:, None], LONE_SPREAD, spread)
    _jitter(particles, labelled, mean, shrink, bandwidth, rng)
