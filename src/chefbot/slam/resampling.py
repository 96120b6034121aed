"""Weights of particles."""

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
