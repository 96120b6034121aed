"""The marks of one sensor in a costmap, and when each was last confirmed."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import LETHAL, UNKNOWN

N = TypeVar("N", bound=np.generic)


class ObstacleLayer(NamedTuple):
    """cells (h, w): LETHAL where the sensor saw an obstacle, FREE where it saw none, else UNKNOWN or a cost that does
    not count. marked_at (h, w): time at which a lethal cell was last marked, s."""

    cells: NDArray[np.uint8]
    marked_at: NDArray[np.float64]

    @classmethod
    def empty(cls, shape: tuple[int, ...]) -> ObstacleLayer:
        """Return a layer in which nothing was seen."""
        return cls(np.full(shape, UNKNOWN, np.uint8), np.zeros(shape))

    def shifted(self, rows: int, columns: int, shape: tuple[int, ...]) -> ObstacleLayer:
        """Return the layer in a grid of `shape` with its cell [0, 0] at [rows, columns]; new cells are UNKNOWN."""
        times = shifted(self.marked_at, rows, columns, shape, 0.0)
        return ObstacleLayer(shifted(self.cells, rows, columns, shape, UNKNOWN), times)

    def remove_older(self, time: float) -> bool:
        """Remove the marks that were last confirmed before `time`, s; return whether there were any."""
        old = (self.cells == LETHAL) & (self.marked_at < time)
        self.cells[old] = UNKNOWN
        return bool(old.any())


def shifted(array: NDArray[N], rows: int, columns: int, shape: tuple[int, ...], fill: float) -> NDArray[N]:
    """Return the array in a grid of `shape` with its cell [0, 0] at [rows, columns]; new cells are `fill`."""
    # pages of zeros take no memory before they are written
    out = np.full(shape, fill, array.dtype) if fill else np.zeros(shape, array.dtype)
    h, w = array.shape
    top, left = max(rows, 0), max(columns, 0)
    bottom, right = min(rows + h, shape[0]), min(columns + w, shape[1])
    if top < bottom and left < right:
        out[top:bottom, left:right] = array[top - rows : bottom - rows, left - columns : right - columns]
    return out
