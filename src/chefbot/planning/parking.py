"""Places where a robot can stand for a long time without blocking people, on an occupancy grid.

A parking place lies at a wall, away from the places where people are served, and the passage beside it stays open:
where people of a given width could walk between two sides of it before, they still can. That test finds doorways,
narrow corridors and the gaps between tables alike, without a width that would define them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import FREE, Grid
from chefbot.maths.se2 import SE2

PERSON_WIDTH = 0.6
"""Width that a person needs to pass, m."""
PASSING_WIDTHS = (0.9, PERSON_WIDTH)
"""Widths that stay free beside a parked robot if they were, m: a wheelchair (ISO 21542), a person."""
WALL_GAP = 0.1
"""Distance of the parked robot from the wall, m."""
WALL_SLACK = 0.25
"""Distance in addition to the gap up to which the robot stands at the wall, m."""
WALL_SIZE = 0.8
"""Extent of what counts as a wall and not as the leg of a chair, m."""
PLACE_DISTANCE = 0.5
"""Distance of the parked robot's edge from the places where people are served, m."""
SMALLEST_SIDE = 0.02
"""Area from which a part of the floor is a side where somebody may come from, m^2."""
SURROUNDINGS = 0.6
"""Width of the ring around the robot and the people beside it in which the passage is looked for, m."""
MAX_TESTS = 5000


class ParkingPlace(NamedTuple):
    """A place to park: its pose, and the length of the path to it, m."""

    pose: SE2
    length: float


class ParkingSearch:
    """Finds parking places of a robot of `radius` (m) on a grid, away from the poses `kept_free`."""

    def __init__(self, grid: Grid, radius: float, kept_free: tuple[SE2, ...] = ()) -> None:
        self._grid, self._radius = grid, radius
        free = grid.cells == FREE
        self._clearance = _distance(~free) * grid.resolution
        wall = _distance(_large(~free, WALL_SIZE / grid.resolution)) * grid.resolution
        nearest = radius + WALL_GAP
        self._allowed = (self._clearance >= nearest) & (wall <= nearest + WALL_SLACK)
        self._allowed &= ~_near(kept_free, radius + PLACE_DISTANCE, grid)

    def nearest(self, lengths: NDArray[np.float32]) -> ParkingPlace | None:
        """Return the nearest place by the lengths (h, w) of the paths, inf where there is none; None without one.

        The robot looks away from the wall, so that it sees people approach.
        """
        for row, column in self._candidates(lengths):
            if self.leaves_room_to_pass(row, column):
                pose = SE2(*self._grid.centre(row, column), self._away_from_wall(row, column))
                return ParkingPlace(pose, float(lengths[row, column]))
        return None

    def leaves_room_to_pass(self, row: int, column: int, widths: tuple[float, ...] = PASSING_WIDTHS) -> bool:
        """Return whether people of these widths (m) pass a robot on this cell, wherever they could without it."""
        return all(self._is_passable(row, column, width / 2.0) for width in widths)

    def _candidates(self, lengths: NDArray[np.float32]) -> Iterator[tuple[int, int]]:
        rows, columns = np.nonzero(self._allowed & np.isfinite(lengths))
        order = np.argsort(lengths[rows, columns], kind="stable")
        for i in order[:: 1 + len(order) // MAX_TESTS].tolist():
            yield int(rows[i]), int(columns[i])

    def _is_passable(self, row: int, column: int, half_width: float) -> bool:
        """Return whether the centres of people around the robot stay connected, where they were."""
        blocked = (self._radius + half_width) / self._grid.resolution
        size = math.ceil(blocked + SURROUNDINGS / self._grid.resolution)
        top, left = max(0, row - size), max(0, column - size)
        walked = self._clearance[top : row + size + 1, left : column + size + 1] >= half_width
        rows, columns = np.indices(walked.shape)
        beside = np.hypot(rows - (row - top), columns - (column - left)) > blocked
        return self._sides(walked & beside) <= self._sides(walked)

    def _sides(self, walked: NDArray[np.bool_]) -> int:
        """Return the number of connected parts that are large enough to come from."""
        from scipy import ndimage

        labels, count = ndimage.label(walked, np.ones((3, 3)))
        areas = np.bincount(labels.ravel(), minlength=count + 1)[1:] * self._grid.resolution**2
        return int(np.count_nonzero(areas >= SMALLEST_SIDE))

    def _away_from_wall(self, row: int, column: int) -> float:
        """Return the direction in which the clearance grows, rad."""
        known = np.pad(self._clearance, 1, mode="edge")[row : row + 3, column : column + 3]
        return math.atan2(known[2, 1] - known[0, 1], known[1, 2] - known[1, 0])


def _distance(cells: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the distance of every cell to the nearest given one or to the edge of the grid, in cells."""
    from scipy import ndimage  # takes half a second

    distance: NDArray[np.float64] = ndimage.distance_transform_edt(~np.pad(cells, 1, constant_values=True))
    return distance[1:-1, 1:-1]


def _large(cells: NDArray[np.bool_], size: float) -> NDArray[np.bool_]:
    """Return the cells of connected parts that extend over at least `size` cells."""
    from scipy import ndimage

    labels, count = ndimage.label(cells, np.ones((3, 3)))
    kept = np.zeros(count + 1, np.bool_)
    for label, window in enumerate(ndimage.find_objects(labels), 1):
        kept[label] = max(part.stop - part.start for part in window) >= size
    large: NDArray[np.bool_] = kept[labels]
    return large


def _near(poses: tuple[SE2, ...], distance: float, grid: Grid) -> NDArray[np.bool_]:
    """Return the cells that lie within `distance` (m) of one of the poses."""
    rows, columns = np.indices(grid.cells.shape)
    near = np.zeros(grid.cells.shape, np.bool_)
    for pose in poses:
        row, column = grid.cell(pose.x, pose.y)
        near |= np.hypot(rows - row, columns - column) * grid.resolution < distance
    return near
