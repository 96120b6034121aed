"""Weights and resampling of particles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def normalized(log_weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return weights that sum to one, from log weights known up to a constant."""
    weights = np.exp(log_weights - log_weights.max())
    return weights / weights.sum()


def effective_number(weights: NDArray[np.float64]) -> float:
    """Return the effective number of particles (Grisetti et al. 2007, equation 20)."""
    return float(1.0 / np.square(weights).sum())


def systematic(weights: NDArray[np.float64], offset: float) -> NDArray[np.int64]:
    """Return the sorted indices of the survivors of low-variance resampling.

    Each particle survives floor(n w_i) or ceil(n w_i) times (Thrun, Burgard, Fox: Probabilistic Robotics,
    2005, table 4.4, with n = len(weights) draws). offset: one random number in [0, 1).
    """
    n = len(weights)
    cumulative = np.cumsum(weights)
    # n equidistant pointers (i + offset) / n into the cumulative weights
    indices = np.searchsorted(cumulative / cumulative[-1], (np.arange(n) + offset) / n, side="right")
    return np.minimum(indices, n - 1)
