"""What does not move: the static map, and cells in which returns stay or where nothing was before.

An occupancy grid with evidence of both kinds, as in Wolf and Sukhatme 2005, "Mobile robot simultaneous localization
and mapping in dynamic environments".
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.grid import UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.people.observation import Floats, Observation

CELL = 0.1
"""Side of a cell, m."""
CELLS = 256
"""Cells of a side; what is farther away than their length shares a cell and replaces it."""
FREE_MARGIN, MAX_FREE_MARGIN = 0.2, 2.0
"""Distance before a return from which on a beam shows nothing, m: at a right angle, and at the smallest angle."""
HIT_TIME = 0.5
"""Time after a return for which beams through the cell do not count, s: they pass beside what stands in it."""
MAX_STATIC_EVIDENCE, STATIC_EVIDENCE = 100, 10
"""Largest evidence that something stays in a cell, and evidence from which it does; one for each observation."""
FREE_STEP = 3
"""Evidence that a beam through a cell takes off."""
OCCUPIED_THRESHOLD = 65
"""Occupancy of the static map from which a cell is an obstacle, percent."""
MAX_COORDINATE = 1e6
"""Coordinate of a point beyond which it has no cell, m."""


@njit(cache=True, nogil=True)
def _cell_of(keys: NDArray[np.int64], x: float, y: float) -> tuple[int, int, int]:
    """Return row, column and key of the cell at a point."""
    n = keys.shape[0]
    r, c = math.floor(y / CELL), math.floor(x / CELL)
    return r % n, c % n, (r << 32) ^ (c & 0xFFFFFFFF)


@njit(cache=True, nogil=True)
def _free_margin(bearing: Floats, ranges: Floats, i: int) -> float:
    """Return the distance before return i from which on its beam shows nothing, m.

    A beam that meets a wall at a small angle passes through its cells before: the margin grows with the distance of
    neighbouring returns, which is r dtheta at a right angle, and r dtheta / sin(angle) at another one.
    """
    if not ranges[i] < np.inf:
        return FREE_MARGIN
    step = np.inf
    for k in (i - 1, i + 1):
        if 0 <= k < len(ranges) and ranges[k] < np.inf:
            turn = bearing[k] - bearing[i]
            # law of cosines, between the two returns
            square = ranges[i] ** 2 + ranges[k] ** 2 - 2.0 * ranges[i] * ranges[k] * math.cos(turn)
            step = min(step, math.sqrt(max(square, 0.0)) / max(ranges[i] * abs(turn), 1e-6))
    return min(max(FREE_MARGIN * step, FREE_MARGIN), MAX_FREE_MARGIN) if step < np.inf else FREE_MARGIN


@njit(cache=True, nogil=True)
def _update(
    keys: NDArray[np.int64],
    static: NDArray[np.int16],
    free_at: Floats,
    hit_at: Floats,
    origin: Floats,
    bearing: Floats,
    ranges: Floats,
    start: Floats,
    end: Floats,
    people: NDArray[np.bool_],
    now: float,
    limit: float,
) -> None:
    """Enter an observation of n beams into the cells (k, k).

    origin: (2,) of the beams. bearing, ranges, start, end: (n,). people: (n,) returns of people, which are not part
    of the background. limit: distance beyond which nothing is entered, m.
    """
    # Returns first, so that beams that pass beside them do not free their cells.
    for i in range(len(ranges)):
        if not ranges[i] <= limit:
            continue
        x, y = origin[0] + ranges[i] * math.cos(bearing[i]), origin[1] + ranges[i] * math.sin(bearing[i])
        r, c, key = _cell_of(keys, x, y)
        if keys[r, c] != key:
            keys[r, c], static[r, c], free_at[r, c], hit_at[r, c] = key, 0, -np.inf, -np.inf
        if people[i]:
            static[r, c] = 0
        elif hit_at[r, c] < now:
            static[r, c] = min(static[r, c] + 1, MAX_STATIC_EVIDENCE)
        hit_at[r, c] = now
    # Free floor along the beams.
    for i in range(len(ranges)):
        last = min(end[i], limit) - _free_margin(bearing, ranges, i)
        ux, uy = math.cos(bearing[i]), math.sin(bearing[i])
        distance = max(start[i], CELL)
        while distance < last:
            r, c, key = _cell_of(keys, origin[0] + distance * ux, origin[1] + distance * uy)
            if keys[r, c] != key:
                keys[r, c], static[r, c], hit_at[r, c] = key, 0, -np.inf
                free_at[r, c] = now
            elif hit_at[r, c] < now - HIT_TIME:
                free_at[r, c] = now
                static[r, c] = max(static[r, c] - FREE_STEP, 0)
            distance += CELL


@njit(cache=True, nogil=True)
def _read(
    keys: NDArray[np.int64],
    static: NDArray[np.int16],
    free_at: Floats,
    points: Floats,
    after: float,
    was_free: NDArray[np.bool_],
    stays: NDArray[np.bool_],
) -> None:
    """Write for points (n, 2) whether the place was free after a time, and whether what is at or beside it stays."""
    n = keys.shape[0]
    for i in range(len(points)):
        was_free[i], stays[i] = False, False
        if not (abs(points[i, 0]) < 1e6 and abs(points[i, 1]) < 1e6):
            continue
        r, c, key = _cell_of(keys, points[i, 0], points[i, 1])
        was_free[i] = keys[r, c] == key and free_at[r, c] > after
        row, column = math.floor(points[i, 1] / CELL), math.floor(points[i, 0] / CELL)
        for nr in range(row - 1, row + 2):
            for nc in range(column - 1, column + 2):
                if (
                    keys[nr % n, nc % n] == (nr << 32) ^ (nc & 0xFFFFFFFF)
                    and static[nr % n, nc % n] >= STATIC_EVIDENCE
                ):
                    stays[i] = True


@njit(cache=True, nogil=True)
def _find_near_obstacles(
    cells: NDArray[np.int8],
    resolution: float,
    origin_x: float,
    origin_y: float,
    points: Floats,
    margin: Floats,
    near: NDArray[np.bool_],
) -> None:
    """Write for points (n, 2) on the map whether the centre of an obstacle's cell is within a margin (n,) of theirs.

    Only the cells around the points are read: a distance transform of each new map would take 0.1 s for 10^6 cells.
    """
    height, width = cells.shape
    for i in range(len(points)):
        near[i] = False
        x, y = points[i, 0] - origin_x, points[i, 1] - origin_y
        if not (abs(x) < MAX_COORDINATE and abs(y) < MAX_COORDINATE):
            continue
        row, column = math.floor(y / resolution), math.floor(x / resolution)
        if not (0 <= row < height and 0 <= column < width):
            continue
        reach = int(min(margin[i] / resolution, float(height + width)))
        for r in range(max(row - reach, 0), min(row + reach + 1, height)):
            for c in range(max(column - reach, 0), min(column + reach + 1, width)):
                distance = math.sqrt((r - row) ** 2 + (c - column) ** 2) * resolution
                if cells[r, c] >= OCCUPIED_THRESHOLD and distance <= margin[i]:
                    near[i] = True


class Background:
    """Evidence of what does not move, in the tracking frame, and the static map."""

    def __init__(self) -> None:
        self._keys = np.full((CELLS, CELLS), -1, np.int64)
        self._static = np.zeros((CELLS, CELLS), np.int16)
        self._free_at = np.full((CELLS, CELLS), -np.inf)
        self._hit_at = np.full((CELLS, CELLS), -np.inf)
        self._map: Grid | None = None

    def set_map(self, grid: Grid) -> None:
        """Set or replace the static map."""
        self._map = grid

    @property
    def has_map(self) -> bool:
        """Whether there is a static map."""
        return self._map is not None

    def update(self, observation: Observation, people: NDArray[np.bool_], now: float, limit: float) -> None:
        """Enter the returns that are not of people, (n,), and the free floor, at a time (s) up to `limit` metres."""
        sensor = observation.sensor
        _update(
            self._keys,
            self._static,
            self._free_at,
            self._hit_at,
            np.array([sensor.x, sensor.y]),
            observation.angles + sensor.yaw,
            observation.ranges,
            observation.start,
            observation.end,
            people,
            now,
            limit,
        )

    def was_free(self, points: Floats, after: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return whether points (n, 2) were free after a time (s), and whether something stays at or beside each."""
        was_free, stays = np.zeros(len(points), np.bool_), np.zeros(len(points), np.bool_)
        _read(self._keys, self._static, self._free_at, points, after, was_free, stays)
        return was_free, stays

    def forget_times(self) -> None:
        """Forget when places were free, after the clock was set back; what stays in them is kept."""
        self._free_at[:] = -np.inf
        self._hit_at[:] = -np.inf

    def on_map(
        self, points: Floats, map_T_frame: SE2 | None, margin: Floats
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which points (n, 2) lie within `margin` (n,) metres of a map obstacle, and which on free floor.

        Without a map or a transform none does either.
        """
        grid, near = self._map, np.zeros(len(points), np.bool_)
        if grid is None or map_T_frame is None:
            return near, near.copy()
        placed = map_T_frame.apply(points)
        origin = grid.origin_x, grid.origin_y
        _find_near_obstacles(
            grid.cells, grid.resolution, *origin, placed, np.asarray(margin, np.float64), near
        )
        x, y = placed.T
        known = grid.values(x, y, UNKNOWN) != UNKNOWN
        return near, np.asarray(known & ~near)
