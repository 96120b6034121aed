"""The occupancy map of a pose graph: as long as the poses stay, only new scans are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import Grid
from chefbot.slam.occupancy_accumulator import OccupancyAccumulator
from chefbot.slam.scan_beams import Beams, with_range_offset

MAX_SHIFT, MAX_TURN = 0.01, 0.002
"""Motion of a pose up to which its scan is not drawn again: m, a fifth of a cell; rad, a cell in 25 m."""
MAX_OFFSET_CHANGE = 0.01
"""Change of the correction of all ranges up to which no scan is drawn again, m."""


class DrawnMap:
    """Draws scans at their poses, and all of them again once one of these has moved."""

    def __init__(self, resolution: float, max_cells: int) -> None:
        self._size = resolution, max_cells
        self._canvas = OccupancyAccumulator(*self._size)
        self._poses: NDArray[np.float64] = np.zeros((0, 3))
        self._offset = 0.0

    def draw(self, scans: Sequence[Beams], poses: NDArray[np.float64], range_offset: float) -> Grid:
        """Return the map of the scans at poses (n, 3), with this correction of all ranges, m."""
        if abs(range_offset - self._offset) > MAX_OFFSET_CHANGE or self._have_moved(poses):
            self._clear(range_offset)
        first = len(self._poses)
        for beams, pose in zip(scans[first:], poses[first:], strict=True):
            self._canvas.add_scan(with_range_offset(beams, self._offset), pose)
        self._poses = np.concatenate([self._poses, poses[first:]])
        return self._canvas.grid()

    def _clear(self, range_offset: float) -> None:
        self._canvas = OccupancyAccumulator(*self._size)
        self._poses, self._offset = np.zeros((0, 3)), range_offset

    def _have_moved(self, poses: NDArray[np.float64]) -> bool:
        """Return whether a scan is no longer where it was drawn."""
        change = poses[: len(self._poses)] - self._poses
        shift = np.hypot(change[:, 0], change[:, 1])
        turn = np.abs(np.arctan2(np.sin(change[:, 2]), np.cos(change[:, 2])))
        return bool((shift > MAX_SHIFT).any() or (turn > MAX_TURN).any())
