"""Occupancy mapping with known poses: counts of hits and misses for each cell."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.grid import UNKNOWN, Grid
from chefbot.slam.cell_bounds import EMPTY_BOUNDS, cells_of
from chefbot.slam.scan_beams import Beams

_GROWTH = 0.2
"""Extra growth relative to the size, so that the arrays are rarely reallocated."""
_MISS = math.log(0.24 / 0.76)
"""Log odds of a crossed cell: a single miss makes it free for a threshold of 25 %."""
_HIT = -3.0 * _MISS
"""Log odds of a cell with a beam's end: occupied if a quarter of the scans hit it, gmapping's threshold."""
_CLAMP = 5.0


class OccupancyAccumulator:
    """An occupancy map that counts for each cell the scans that hit it and the scans that crossed it.

    A scan counts once per cell, as a hit if any of its beams ended there: the many beams that graze a wall
    before they end in it must not erase it.
    """

    def __init__(self, resolution: float, max_cells: int) -> None:
        self._resolution = resolution
        self._max_cells = max_cells
        self._extent = EMPTY_BOUNDS
        self._hits = np.zeros((0, 0), np.uint16)
        self._misses = np.zeros((0, 0), np.uint16)
        self._last_scan = np.zeros((0, 0), np.int32)
        self._scans = 0
        self._seen = EMPTY_BOUNDS

    def copy(self) -> OccupancyAccumulator:
        """Return an independent copy with the same counts."""
        copy = OccupancyAccumulator(self._resolution, self._max_cells)
        copy.__dict__.update({k: v.copy() if isinstance(v, np.ndarray) else v for k, v in vars(self).items()})
        return copy

    def initialize_from(self, grid: Grid) -> None:
        """Initialize an empty map with the counts that reproduce `grid`; UNKNOWN cells stay unknown."""
        begin = np.round(np.array([grid.origin_x, grid.origin_y]) / self._resolution).astype(np.int64)
        self._grow(begin, begin + np.array([grid.width, grid.height]) - 1)
        column, row = (int(n) for n in begin - self._extent.begin)
        part = (slice(row, row + grid.height), slice(column, column + grid.width))
        self._hits[part], self._misses[part] = _counts(grid.cells)
        self._scans += 1

    def add_scan(self, beams: Beams, pose: NDArray[np.float64]) -> None:
        """Add a scan taken at `pose` (3,), metres and radians in the map frame."""
        c, s = math.cos(pose[2]), math.sin(pose[2])
        rotation = np.array([[c, s], [-s, c]])
        # Ends and sensor in cells of the map frame
        ends = (beams.ends @ rotation + pose[:2]) / self._resolution
        sensor = (beams.sensor @ rotation + pose[:2]) / self._resolution
        cells = cells_of(np.vstack([ends, sensor]))
        self._grow(cells.min(axis=0), cells.max(axis=0))
        self._scans += 1
        cells -= self._extent.begin
        _draw(cells[:-1], beams.hit, cells[-1], self._hits, self._misses, self._last_scan, self._scans)

    def _grow(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        self._seen = self._seen.expanded(low, high, np.zeros(2, np.int64))
        if self._extent.contains(low, high):
            return
        spare = 16 + (_GROWTH * (self._seen.end - self._seen.begin)).astype(np.int64)
        extent = self._extent.expanded(low, high, spare).check_size(self._max_cells)
        self._hits = self._extent.copied_into(self._hits, extent)
        self._misses = self._extent.copied_into(self._misses, extent)
        self._last_scan = self._extent.copied_into(self._last_scan, extent)
        self._extent = extent

    def grid(self) -> Grid:
        """Return the occupancy in percent, UNKNOWN where nothing was observed, cropped to the observed area."""
        if not self._scans:
            return Grid(np.full((1, 1), UNKNOWN, np.int8), self._resolution, 0.0, 0.0)
        column, row = (int(n) for n in self._seen.begin - self._extent.begin)
        height, width = self._seen.shape
        part = (slice(row, row + height), slice(column, column + width))
        x, y = (float(v) for v in self._seen.begin * self._resolution)
        return Grid(_percent(self._hits[part], self._misses[part]), self._resolution, x, y)


def _counts(percent: NDArray[np.int8]) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """Return the lowest counts of hits and misses with these log odds: the inverse of `_percent`."""
    probability = np.clip(percent / 100.0, 1.0 / (1.0 + math.exp(_CLAMP)), 1.0 / (1.0 + math.exp(-_CLAMP)))
    log_odds = np.log(probability / (1.0 - probability))
    # Occupied cells need at least one hit, free cells at least one miss
    hits = np.where(log_odds >= 0.0, np.maximum(1.0, np.ceil(log_odds / _HIT)), 0.0)
    misses = np.maximum(np.round((log_odds - hits * _HIT) / _MISS), hits == 0.0)
    is_known = percent != UNKNOWN
    return (hits * is_known).astype(np.uint16), (misses * is_known).astype(np.uint16)


@njit(cache=True, nogil=True)
def _percent(hits, misses):  # type: ignore[no-untyped-def]
    """Log odds from the counts, as percent; clamped once, so that the order of scans does not matter."""
    out = np.empty(hits.shape, np.int8)
    for row in range(hits.shape[0]):
        for column in range(hits.shape[1]):
            hit, miss = hits[row, column], misses[row, column]
            if hit == 0 and miss == 0:
                out[row, column] = UNKNOWN
                continue
            # l = hits * l_hit + misses * l_miss, clamped; p = 1 / (1 + exp(-l))
            log_odds = min(max(hit * _HIT + miss * _MISS, -_CLAMP), _CLAMP)
            out[row, column] = round(100.0 / (1.0 + math.exp(-log_odds)))
    return out


@njit(cache=True, nogil=True)
def _draw(ends, hit, sensor, hits, misses, last_scan, scan):  # type: ignore[no-untyped-def]
    """Count the hits at the beams' ends, then the misses along the rays, each cell once per scan."""
    # Hits first: a cell that this scan hit is not counted as crossed
    for i in range(len(ends)):
        column, row = ends[i, 0], ends[i, 1]
        if hit[i] and last_scan[row, column] != scan:
            last_scan[row, column] = scan
            hits[row, column] = min(hits[row, column] + 1, 65535)
    # Misses along every ray
    for i in range(len(ends)):
        _cross(sensor[0], sensor[1], ends[i, 0], ends[i, 1], misses, last_scan, scan)


@njit(cache=True, nogil=True)
def _cross(x, y, end_x, end_y, misses, last_scan, scan):  # type: ignore[no-untyped-def]
    """Count a miss in the cells from (x, y) to before the end, along Bresenham's line (1965)."""
    dx, dy = abs(end_x - x), abs(end_y - y)
    step_x, step_y = (1 if end_x > x else -1), (1 if end_y > y else -1)
    error = dx - dy
    while x != end_x or y != end_y:
        if last_scan[y, x] != scan:
            last_scan[y, x] = scan
            misses[y, x] = min(misses[y, x] + 1, 65535)
        # Bresenham: step along the axis that is behind the ideal line
        doubled_error = 2 * error
        if doubled_error > -dy:
            error -= dy
            x += step_x
        if doubled_error < dx:
            error += dx
            y += step_y
