"""Tempering: how much of a scan's likelihood the filter applies at once.

Neighbouring beams share the errors of the map and of the model, so their likelihoods must not be multiplied
as if independent (Probabilistic Robotics, 6.3.4: raise the likelihood to a power below one). And a particle
set too sparse for a peaked likelihood would keep a single particle. One exponent serves both: at most what
the number of independent beams justifies, and never so large that the number of effective particles falls
below a given share (adaptive tempering: Jasra, Stephens, Doucet, Tsagaris 2011, Inference for Levy-driven
volatility via adaptive SMC, section 3).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

EFFECTIVE_SHARE = 0.25
_MAX_SAMPLES = 2000
_BISECTIONS = 12


@njit(cache=True, nogil=True)
def _effective(
    scores: NDArray[np.float64], prior: NDArray[np.float64], stride: int, max_score: float, exponent: float
) -> float:
    """Return Kish's effective sample size of every stride-th particle."""
    total, squares = 0.0, 0.0
    for i in range(0, scores.size, stride):
        w = prior[i] * math.exp(exponent * (scores[i] - max_score))
        total += w
        squares += w * w
    return total * total / squares if squares > 0.0 else 0.0


@njit(cache=True, nogil=True)
def exponent_for(
    scores: NDArray[np.float64], prior: NDArray[np.float64], limit: float, share: float
) -> float:
    """Return the largest exponent up to `limit` that keeps `share` of the effective particles.

    scores: (n,) log likelihoods. prior: (n,) weights before the scan.
    """
    # A sample of the particles is enough to choose the exponent
    stride = max(1, scores.size // _MAX_SAMPLES)
    max_score = -np.inf
    for i in range(0, scores.size, stride):
        max_score = max(max_score, scores[i])
    # Number of effective particles before the scan times `share`
    min_effective = share * _effective(scores, prior, stride, max_score, 0.0)
    if _effective(scores, prior, stride, max_score, limit) >= min_effective:
        return limit
    # Bisection: the effective sample size falls with the exponent
    low, high = 0.0, limit
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if _effective(scores, prior, stride, max_score, middle) >= min_effective:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def weights_of(
    scores: NDArray[np.float64], prior: NDArray[np.float64], exponent: float
) -> NDArray[np.float64]:
    """Return prior * exp(exponent * scores), normalized to a sum of one."""
    max_score = -np.inf
    for i in range(scores.size):
        max_score = max(max_score, scores[i])
    out = np.empty(scores.size)
    total = 0.0
    for i in range(scores.size):
        # Subtract the maximum before the exponential, against underflow
        out[i] = prior[i] * math.exp(exponent * (scores[i] - max_score))
        total += out[i]
    for i in range(scores.size):
        out[i] /= total
    return out


def independent_beams(angles: NDArray[np.float64], apart: float) -> float:
    """Return the number of independent beams (n,), radians, when those within `apart` count as one."""
    if apart <= 0.0 or angles.size < 2:
        return float(angles.size)
    # Beams in the same sector are correlated: count the occupied sectors
    sectors = np.unique(np.floor(np.mod(angles, 2.0 * math.pi) / apart))
    return float(min(sectors.size, angles.size))
