"""Likelihood field model of a range finder (Thrun, Burgard, Fox: Probabilistic Robotics, 6.4, table 6.3).

The distance of every cell to the nearest obstacle is computed once per map, and the log likelihood of a beam
is tabulated with it, so that weighting a particle takes one sine and one cosine and one table lookup per
beam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.errors import LocalizationError
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid

SURFACE_DEPTH = 2
"""Depth of the surface of a solid, cells: walls up to four cells thick count completely."""
FREE_THRESHOLD = 25
TOLERANCE = 1.5
"""Distance that is no evidence about the place, cells: how far off a wall lies that a map draws as cells."""
PAD = 2
"""Width of the border, cells: beams that end off the map are clamped to it, so the kernel needs no bounds
check.
"""


def surfaces(occupied: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (h, w) the occupied cells that a beam can end on; beyond the border all cells count as occupied.

    Otherwise, where the outside of a building is drawn solid, a pose from which the beams end deep within it
    would fit as well as the true one.
    """
    inside: NDArray[np.bool_] = np.pad(occupied, SURFACE_DEPTH, constant_values=True)
    width = 2 * SURFACE_DEPTH + 1
    for axis in (0, 1):  # the square neighbourhood, one axis after the other
        windows = np.lib.stride_tricks.sliding_window_view(inside, width, axis=axis)
        inside = np.asarray(windows.all(axis=-1), np.bool_)
    return np.asarray(occupied & ~inside)


@njit(cache=True, nogil=True)
def _squared_distances(occupied: NDArray[np.bool_], reach: int) -> NDArray[np.float32]:
    """Return (h, w) the exact squared distances in cells to the nearest occupied cell, capped at (reach + 1)^2.

    Separable: first along columns, then the lower envelope along rows, searched only within the cap.
    """
    height, width = occupied.shape
    cap = np.float32((reach + 1) * (reach + 1))
    column_distance = np.empty((height, width), np.float32)
    cap_distance = np.float32(reach + 1)
    for row in range(height):
        for col in range(width):
            # Pass 1, downwards: distance to the nearest occupied cell above
            above = column_distance[row - 1, col] if row > 0 else cap_distance
            column_distance[row, col] = (
                np.float32(0.0) if occupied[row, col] else min(above + np.float32(1.0), cap_distance)
            )
    # Pass 2, upwards: nearest occupied cell above or below
    for row in range(height - 2, -1, -1):
        for col in range(width):
            column_distance[row, col] = min(
                column_distance[row, col], column_distance[row + 1, col] + np.float32(1.0)
            )
    out = np.empty((height, width), np.float32)
    # Pass 3: combine the columns, d^2 = min over columns of (column distance^2 + offset^2)
    padded_row = np.full(width + 2 * reach, cap, np.float32)
    for row in range(height):
        for col in range(width):
            padded_row[reach + col] = column_distance[row, col] * column_distance[row, col]
        _lower_envelope(padded_row, reach, out[row])
    return out


@njit(cache=True, nogil=True)
def _lower_envelope(padded_row: NDArray[np.float32], reach: int, out: NDArray[np.float32]) -> None:
    """Compute out[i] = min over |d| <= reach of padded_row[reach + i + d] + d^2.

    The inner loop is contiguous, so that it vectorizes.
    """
    width = out.size
    min_distance = np.float32(1e9)
    for col in range(width):
        out[col] = padded_row[reach + col]
        min_distance = min(min_distance, out[col])
    for d in range(1, reach + 1):
        offset_cost = np.float32(d * d)
        for col in range(width):
            side = min(padded_row[reach + col - d], padded_row[reach + col + d]) + offset_cost
            out[col] = min(out[col], side)


@njit(cache=True, nogil=True)
def _look_up(squared: NDArray[np.float32], table: NDArray[np.float32], pad: int) -> NDArray[np.float32]:
    """Return table[squared] with a border of the value at the largest distance, (h + 2 pad, w + 2 pad)."""
    height, width = squared.shape
    last = table.size - 1
    out = np.full((height + 2 * pad, width + 2 * pad), table[last], np.float32)
    for row in range(height):
        for col in range(width):
            out[row + pad, col + pad] = table[min(int(squared[row, col]), last)]
    return out


