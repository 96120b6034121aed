"""How well the scans of a drive agree with a map that was built without them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt

from chefbot.maths.grid import OCCUPIED_THRESHOLD, UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import RecordedScan

AGREEMENT_DISTANCE = 0.2
"""Distance from a wall of the map within which the end of a beam agrees with it, m."""
CONTRADICTION_DISTANCE = 0.5
"""Distance from every wall beyond which the end of a beam in free space contradicts the map, m."""
MIN_SHARE, MIN_COVERED, FIRST_SCANS = 0.85, 0.5, 30
"""Shares of beams that agree with the map, of the whole drive and of its first scans, below which it does not fit.

Chosen on halves of fr101, csail, intel and seattle, each continued with each: at least 0.98 and 0.99 in the same
building, at most 0.93 and 0.3 in another.
"""


class Agreement(NamedTuple):
    """Numbers of beams that end at a wall of the map, in its known space far from every wall, and anywhere."""

    near: int
    far: int
    total: int

    @property
    def share(self) -> float:
        """Share of the beams that agree among those that agree or contradict; 0 if there are none."""
        judged = self.near + self.far
        return self.near / judged if judged else 0.0

    @property
    def covered(self) -> float:
        """Share of all beams that end at a wall of the map; 0 if there are none."""
        return self.near / self.total if self.total else 0.0


class DriveFit(NamedTuple):
    """How a drive agrees with a map: `Agreement.share` of all its scans, `Agreement.covered` of the first ones."""

    share: float
    covered: float

    @property
    def is_good(self) -> bool:
        """Whether the drive was recorded in the building of the map."""
        return self.share >= MIN_SHARE and self.covered >= MIN_COVERED


def drive_fit(
    grid: Grid, scans: Sequence[RecordedScan], poses: Sequence[SE2], sensor: SE2, range_max: float
) -> DriveFit:
    """Return how a drive agrees with a map that was built without it; arguments as of `agreement`."""
    first = agreement(grid, scans[:FIRST_SCANS], poses[:FIRST_SCANS], sensor, range_max)
    return DriveFit(agreement(grid, scans, poses, sensor, range_max).share, first.covered)


def agreement(
    grid: Grid, scans: Sequence[RecordedScan], poses: Sequence[SE2], sensor: SE2, range_max: float
) -> Agreement:
    """Compare the ends of a drive's beams with a map; poses: of the robot in it, range_max: of no return, m."""
    walls = grid.cells >= OCCUPIED_THRESHOLD
    distance = (
        distance_transform_edt(~walls, sampling=grid.resolution)
        if walls.any()
        else np.full(walls.shape, math.inf)
    )
    near = far = total = 0
    for scan, pose in zip(scans, poses, strict=True):
        met = (scan.ranges > 0.0) & (scan.ranges < range_max)
        beams = scan.ranges[met, None] * np.column_stack([np.cos(scan.angles[met]), np.sin(scan.angles[met])])
        ends = (pose @ sensor).apply(beams)
        columns = np.floor((ends[:, 0] - grid.origin_x) / grid.resolution).astype(int)
        rows = np.floor((ends[:, 1] - grid.origin_y) / grid.resolution).astype(int)
        inside = (rows >= 0) & (columns >= 0) & (rows < walls.shape[0]) & (columns < walls.shape[1])
        cells, away = grid.cells[rows[inside], columns[inside]], distance[rows[inside], columns[inside]]
        near += int((away <= AGREEMENT_DISTANCE).sum())
        far += int(((cells != UNKNOWN) & (away > CONTRADICTION_DISTANCE)).sum())
        total += len(ends)
    return Agreement(near, far, total)
