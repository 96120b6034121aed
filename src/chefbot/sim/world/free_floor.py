"""Free floor of a map: where a robot fits, where it has the largest clearance, and randomly drawn places."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

Floats = NDArray[np.float64]
OCCUPIED_FROM = 65
"""Occupancy in percent from which a cell counts as a wall, as in ROS's map_server."""
MARGIN = 0.05
"""Additional clearance in metres around the robot, for planning on cells."""
TABLES = 5
MIN_PLACE_DISTANCE = 0.3
"""Minimum distance between two places, metres."""
KITCHEN = "kitchen"
_SEED_SALT = 0x91ACE5
"""Separates this random stream from others with the same seed."""


class FreeFloor:
    """The known free cells of a map for a round robot of `radius` metres. Cells are (row, column)."""

    def __init__(self, grid: Grid, radius: float) -> None:
        self.grid, self.radius = grid, radius
        self._free = (grid.cells >= 0) & (grid.cells < OCCUPIED_FROM)

    @cached_property
    def clearance(self) -> Floats:
        """Clearance (h, w), m: distance from a cell's centre to the nearest wall, unknown cell or map
        border."""
        from scipy import ndimage  # takes half a second, and most worlds do not need it

        # Euclidean distance transform with the border as an obstacle; half a cell to the cell's edge.
        padded = np.pad(self._free, 1)
        steps: Floats = ndimage.distance_transform_edt(padded)[1:-1, 1:-1]
        return np.maximum(steps - 0.5, 0.0) * self.grid.resolution

    @cached_property
    def _components(self) -> NDArray[np.int32]:
        """Connected components (h, w) of cells where the robot's centre fits, from 1; 0 elsewhere."""
        from scipy import ndimage

        labels: NDArray[np.int32] = ndimage.label(self.clearance >= self.radius + MARGIN)[0]
        return labels

    def roomiest(self) -> tuple[SE2, float]:
        """Return the pose (yaw 0) with the largest clearance in the largest component, and that clearance, m.

        Ties go to the first cell from the bottom, then from the left. Raises UserError if the robot fits
        nowhere.
        """
        self._check_robot_fits()
        # Largest connected component, then its cell with the largest clearance.
        sizes = np.bincount(self._components.ravel())
        sizes[0] = 0
        inside = np.where(self._components == int(sizes.argmax()), self.clearance, -1.0)
        row, column = np.unravel_index(int(inside.argmax()), inside.shape)
        return self._pose(int(row), int(column)), float(inside[row, column])

    def nearest(self, x: float, y: float) -> SE2:
        """Return the pose (yaw 0) where the robot fits nearest to a point. Raises UserError if there is
        none."""
        self._check_robot_fits()
        rows, columns = np.nonzero(self._components)
        xs, ys = self._cell_centres(rows, columns)
        index = int(np.argmin((xs - x) ** 2 + (ys - y) ** 2))
        return self._pose(int(rows[index]), int(columns[index]))

    def draw_places(self, start: SE2, seed: int) -> dict[str, SE2]:
        """Draw `kitchen` and `table_1` to `table_5` at random, spread out, in the component of the start.

        Returns as many as fit, none if there is no room for a kitchen and a table. seed: random seed.
        """
        near = self.nearest(start.x, start.y)
        cells = np.argwhere(self._components == self._components[self.grid.cell(near.x, near.y)])
        rng = np.random.default_rng([seed, _SEED_SALT])
        candidates = np.column_stack(self._cell_centres(*cells.T))
        chosen = _spread_out(rng.permutation(candidates), np.array([start.x, start.y]), 1 + TABLES)
        names = [KITCHEN, *(f"table_{i + 1}" for i in range(TABLES))]
        if len(chosen) < 2:
            return {}
        yaws = rng.integers(4, size=len(names)) * math.pi / 2
        return {name: SE2(*xy, float(yaw)) for name, xy, yaw in zip(names, chosen, yaws, strict=False)}

    def _check_robot_fits(self) -> None:
        if not self._components.any():
            raise UserError(
                f"no free floor leaves the robot {self.radius + MARGIN:.2f} m to every side:"
                f" the largest clearance is {float(self.clearance.max(initial=0.0)):.2f} m"
            )

    def _pose(self, row: int, column: int) -> SE2:
        x, y = self._cell_centres(np.array([row]), np.array([column]))
        return SE2(float(x[0]), float(y[0]), 0.0)

    def _cell_centres(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Return x and y of the centres of cells, m."""
        grid = self.grid
        across, up = columns.astype(np.float64) + 0.5, rows.astype(np.float64) + 0.5
        return grid.origin_x + across * grid.resolution, grid.origin_y + up * grid.resolution


def _spread_out(candidates: Floats, start: Floats, count: int) -> list[tuple[float, float]]:
    """Choose up to `count` candidates (n, 2) in their order, with the largest spacing at which they fit."""
    gap = float(np.ptp(candidates, axis=0).max(initial=0.0)) / 2
    # Shrink the spacing until enough places fit.
    while True:
        chosen = _greedy_spacing(candidates, start, max(gap, MIN_PLACE_DISTANCE), count)
        if len(chosen) == count or gap <= MIN_PLACE_DISTANCE:
            return chosen
        gap *= 0.8


def _greedy_spacing(candidates: Floats, start: Floats, gap: float, count: int) -> list[tuple[float, float]]:
    """Choose greedily up to `count` candidates, each at least `gap` metres from all chosen before."""
    chosen: list[tuple[float, float]] = []
    remaining = candidates[np.hypot(*(candidates - start).T) >= gap]
    while len(remaining) and len(chosen) < count:
        chosen.append((float(remaining[0, 0]), float(remaining[0, 1])))
        remaining = remaining[np.hypot(*(remaining - remaining[0]).T) >= gap]
    return chosen
