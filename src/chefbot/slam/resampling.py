"""Weights of particles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def normalized(log_weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights that sum to one, from logarithms known up to a constant."""
    weights = np.exp(log_weights - log_weights.max())
    return weights / weights.sum()


def effective_number(weights: NDArray[np.float64]) -> float:
    """How many equally weighted particles are as good (Grisetti et al. 2007, equation 20)."""
    return float(1.0 / np.square(weights).sum())


def systematic(weights: NDArray[np.float64], offset: float) -> NDArray[np.int64]:
    """Indices of the survivors in order, each i floor(n w_i) or ceil(n w_i) times.

    Thrun, Burgard, Fox: Probabilistic Robotics, 2005, table 4.4, with n = len(weights) draws.

    offset: one random number in [0, 1).
    """
    n = len(weights)
    sums = np.cumsum(weights)
    chosen = np.searchsorted(sums / sums[-1], (np.arange(n) + offset) / n, side="right")
    return np.minimum(chosen, n - 1)
