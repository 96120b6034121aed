"""Low-variance resampling (Probabilistic Robotics, table 4.4) of as many particles as KLD sampling asks for
(Fox 2003, Adapting the sample size in particle filters through KLD-sampling; table 8.4 of the book)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.params import AmclParams
from chefbot.localization.pose_bins import PoseBins, bin_of

GOLDEN = 0.6180339887498949


@njit(cache=True, nogil=True)
def kld_bound(bins: int, error: float, quantile: float) -> float:
    """Particles so that the divergence stays below `error` with the quantile's certainty (Fox 2003, equation
    7: the Wilson-Hilferty approximation of the chi-square quantile)."""
    if bins < 2:
        return 0.0
    a = 2.0 / (9.0 * (bins - 1))
    return (bins - 1) / (2.0 * error) * (1.0 - a + math.sqrt(a) * quantile) ** 3


@njit(cache=True, nogil=True)
def low_variance(weights: NDArray[np.float64], n: int, offset: float) -> NDArray[np.int32]:
    """n indices drawn with one comb of n teeth over the cumulated weights (sum 1); offset in [0, 1). O(n)."""
    picks = np.empty(n, np.int32)
    last = weights.size - 1
    i = 0
    passed = weights[0]
    for tooth in range(n):
        reach = (tooth + offset) / n
        while reach >= passed and i < last:
            i += 1
            passed += weights[i]
        picks[tooth] = i
    return picks


@njit(cache=True, nogil=True)
def _needed(
    particles: NDArray[np.float64],
    picks: NDArray[np.int32],
    stride: int,
    limits: tuple[int, int, float, float],
    corner: tuple[float, float],
    shape: tuple[int, int, int],
    labels: NDArray[np.int32],
) -> int:
    least, most, error, quantile = limits
    seen = np.empty(most, np.int32)
    bins, drawn, at = 0, 0, 0
    bound = 0.0
    while drawn < most and (drawn < least or drawn < bound):
        p = picks[at]
        here = bin_of(particles[p, 0], particles[p, 1], particles[p, 2], corner, shape)
        if labels[here] < 0:
            labels[here] = 0
            seen[bins] = here
            bins += 1
            bound = kld_bound(bins, error, quantile)
        at = (at + stride) % picks.size
        drawn += 1
    for k in range(bins):
        labels[seen[k]] = -1
    return drawn


def _stride(n: int) -> int:
    """Near n times the golden ratio and without common divisor: steps of it visit 0..n-1 evenly at every
    stage."""
    step = max(1, round(n * GOLDEN))
    while math.gcd(step, n) != 1:
        step += 1
    return step


def resample(
    particles: NDArray[np.float64],
    weights: NDArray[np.float64],
    bins: PoseBins,
    params: AmclParams,
    rng: np.random.Generator,
    least: int,
) -> NDArray[np.float64]:
    """A new set (m, 3), m >= least, of equally weighted particles drawn from particles (n, 3) with weights
    (n,) that sum to 1.

    How many is counted on draws in shuffled order as in the book's table 8.4; the set itself is drawn anew
    with a comb of exactly that many teeth, which keeps more of the variety than the independent draws would.
    """
    most = params.max_particles
    limits = (least, most, params.pf_err, params.pf_z)
    draws = low_variance(weights, most, rng.random())
    n = _needed(particles, draws, _stride(most), limits, bins.corner, bins.shape, bins.labels)
    return particles[low_variance(weights, n, rng.random())]
