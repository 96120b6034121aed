"""Bins of the pose space over a map, for KLD sampling and clustering."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.errors import LocalizationError
from chefbot.maths.grid import Grid

BIN_METRES = 0.5
BIN_YAWS = 36
"""Number of yaw bins, ten degrees each; both bin sizes are those of ROS's amcl."""
MAX_BINS = 100_000_000
"""Maximum size of the table, limited by memory: 0.7 square kilometres."""


@njit(cache=True, nogil=True)
def bin_of(x: float, y: float, yaw: float, corner: tuple[float, float], shape: tuple[int, int, int]) -> int:
    """Return the flat index of a pose's bin; poses off the map fall into the nearest border bin."""
    col = min(max(math.floor((x - corner[0]) / BIN_METRES), 0), shape[1] - 1)
    row = min(max(math.floor((y - corner[1]) / BIN_METRES), 0), shape[0] - 1)
    # Yaw is periodic
    yaw_bin = math.floor((yaw + math.pi) / (2.0 * math.pi) * BIN_YAWS) % BIN_YAWS
    return (row * shape[1] + col) * BIN_YAWS + yaw_bin


@njit(cache=True, nogil=True)
def _label(
    particles: NDArray[np.float64],
    corner: tuple[float, float],
    shape: tuple[int, int, int],
    labels: NDArray[np.int32],
    particle_bins: NDArray[np.int32],
    occupied: NDArray[np.int32],
) -> int:
    count = 0
    for i in range(particles.shape[0]):
        bin_index = bin_of(particles[i, 0], particles[i, 1], particles[i, 2], corner, shape)
        # First particle in this bin: number it
        if labels[bin_index] < 0:
            labels[bin_index] = count
            occupied[count] = bin_index
            count += 1
        particle_bins[i] = labels[bin_index]
    return count


class PoseBins:
    """A dense table of bins over the map's extent; all `labels` are -1 when it is not in use."""

    def __init__(self, grid: Grid) -> None:
        rows = max(1, math.ceil(grid.height * grid.resolution / BIN_METRES))
        columns = max(1, math.ceil(grid.width * grid.resolution / BIN_METRES))
        if rows * columns * BIN_YAWS > MAX_BINS:
            raise LocalizationError(
                f"the map covers {grid.height * grid.resolution:g} x {grid.width * grid.resolution:g} m, more than"
                " a robot can be found on; check its resolution, or cut it"
            )
        self.corner = (grid.origin_x, grid.origin_y)
        self.shape = (rows, columns, BIN_YAWS)
        self.labels = np.full(rows * columns * BIN_YAWS, -1, np.int32)

    def label(self, particles: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return the number of each particle's bin (n,) and the flat index of each numbered bin (k,).

        `self.labels` keeps the numbers until `clear` is called with the second array.
        """
        particle_bins = np.empty(particles.shape[0], np.int32)
        occupied = np.empty(particles.shape[0], np.int32)
        count = _label(particles, self.corner, self.shape, self.labels, particle_bins, occupied)
        return particle_bins, occupied[:count]

    def clear(self, occupied: NDArray[np.int32]) -> None:
        """Reset the labels that `label` has set."""
        self.labels[occupied] = -1
