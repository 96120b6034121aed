"""How much of a scan's likelihood the filter may believe at once.

Neighbouring beams share the errors of the map and of the model, so their likelihoods must not be multiplied
as if independent (Probabilistic Robotics, 6.3.4: raise the likelihood to a power below one). And a
population too thin for a sharp likelihood would keep a single lucky particle. Both are served by one
exponent: at most what the number of independent beams justifies, and never so large that fewer than a share
of the particles stay effective (adaptive tempering: Jasra, Stephens, Doucet, Tsagaris 2011, Inference for
Levy-driven volatility via adaptive SMC, section 3).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

EFFECTIVE_SHARE = 0.25
_PROBES = 2000
_HALVINGS = 12


@njit(cache=True, nogil=True)
def _effective(
    scores: NDArray[np.float64], prior: NDArray[np.float64], stride: int, best: float, exponent: float
) -> float:
    """Kish's effective sample size of every stride-th particle."""
    total, squares = 0.0, 0.0
    for i in range(0, scores.size, stride):
        w = prior[i] * math.exp(exponent * (scores[i] - best))
        total += w
        squares += w * w
    return total * total / squares if squares > 0.0 else 0.0


@njit(cache=True, nogil=True)
def exponent_for(
    scores: NDArray[np.float64], prior: NDArray[np.float64], limit: float, share: float
) -> float:
    """The largest exponent up to `limit` that keeps `share` of the effective particles; scores (n,) are
    logarithms, prior (n,) the weights before the scan."""
    stride = max(1, scores.size // _PROBES)
    best = -np.inf
    for i in range(0, scores.size, stride):
        best = max(best, scores[i])
    enough = share * _effective(scores, prior, stride, best, 0.0)
    if _effective(scores, prior, stride, best, limit) >= enough:
        return limit
    low, high = 0.0, limit
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _effective(scores, prior, stride, best, middle) >= enough:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def weights_of(
    scores: NDArray[np.float64], prior: NDArray[np.float64], exponent: float
) -> NDArray[np.float64]:
    """prior * exp(exponent * scores), summing to one."""
    best = -np.inf
    for i in range(scores.size):
        best = max(best, scores[i])
    out = np.empty(scores.size)
    total = 0.0
    for i in range(scores.size):
        out[i] = prior[i] * math.exp(exponent * (scores[i] - best))
        total += out[i]
    for i in range(scores.size):
        out[i] /= total
    return out


def independent_beams(angles: NDArray[np.float64], apart: float) -> float:
    """How many of the beams (n,), radians, count as independent when those within `apart` count as one."""
    if apart <= 0.0 or angles.size < 2:
        return float(angles.size)
    taken = np.unique(np.floor(np.mod(angles, 2.0 * math.pi) / apart))
    return float(min(taken.size, angles.size))
