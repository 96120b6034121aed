"""Rectangles of cells that grow with what is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError

_T = TypeVar("_T", bound=np.generic)


@dataclass(frozen=True, eq=False)
class Extent:
    """The cells from `begin` to before `end`, both (x, y) int64 in cells of the map frame."""

    begin: NDArray[np.int64]
    end: NDArray[np.int64]

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        width, height = (int(n) for n in self.end - self.begin)
        return height, width

    @property
    def cells(self) -> int:
        """How many."""
        height, width = self.shape
        return height * width

    def holds(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> bool:
        """Whether the cells from `low` to `high`, both included, lie in it."""
        return bool((low >= self.begin).all() and (high < self.end).all())

    def grown(self, low: NDArray[np.int64], high: NDArray[np.int64], spare: NDArray[np.int64]) -> Extent:
        """Reaching `low` and `high`, and on the sides that had to move `spare` cells more."""
        if not self.cells:
            return Extent(low - spare, high + 1 + spare)
        return Extent(
            np.where(low < self.begin, low - spare, self.begin),
            np.where(high >= self.end, high + 1 + spare, self.end),
        )

    def limited(self, cells: int) -> Extent:
        """Itself. UserError if it has more than `cells` cells: nothing indoors is so large."""
        if self.cells > cells:
            height, width = self.shape
            raise UserError(
                f"the map would have to grow to {width} x {height} cells, more than the {cells} of max_cells:"
                " check odometry and scans, or use a coarser resolution"
            )
        return self

    def moved(self, array: NDArray[_T], target: Extent) -> NDArray[_T]:
        """The array (..., rows, columns) of this extent amid zeros of the target's, which holds it."""
        new = np.zeros((*array.shape[:-2], *target.shape), array.dtype)
        if self.cells:
            column, row = (int(n) for n in self.begin - target.begin)
            new[..., row : row + self.shape[0], column : column + self.shape[1]] = array
        return new

    def times(self, factor: int) -> Extent:
        """In units that are `factor` times smaller."""
        return Extent(self.begin * factor, self.end * factor)


NOTHING = Extent(np.zeros(2, np.int64), np.zeros(2, np.int64))
FURTHEST = 1e8
"""Cells from the origin beyond which a place cannot be meant: float32 could not tell cells apart."""


def cells_of(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The cells that hold the points (n, 2), given in cells. UserError where that is absurdly far away."""
    if not (np.abs(points) < FURTHEST).all():
        far = np.abs(points).max()
        raise UserError(f"a beam ends {far:.3g} cells from the origin: check odometry and scans")
    return np.floor(points).astype(np.int64)
