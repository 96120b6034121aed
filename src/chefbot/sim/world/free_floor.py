"""Free floor of a map: where a robot fits, where it has the most room, and places drawn on it by seed."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

OCCUPIED_FROM = 65
"""Percent from which a cell is a wall, as ROS's map_server reads maps."""
MARGIN = 0.05
"""Metres beside the robot that a planner on cells needs."""
TABLES = 5
NEAREST = 0.3
"""Metres between two places, at least."""
KITCHEN = "kitchen"
_DRAWN = 0x91ACE5
"""Tells this chance from others of the same seed."""


class FreeFloor:
    """The known free cells of a map, seen by a round robot of `radius` metres. Cells are (row, column)."""

    def __init__(self, grid: Grid, radius: float) -> None:
        self.grid, self.radius = grid, radius
        self._free = (grid.cells >= 0) & (grid.cells < OCCUPIED_FROM)

    @cached_property
    def room(self) -> NDArray[np.float64]:
        """(h, w) metres from a cell's middle to the nearest wall, unknown cell or border; 0 on those."""
        from scipy import ndimage  # takes half a second, and most worlds do not need it

        padded = np.pad(self._free, 1)
        steps: NDArray[np.float64] = ndimage.distance_transform_edt(padded)[1:-1, 1:-1]
        return np.maximum(steps - 0.5, 0.0) * self.grid.resolution

    @cached_property
    def _areas(self) -> NDArray[np.int32]:
        """(h, w): 0 where the robot's middle cannot be, else the number of the area that hangs together."""
        from scipy import ndimage

        labels: NDArray[np.int32] = ndimage.label(self.room >= self.radius + MARGIN)[0]
        return labels

    def roomiest(self) -> tuple[SE2, float]:
        """The pose with the most room in the largest area, looking along x, and the room in metres.

        Of equal ones the first from below and from the left. UserError where the robot fits nowhere.
        """
        self._check_fits()
        sizes = np.bincount(self._areas.ravel())
        sizes[0] = 0
        inside = np.where(self._areas == int(sizes.argmax()), self.room, -1.0)
        row, column = np.unravel_index(int(inside.argmax()), inside.shape)
        return self._pose(int(row), int(column)), float(inside[row, column])

    def nearest(self, x: float, y: float) -> SE2:
        """The pose nearest to a point at which the robot fits, looking along x. UserError where it fits nowhere."""
        self._check_fits()
        rows, columns = np.nonzero(self._areas)
        xs, ys = self._middles(rows, columns)
        found = int(np.argmin((xs - x) ** 2 + (ys - y) ** 2))
        return self._pose(int(rows[found]), int(columns[found]))

    def draw_places(self, start: SE2, seed: int) -> dict[str, SE2]:
        """`kitchen` and `table_1` to `table_5`, apart from each other and from `start`, in the start's area.

        As many as find room; none where there is none for a kitchen and a table.
        """
        near = self.nearest(start.x, start.y)
        cells = np.argwhere(self._areas == self._areas[self.grid.cell(near.x, near.y)])
        rng = np.random.default_rng([seed, _DRAWN])
        spots = np.column_stack(self._middles(*cells.T))
        chosen = _apart(rng.permutation(spots), np.array([start.x, start.y]), 1 + TABLES)
        names = [KITCHEN, *(f"table_{i + 1}" for i in range(TABLES))]
        if len(chosen) < 2:
            return {}
        yaws = rng.integers(4, size=len(names)) * math.pi / 2
        return {name: SE2(*xy, float(yaw)) for name, xy, yaw in zip(names, chosen, yaws, strict=False)}

    def _check_fits(self) -> None:
        if not self._areas.any():
            raise UserError(
                f"there is no free floor that leaves a robot {self.radius + MARGIN:.2f} m to every side:"
                f" the most room is {float(self.room.max(initial=0.0)):.2f} m"
            )

    def _pose(self, row: int, column: int) -> SE2:
        x, y = self._middles(np.array([row]), np.array([column]))
        return SE2(float(x[0]), float(y[0]), 0.0)

    def _middles(
        self, rows: NDArray[np.int64], columns: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """x and y of the middles of cells, m."""
        grid = self.grid
        across, up = columns.astype(np.float64) + 0.5, rows.astype(np.float64) + 0.5
        return grid.origin_x + across * grid.resolution, grid.origin_y + up * grid.resolution


def _apart(spots: NDArray[np.float64], start: NDArray[np.float64], count: int) -> list[tuple[float, float]]:
    """Up to `count` of the spots (n, 2) in their order, as far from each other and the start as so many can be."""
    gap = float(np.ptp(spots, axis=0).max(initial=0.0)) / 2
    while True:
        chosen = _spaced(spots, start, max(gap, NEAREST), count)
        if len(chosen) == count or gap <= NEAREST:
            return chosen
        gap *= 0.8


def _spaced(
    spots: NDArray[np.float64], start: NDArray[np.float64], gap: float, count: int
) -> list[tuple[float, float]]:
    """Greedily: the first spot left at least `gap` metres from all chosen, until there are `count`."""
    chosen: list[tuple[float, float]] = []
    left = spots[np.hypot(*(spots - start).T) >= gap]
    while len(left) and len(chosen) < count:
        chosen.append((float(left[0, 0]), float(left[0, 1])))
        left = left[np.hypot(*(left - left[0]).T) >= gap]
    return chosen
