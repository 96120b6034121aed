"""Rectangles of cells that grow with the observed area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ChefbotError

_T = TypeVar("_T", bound=np.generic)


class MapSizeError(ChefbotError):
    """A map that would have to grow beyond the maximum number of cells, or beyond plausible coordinates."""


@dataclass(frozen=True, eq=False)
class CellBounds:
    """A rectangle of cells from `begin` to before `end`, both (x, y) int64 in cells of the map frame."""

    begin: NDArray[np.int64]
    end: NDArray[np.int64]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and of columns."""
        width, height = (int(n) for n in self.end - self.begin)
        return height, width

    @property
    def cells(self) -> int:
        """Number of cells in the rectangle."""
        height, width = self.shape
        return height * width

    def contains(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> bool:
        """Return whether the cells from `low` to `high`, both included, lie in the rectangle."""
        return bool((low >= self.begin).all() and (high < self.end).all())

    def expanded(
        self, low: NDArray[np.int64], high: NDArray[np.int64], spare: NDArray[np.int64]
    ) -> CellBounds:
        """Return the rectangle extended to `low` and `high`, plus `spare` cells on the sides that change."""
        if not self.cells:
            return CellBounds(low - spare, high + 1 + spare)
        return CellBounds(
            np.where(low < self.begin, low - spare, self.begin),
            np.where(high >= self.end, high + 1 + spare, self.end),
        )

    def check_size(self, cells: int) -> CellBounds:
        """Return the rectangle itself; raise MapSizeError if it has more than `cells` cells."""
        if self.cells > cells:
            height, width = self.shape
            raise MapSizeError(
                f"the map would have to grow to {width} x {height} cells, more than the {cells} of max_cells:"
                " check odometry and scans, or use a coarser resolution"
            )
        return self

    def copied_into(self, array: NDArray[_T], target: CellBounds) -> NDArray[_T]:
        """Copy the array (..., rows, columns) into zeros of the shape of `target`, which contains this
        extent.
        """
        new = np.zeros((*array.shape[:-2], *target.shape), array.dtype)
        if self.cells:
            column, row = (int(n) for n in self.begin - target.begin)
            new[..., row : row + self.shape[0], column : column + self.shape[1]] = array
        return new

    def scaled(self, factor: int) -> CellBounds:
        """Return the rectangle in units smaller by `factor`."""
        return CellBounds(self.begin * factor, self.end * factor)


EMPTY_BOUNDS = CellBounds(np.zeros(2, np.int64), np.zeros(2, np.int64))
MAX_COORDINATE = 1e8
"""Largest plausible distance from the origin, cells; beyond it float32 cannot distinguish cells."""


def cells_of(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the cells that contain the points (n, 2), given in cells.

    Raise MapSizeError if one is implausibly far away.
    """
    if not (np.abs(points) < MAX_COORDINATE).all():
        max_coordinate = np.abs(points).max()
        raise MapSizeError(
            f"a beam ends {max_coordinate:.3g} cells from the origin: check odometry and scans"
        )
    return np.floor(points).astype(np.int64)
