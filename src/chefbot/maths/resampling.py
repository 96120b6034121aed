"""Low-variance resampling (Thrun, Burgard & Fox, Probabilistic Robotics, 2005, table 4.4)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def low_variance(weights: NDArray[np.float64], n: int, offset: float) -> NDArray[np.int64]:
    """Return n sorted indices (n,), drawn with n equidistant pointers into the cumulative weights in O(n).

    weights: (m,), summing to 1. offset: one random number in [0, 1). Index i is drawn floor(n w_i) or
    ceil(n w_i) times.
    """
    indices = np.empty(n, np.int64)
    last = weights.size - 1
    i = 0
    cumulative = weights[0]
    for k in range(n):
        pointer = (k + offset) / n
        # Advance to the weight interval that contains the pointer
        while pointer >= cumulative and i < last:
            i += 1
            cumulative += weights[i]
        indices[k] = i
    return indices
