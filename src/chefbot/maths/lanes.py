"""One-way lanes on a grid: areas through which a robot moves in one direction only."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

MAX_LANES = 255
"""Maximum number of lanes: each has a number of 8 bits."""


@dataclass(frozen=True, eq=False)
class OneWayLanes:
    """Lanes of a grid: `number` (h, w) of the lane of each cell, 0 for none; `directions` (n + 1, 2), unit vectors.

    Row 0 of `directions` is zero. A step may not lead against the direction of a lane in which it begins or ends, so
    the coordinate along a lane never decreases on a path.
    """

    number: NDArray[np.uint8]
    directions: NDArray[np.float64]
    names: tuple[str, ...] = ()
    """Titles of the lanes 1 to n, such as "one-way lane door"."""

    @property
    def reversed(self) -> OneWayLanes:
        """The lanes in the opposite directions: a search over them from a pose finds the paths to it."""
        return replace(self, directions=-self.directions)

    def against(
        self, rows: NDArray[np.int64], columns: NDArray[np.int64], step: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        """Return the lanes (n,) against whose direction the steps (n, 2) at the cells lead, 0 for none."""
        lane = self.number[rows, columns]
        along = (self.directions[lane] * step).sum(axis=1)
        opposed: NDArray[np.uint8] = np.where(along < 0.0, lane, 0).astype(np.uint8)
        return opposed


NO_LANES = OneWayLanes(np.zeros((0, 0), np.uint8), np.zeros((1, 2)))
"""The lanes of a grid without any."""
