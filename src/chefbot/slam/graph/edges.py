"""Edges of a pose graph: relative measurements between its poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Edges:
    """Relative measurements: pose `to` seen from pose `of`.

    of, to: (m,) int64. measured: (m, 3), m and rad. information: (m, 3, 3) in the axes of `of`. kernel: (m,)
    squared Mahalanobis distance from which the robust kernel lowers an edge's weight; inf for no kernel.
    """

    of: NDArray[np.int64]
    to: NDArray[np.int64]
    measured: Array
    information: Array
    kernel: Array

    @staticmethod
    def empty() -> Edges:
        """Return an empty set of edges (m = 0)."""
        none = np.zeros(0, np.int64)
        return Edges(none, none, np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0))

    @staticmethod
    def concatenated(parts: list[Edges]) -> Edges:
        """Return the edges of all parts in their order."""
        columns = zip(*((e.of, e.to, e.measured, e.information, e.kernel) for e in parts), strict=True)
        return Edges(*(np.concatenate(column) for column in columns))

    def __len__(self) -> int:
        return len(self.of)


def edge(of: int, to: int, measured: Array, information: Array, kernel: float) -> Edges:
    """Return a single edge: measured (3,), information (3, 3)."""
    return Edges(np.array([of]), np.array([to]), measured[None], information[None], np.array([kernel]))
