"""Free floor of a map: where a robot fits, where it has the largest clearance, and randomly drawn places."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import SE2

Floats = NDArray[np.float64]
MARGIN = 0.05
"""Additional clearance in metres around the robot, for planning on cells."""
TABLES = 5
MIN_PLACE_DISTANCE = 0.3
"""Minimum distance between two places, metres."""
FACING_LENGTH = 1.0
"""Metres of free floor that a drawn place faces, as far as there are."""
MAX_CANDIDATES = 200_000
"""Maximum number of cells that places are drawn from; of more, every second, third and so on is taken."""
ROWS_AT_ONCE = 256
"""Rows of cells that are searched at once, which keeps the memory small."""
KITCHEN = "kitchen"
_SEED_SALT = 0x91ACE5
"""Separates this random stream from others with the same seed."""


class FreeFloor:
    """The free cells of a map for a round robot of `radius` metres. Cells are (row, column).

    unknown_is_free: whether a robot may drive on unknown cells. Start and places lie on known cells even then, as
    long as there are any.
    """

    def __init__(self, grid: Grid, radius: float, unknown_is_free: bool = False) -> None:
        self.grid, self.radius = grid, radius
        known = (grid.cells >= 0) & (grid.cells < OCCUPIED_THRESHOLD)
        self._free = grid.cells < OCCUPIED_THRESHOLD if unknown_is_free else known
        self._known = known if known.any() else self._free

    @cached_property
    def clearance(self) -> Floats:
        """Clearance (h, w), m: distance from a cell's centre to the nearest cell that is not free, or to the map's
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
        candidates = np.where(self._known, self._components, 0)
        sizes = np.bincount(candidates.ravel())
        sizes[0] = 0
        inside = np.where(candidates == int(sizes.argmax()), self.clearance, -1.0)
        row, column = np.unravel_index(int(inside.argmax()), inside.shape)
        return self._pose(int(row), int(column)), float(inside[row, column])

    def nearest(self, x: float, y: float) -> SE2:
        """Return the pose (yaw 0) where the robot fits nearest to a point. Raises UserError if there is
        none."""
        self._check_robot_fits()
        return self._nearest(self._known & (self._components > 0), x, y)

    def reachable_near(self, start: SE2, x: float, y: float) -> tuple[SE2, float]:
        """Return the pose (yaw 0) nearest to a point that the robot gets to from `start`, and their distance, m.

        The path may be as narrow as the robot.
        """
        pose = self._nearest(self._reached(start), x, y)
        return pose, math.hypot(pose.x - x, pose.y - y)

    def draw_places(self, start: SE2, seed: int) -> dict[str, SE2]:
        """Draw `kitchen` and `table_1` to `table_5` at random, spread out, in the component of the start.

        Each faces free floor. Returns as many as fit, none if there is no room for a kitchen and a table. seed:
        random seed.
        """
        cells = np.flatnonzero(self._component_of(start))
        if not len(cells):
            return {}
        rows, columns = np.divmod(cells[:: 1 + len(cells) // MAX_CANDIDATES], self.grid.width)
        rng = np.random.default_rng([seed, _SEED_SALT])
        candidates = np.column_stack(self._cell_centres(rows, columns))
        chosen = _spread_out(rng.permutation(candidates), np.array([start.x, start.y]), 1 + TABLES)
        names = [KITCHEN, *(f"table_{i + 1}" for i in range(TABLES))]
        if len(chosen) < 2:
            return {}
        turns = rng.integers(4, size=len(names)).tolist()
        return {name: self._facing(*xy, turn) for name, xy, turn in zip(names, chosen, turns, strict=False)}

    def _facing(self, x: float, y: float, turn: int) -> SE2:
        """Return the pose at a point, turned left by quarters from `turn` until it faces FACING_LENGTH of floor."""
        turns = [(turn + i) % 4 for i in range(4)]
        ahead = [self._free_ahead(x, y, quarter) for quarter in turns]
        return SE2(x, y, turns[int(np.argmax(ahead))] * math.pi / 2)

    def _free_ahead(self, x: float, y: float, turn: int) -> float:
        """Return the length of free floor ahead, at most FACING_LENGTH, m."""
        row, column = self.grid.cell(x, y)
        steps = np.arange(1, 2 + int(FACING_LENGTH / self.grid.resolution))
        across, up = ((1, 0), (0, 1), (-1, 0), (0, -1))[turn]
        rows, columns = row + up * steps, column + across * steps
        inside = (rows >= 0) & (rows < self.grid.height) & (columns >= 0) & (columns < self.grid.width)
        free = np.zeros(len(steps), np.bool_)
        free[inside] = self._free[rows[inside], columns[inside]]
        blocked = len(steps) if free.all() else int(np.argmin(free))
        return min(blocked * self.grid.resolution, FACING_LENGTH)

    def _component_of(self, start: SE2) -> NDArray[np.bool_]:
        """Return the cells (h, w) of the component of the start, or of the one nearest to it on its way: the known
        ones, or all if none of them is known."""
        fits = self._components > 0
        if not fits[self.grid.cell(start.x, start.y)]:
            fits &= self._reached(start)
        if not fits.any():
            return fits
        near = self._nearest(fits, start.x, start.y)
        component: NDArray[np.bool_] = self._components == self._components[self.grid.cell(near.x, near.y)]
        known = component & self._known
        return known if known.any() else component

    def _reached(self, start: SE2) -> NDArray[np.bool_]:
        """Return the cells (h, w) that the robot gets to from the start, which is free.

        The clearance of a cell is exact within half a cell, which it is given here.
        """
        from scipy import ndimage

        wide = self.clearance + self.grid.resolution / 2 >= self.radius
        labels = ndimage.label(wide)[0]
        begin = self._nearest(wide, start.x, start.y)
        return np.asarray(labels == labels[self.grid.cell(begin.x, begin.y)])

    def _check_robot_fits(self) -> None:
        if not (self._components.any() and (self._components[self._known] > 0).any()):
            raise UserError(
                f"no free floor leaves the robot {self.radius + MARGIN:.2f} m to every side:"
                f" the largest clearance is {float(self.clearance.max(initial=0.0)):.2f} m;"
                " name a smaller robot, or check resolution, negate and thresholds of the map"
            )

    def _nearest(self, mask: NDArray[np.bool_], x: float, y: float) -> SE2:
        best, smallest = (0, 0), math.inf
        for begin in range(0, len(mask), ROWS_AT_ONCE):
            rows, columns = np.nonzero(mask[begin : begin + ROWS_AT_ONCE])
            xs, ys = self._cell_centres(rows + begin, columns)
            squares = (xs - x) ** 2 + (ys - y) ** 2
            if len(squares) and squares.min() < smallest:
                index, smallest = int(squares.argmin()), float(squares.min())
                best = int(rows[index]) + begin, int(columns[index])
        return self._pose(*best)

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
