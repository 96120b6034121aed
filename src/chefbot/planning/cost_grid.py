"""The padded costmap that the search and the smoothing of paths work on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class CostGrid(NamedTuple):
    """A costmap with a border of blocked cells, as flat arrays for kernels.

    Costs are looked up instead of stored as weights: a quarter of the memory, and the search waits for memory.
    """

    cells: NDArray[np.uint8]
    """Cost of each cell, in rows of `stride` cells, with a blocked border."""
    weight: NDArray[np.float32]
    """Traversal weight by cost, (256,): at least 1, or 0 where blocked."""
    stride: int
    lane: NDArray[np.uint8]
    """Number of the one-way lane of each cell, or empty without lanes."""
    direction: NDArray[np.float64]
    """Direction of each lane, (n, 2), as in OneWayLanes."""


@njit(cache=True, nogil=True)
def pad(cells: NDArray[np.uint8], border: int, out: NDArray[np.uint8]) -> None:
    """Copy `cells` (h, w) into the middle of `out` (h + 2, w + 2), with a border of cost `border`."""
    h, w = cells.shape
    out[0, :] = border
    out[h + 1, :] = border
    for r in range(h):
        out[r + 1, 0] = border
        out[r + 1, w + 1] = border
        for c in range(w):
            out[r + 1, c + 1] = cells[r, c]
