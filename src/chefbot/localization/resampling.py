"""Low-variance resampling with a number of particles from KLD sampling.

Probabilistic Robotics, table 8.4; Fox 2003, Adapting the sample size in particle filters through
KLD-sampling.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.params import AmclParams
from chefbot.localization.pose_bins import PoseBins, bin_of
from chefbot.maths.resampling import low_variance

GOLDEN_RATIO = 0.6180339887498949


@njit(cache=True, nogil=True)
def kld_bound(bins: int, error: float, quantile: float) -> float:
    """Return the number of particles for a KL divergence below `error` at the confidence of the quantile.

    Fox 2003, equation 7: the Wilson-Hilferty approximation of the chi-square quantile.
    """
    if bins < 2:
        return 0.0
    a = 2.0 / (9.0 * (bins - 1))
    return (bins - 1) / (2.0 * error) * (1.0 - a + math.sqrt(a) * quantile) ** 3


@njit(cache=True, nogil=True)
def _required_particles(
    particles: NDArray[np.float64],
    indices: NDArray[np.int64],
    stride: int,
    limits: tuple[int, int, float, float],
    corner: tuple[float, float],
    shape: tuple[int, int, int],
    labels: NDArray[np.int32],
) -> int:
    """Count the draws until the KLD bound of the occupied bins is reached (table 8.4)."""
    min_particles, max_particles, error, quantile = limits
    occupied = np.empty(max_particles, np.int32)
    bins, drawn, position = 0, 0, 0
    bound = 0.0
    while drawn < max_particles and (drawn < min_particles or drawn < bound):
        i = indices[position]
        bin_index = bin_of(particles[i, 0], particles[i, 1], particles[i, 2], corner, shape)
        # A draw into an empty bin raises the bound
        if labels[bin_index] < 0:
            labels[bin_index] = 0
            occupied[bins] = bin_index
            bins += 1
            bound = kld_bound(bins, error, quantile)
        position = (position + stride) % indices.size
        drawn += 1
    # Leave the table empty for the next user
    for j in range(bins):
        labels[occupied[j]] = -1
    return drawn


def _stride(n: int) -> int:
    """Return a number near n times the golden ratio and coprime to n: its multiples visit 0..n-1 evenly."""
    step = max(1, round(n * GOLDEN_RATIO))
    while math.gcd(step, n) != 1:
        step += 1
    return step


def resample(
    particles: NDArray[np.float64],
    weights: NDArray[np.float64],
    bins: PoseBins,
    params: AmclParams,
    rng: np.random.Generator,
    min_particles: int,
    max_particles: int,
) -> NDArray[np.float64]:
    """Return `min_particles` to `max_particles` equally weighted particles (m, 3) drawn from particles (n, 3).

    weights: (n,), summing to 1. The number of particles is determined with draws in shuffled order as in the
    book's table 8.4; the set itself is drawn again by low-variance resampling with exactly that many
    particles, which preserves more diversity than the independent draws would.
    """
    limits = (min_particles, max_particles, params.pf_err, params.pf_z)
    # How many: count the occupied bins of up to max_particles draws
    draws = low_variance(weights, max_particles, rng.random())
    n = _required_particles(
        particles, draws, _stride(max_particles), limits, bins.corner, bins.shape, bins.labels
    )
    return particles[low_variance(weights, n, rng.random())]