@njit(cache=True, nogil=True)
def weigh(
    particles: NDArray[np.float64],
    points: NDArray[np.float32],
    field: NDArray[np.float32],
    origin_x: float,
    origin_y: float,
    per_metre: float,
    out: NDArray[np.float64],
) -> None:
    """Compute out[i] = sum of the field at the points (2, m; cells, base frame) transformed by particle i.

    origin_x, origin_y: metres, outer corner of cell [0, 0] of the padded field. Beam ends are float32 in
    cells: on a map of 4000 cells that rounds to 1/4000 cell. A NaN counts as column or row 0.

    Bit-identical on every processor: without `fastmath`, whose order of summation depends on the vector
    width, but with four accumulators that are added in a fixed order.
    """
    cells = np.empty(points.shape[1], np.int32)
    flat = field.ravel()
    for i in range(particles.shape[0]):
        # Pose of the particle in cells of the field
        c = np.float32(math.cos(particles[i, 2]))
        s = np.float32(math.sin(particles[i, 2]))
        x = np.float32((particles[i, 0] - origin_x) * per_metre)
        y = np.float32((particles[i, 1] - origin_y) * per_metre)
        # Project the beams' ends into the map: R(theta) z + x
        _end_cells(c, s, x, y, points[0], points[1], field.shape[0], field.shape[1], cells)
        # log p(z | x, m) = sum over beams of the tabulated log likelihood
        out[i] = _sum_at(flat, cells)


@njit(cache=True, nogil=True)
def _end_cells(
    c: np.float32,
    s: np.float32,
    x: np.float32,
    y: np.float32,
    px: NDArray[np.float32],
    py: NDArray[np.float32],
    height: int,
    width: int,
    out: NDArray[np.int32],
) -> None:
    """Compute the flat cell indices of the points (px, py) after rotation and translation, all in cells.

    c, s: cosine and sine of the rotation; x, y: translation. Points off the field are clamped to it. No
    branches and no calls, so that it vectorizes.
    """
    zero, right, top = np.float32(0.0), np.float32(width - 1), np.float32(height - 1)
    columns = np.int32(width)
    for j in range(px.size):
        # Rotate and translate, then clamp to the padded border
        col = c * px[j] - s * py[j] + x
        row = s * px[j] + c * py[j] + y
        col = col if col > zero else zero  # NaN too
        row = row if row > zero else zero
        col = col if col < right else right
        row = row if row < top else top
        out[j] = np.int32(row) * columns + np.int32(col)


@njit(cache=True, nogil=True)
def _sum_at(values: NDArray[np.float32], indices: NDArray[np.int32]) -> np.float32:
    """Return the sum of values[at] in four interleaved accumulators; the remainder goes to the first."""
    a = b = c = d = np.float32(0.0)
    vector_end = indices.size - indices.size % 4
    for j in range(0, vector_end, 4):
        a += values[indices[j]]
        b += values[indices[j + 1]]
        c += values[indices[j + 2]]
        d += values[indices[j + 3]]
    for j in range(vector_end, indices.size):
        a += values[indices[j]]
    return (a + b) + (c + d)


