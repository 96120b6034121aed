"""Drawing scans at known poses into an occupancy grid."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.grid import UNKNOWN, Grid
from chefbot.slam.cell_bounds import NOTHING, cells_of
from chefbot.slam.scan_beams import Beams

_GROWTH = 0.2
"""Share of its size by which a canvas grows beyond need, so that it seldom does."""
_MISS = math.log(0.24 / 0.76)
"""Log odds of a cell that a scan crossed: once is enough to be free for those who ask for less than 25 %."""
_HIT = -3.0 * _MISS
"""Log odds of a cell in which a beam ended: even odds if a quarter of the scans hit, gmapping's threshold."""
_CLAMP = 5.0


class Canvas:
    """How many scans hit and how many crossed each cell.

    A scan counts once for a cell, as a hit if any of its beams ended there: of the many beams that graze a
    wall before they end in it, none shall erase it.
    """

    def __init__(self, resolution: float, max_cells: int) -> None:
        self._resolution = resolution
        self._max_cells = max_cells
        self._extent = NOTHING
        self._hits = np.zeros((0, 0), np.uint16)
        self._misses = np.zeros((0, 0), np.uint16)
        self._touched = np.zeros((0, 0), np.int32)
        self._scans = 0
        self._seen = NOTHING

    def copy(self) -> Canvas:
        """An independent canvas with the same scans."""
        other = Canvas(self._resolution, self._max_cells)
        other.__dict__.update(
            {k: v.copy() if isinstance(v, np.ndarray) else v for k, v in vars(self).items()}
        )
        return other

    def begin_with(self, grid: Grid) -> None:
        """On an empty canvas, as if a few scans had shown this grid; UNKNOWN cells stay so."""
        begin = np.round(np.array([grid.origin_x, grid.origin_y]) / self._resolution).astype(np.int64)
        self._cover(begin, begin + np.array([grid.width, grid.height]) - 1)
        column, row = (int(n) for n in begin - self._extent.begin)
        part = (slice(row, row + grid.height), slice(column, column + grid.width))
        self._hits[part], self._misses[part] = _counts(grid.cells)
        self._scans += 1

    def draw(self, beams: Beams, pose: NDArray[np.float64]) -> None:
        """Add a scan taken at `pose` (3,), metres and radians in the map frame."""
        c, s = math.cos(pose[2]), math.sin(pose[2])
        turn = np.array([[c, s], [-s, c]])
        ends = (beams.ends @ turn + pose[:2]) / self._resolution
        sensor = (beams.sensor @ turn + pose[:2]) / self._resolution
        cells = cells_of(np.vstack([ends, sensor]))
        self._cover(cells.min(axis=0), cells.max(axis=0))
        self._scans += 1
        cells -= self._extent.begin
        _draw(cells[:-1], beams.hit, cells[-1], self._hits, self._misses, self._touched, self._scans)

    def _cover(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        self._seen = self._seen.grown(low, high, np.zeros(2, np.int64))
        if self._extent.holds(low, high):
            return
        spare = 16 + (_GROWTH * (self._seen.end - self._seen.begin)).astype(np.int64)
        extent = self._extent.grown(low, high, spare).limited(self._max_cells)
        self._hits = self._extent.moved(self._hits, extent)
        self._misses = self._extent.moved(self._misses, extent)
        self._touched = self._extent.moved(self._touched, extent)
        self._extent = extent

    def grid(self) -> Grid:
        """Occupied share in percent of the cells seen, UNKNOWN elsewhere; bounded by what was drawn."""
        if not self._scans:
            return Grid(np.full((1, 1), UNKNOWN, np.int8), self._resolution, 0.0, 0.0)
        column, row = (int(n) for n in self._seen.begin - self._extent.begin)
        height, width = self._seen.shape
        part = (slice(row, row + height), slice(column, column + width))
        x, y = (float(v) for v in self._seen.begin * self._resolution)
        return Grid(_percent(self._hits[part], self._misses[part]), self._resolution, x, y)


def _counts(percent: NDArray[np.int8]) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """The fewest hits and misses with such log odds, as nearly as whole numbers can: the inverse of `_percent`."""
    share = np.clip(percent / 100.0, 1.0 / (1.0 + math.exp(_CLAMP)), 1.0 / (1.0 + math.exp(-_CLAMP)))
    odds = np.log(share / (1.0 - share))
    hits = np.where(odds >= 0.0, np.maximum(1.0, np.ceil(odds / _HIT)), 0.0)
    misses = np.maximum(np.round((odds - hits * _HIT) / _MISS), hits == 0.0)
    known = percent != UNKNOWN
    return (hits * known).astype(np.uint16), (misses * known).astype(np.uint16)


@njit(cache=True, nogil=True)
def _percent(hits, misses):  # type: ignore[no-untyped-def]
    """Log odds from the counts, as percent; clamped once, so that the order of scans does not matter."""
    out = np.empty(hits.shape, np.int8)
    for row in range(hits.shape[0]):
        for column in range(hits.shape[1]):
            h, m = hits[row, column], misses[row, column]
            if h == 0 and m == 0:
                out[row, column] = UNKNOWN
                continue
            odds = min(max(h * _HIT + m * _MISS, -_CLAMP), _CLAMP)
            out[row, column] = round(100.0 / (1.0 + math.exp(-odds)))
    return out


@njit(cache=True, nogil=True)
def _draw(ends, hit, sensor, hits, misses, touched, scan):  # type: ignore[no-untyped-def]
    for i in range(len(ends)):
        column, row = ends[i, 0], ends[i, 1]
        if hit[i] and touched[row, column] != scan:
            touched[row, column] = scan
            hits[row, column] = min(hits[row, column] + 1, 65535)
    for i in range(len(ends)):
        _cross(sensor[0], sensor[1], ends[i, 0], ends[i, 1], misses, touched, scan)


@njit(cache=True, nogil=True)
def _cross(x, y, end_x, end_y, misses, touched, scan):  # type: ignore[no-untyped-def]
    """Count a miss for the cells from (x, y) to before the end, along Bresenham's line (1965)."""
    dx, dy = abs(end_x - x), abs(end_y - y)
    step_x, step_y = (1 if end_x > x else -1), (1 if end_y > y else -1)
    error = dx - dy
    while x != end_x or y != end_y:
        if touched[y, x] != scan:
            touched[y, x] = scan
            misses[y, x] = min(misses[y, x] + 1, 65535)
        twice = 2 * error
        if twice > -dy:
            error -= dy
            x += step_x
        if twice < dx:
            error += dx
            y += step_y