@dataclass(frozen=True, eq=False)
class LikelihoodField:
    """The likelihood field of a map.

    distance: (h + 2 PAD, w + 2 PAD) float32 metres to the nearest obstacle, capped. log_likelihood: the same
    shape, log of a beam's likelihood relative to a perfect hit. origin_x, origin_y: metres, outer corner of
    the padded cell [0, 0]. free: (k, 2) int32 rows and columns of the map's free cells (not padded).
    """

    distance: NDArray[np.float32]
    log_likelihood: NDArray[np.float32]
    origin_x: float
    origin_y: float
    grid: Grid
    free: NDArray[np.int32]

    @staticmethod
    def of(grid: Grid, params: AmclParams) -> LikelihoodField:
        """Compute the field of an occupancy grid; raise LocalizationError without free or without occupied cells."""
        occupied = grid.cells >= OCCUPIED_THRESHOLD
        free = np.argwhere((grid.cells >= 0) & (grid.cells < FREE_THRESHOLD)).astype(np.int32)
        if free.shape[0] == 0:
            raise LocalizationError("the map has no free cell to place the robot on; load another map")
        if not occupied.any():
            raise LocalizationError(
                "the map has no occupied cell, so no scan can be matched to it; load another map"
            )
        reach = max(1, math.ceil(params.laser_likelihood_max_dist / grid.resolution))
        # Distance transform, then tables of distance and log likelihood by squared distance
        squared = _squared_distances(surfaces(occupied), reach)
        metres = np.sqrt(np.arange((reach + 1) ** 2 + 1, dtype=np.float64)) * grid.resolution
        metres = np.minimum(metres, params.laser_likelihood_max_dist)
        return LikelihoodField(
            distance=_look_up(squared, metres.astype(np.float32), PAD),
            log_likelihood=_look_up(squared, log_likelihood(metres, params).astype(np.float32), PAD),
            origin_x=grid.origin_x - PAD * grid.resolution,
            origin_y=grid.origin_y - PAD * grid.resolution,
            grid=grid,
            free=free,
        )

    def tolerant(self, params: AmclParams) -> LikelihoodField:
        """Return the field in which a beam that ends up to TOLERANCE cells from an obstacle is a perfect hit.

        Between places that are far apart such distances are errors of the map, the same in every scan.
        """
        squared = np.rint((self.distance / np.float32(self.grid.resolution)) ** 2)
        cells = np.sqrt(np.arange(int(squared.max()) + 1, dtype=np.float64))
        metres = np.maximum(cells - TOLERANCE, 0.0) * self.grid.resolution
        table = log_likelihood(metres, params).astype(np.float32)
        return replace(self, log_likelihood=_look_up(squared, table, 0))

    def log_likelihoods(
        self, particles: NDArray[np.float64], points: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the log likelihoods (n,) of particles (n, 3) for beam ends (m, 2) in the base frame, metres.

        All beams count as independent.
        """
        out = np.zeros(particles.shape[0])
        per_metre = 1.0 / self.grid.resolution
        cells = np.ascontiguousarray((points * per_metre).T, dtype=np.float32)
        weigh(particles, cells, self.log_likelihood, self.origin_x, self.origin_y, per_metre, out)
        return out

    @property
    def free_area(self) -> float:
        """Area of the free cells, m^2."""
        return self.free.shape[0] * self.grid.resolution**2

    def sample_free_space(self, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw n poses (n, 3) uniformly from the free cells and all headings."""
        cell = self.free[rng.integers(self.free.shape[0], size=n)]
        # Uniform within the cell
        inside = cell + rng.random((n, 2))
        poses = np.empty((n, 3))
        poses[:, 0] = self.grid.origin_x + inside[:, 1] * self.grid.resolution
        poses[:, 1] = self.grid.origin_y + inside[:, 0] * self.grid.resolution
        poses[:, 2] = rng.uniform(-math.pi, math.pi, n)
        return poses


def log_likelihood(distance: NDArray[np.float64], params: AmclParams) -> NDArray[np.float64]:
    """Return the log of z_hit * exp(-d^2 / 2 sigma^2) + z_rand, relative to its value at d = 0.

    As table 6.3, but z_rand is the floor relative to the peak: the book's z_rand / z_max is a density and
    would make the floor depend on the sensor's range.
    """
    # Table 6.3: q(d) = z_hit exp(-d^2 / (2 sigma^2)) + z_rand, relative to q(0)
    hit = params.z_hit * np.exp(-0.5 * (distance / params.sigma_hit) ** 2)
    return np.log((hit + params.z_rand) / (params.z_hit + params.z_rand))
