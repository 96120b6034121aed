"""The floor of a world at a person's height: where people fit, paths between destinations, doorways and corners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from chefbot.sim.people.distance_field import (
    Field,
    Floats,
    distance_at,
    free_range,
    is_visible,
    line_is_clear,
    lower_to_boxes,
)
from chefbot.sim.people.navigation_functions import UNREACHABLE, path_cost, spread, step_weights
from chefbot.sim.world.furniture import PERSON_HEIGHT, PERSON_RADIUS
from chefbot.sim.world.shapes import BOX, SimulatedShape

PATH_CELL = 0.1
"""Side of the cells of the navigation functions, m, in a world that is not large."""
FINER_CELLS = 2
"""Cells of the distance field along the side of one of these."""
MAX_PATH_CELLS = 250_000
"""Cells of a navigation function; in larger worlds they are larger, up to twice, and people stay near the start."""
REACH = 1.5
"""Metres up to which distances to obstacles are computed."""
STEP_HEIGHT = 0.03
"""Height up to which people step over an obstacle, m."""
MARGIN = 0.03
"""Metres that paths keep to obstacles beyond the radius of a person."""
DIGITS = 9
"""Decimal places of lengths in metres that people see of obstacles."""
MAX_DESTINATIONS = 96
"""Destinations for which navigation functions are kept."""
Point = tuple[float, float]
Bounds = tuple[float, float, float, float]


class PeopleFloor:
    """The floor between the solids that never move.

    solids: all that people must keep off. bounds: (x0, y0, x1, y1). start: the point of the floor, or near it, to
    which all of it is connected.
    """

    def __init__(self, solids: Sequence[SimulatedShape], bounds: Bounds, start: Point) -> None:
        x0, y0, x1, y1, cell = _region(bounds, start)
        height, width = math.ceil((y1 - y0) / cell), math.ceil((x1 - x0) / cell)
        self.start, self.path_frame = start, np.array([x0, y0, cell])
        self.frame = np.array([x0, y0, cell / FINER_CELLS])
        self.distance: Field = np.full((FINER_CELLS * height, FINER_CELLS * width), REACH, np.float32)
        self._weights = np.zeros((height, width), np.int32)
        self.path_costs: NDArray[np.int32] = np.zeros((MAX_DESTINATIONS, height, width), np.int32)
        self._destinations: list[Point] = []
        self._known = np.zeros(MAX_DESTINATIONS, np.bool_)
        lower_to_boxes(self.distance, self.frame, _border(self.frame, self.distance.shape), REACH)
        self.add(solids)

    def add(self, solids: Sequence[SimulatedShape]) -> None:
        """Add solids that stay where they are."""
        lower_to_boxes(self.distance, self.frame, solid_boxes(solids), REACH)
        self.obstruct(np.empty((0, 7)))

    @cached_property
    def cells(self) -> NDArray[np.int64]:
        """Cells (n, 2), row and column, where people fit, connected to the one nearest to the start."""
        cells = np.argwhere(self._weights > 0)
        if len(cells) == 0:
            return cells
        row, column = self.cell(*self.start)
        nearest = cells[int(np.argmin((cells[:, 0] - row) ** 2 + (cells[:, 1] - column) ** 2))]
        costs = np.empty_like(self._weights)
        spread(self._weights, int(nearest[0]), int(nearest[1]), costs)
        return np.argwhere(costs < UNREACHABLE)

    def obstruct(self, boxes: Floats) -> None:
        """Make the paths avoid what stands in them now: boxes (n, 7) as in `lower_to_boxes`."""
        distance = self.distance
        if len(boxes):
            distance = distance.copy()
            lower_to_boxes(distance, self.frame, boxes, REACH)
        radius = PERSON_RADIUS + MARGIN
        step_weights(distance, self.frame, self.path_frame, radius, self._weights)
        self._known[:] = False

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return row and column of the coarse cell that contains a point; it may lie outside the grid."""
        x0, y0, cell = self.path_frame.tolist()
        return math.floor((y - y0) / cell), math.floor((x - x0) / cell)

    def point(self, cell: NDArray[np.int64]) -> Point:
        """Return the centre of a cell, m."""
        x0, y0, side = self.path_frame.tolist()
        return x0 + (int(cell[1]) + 0.5) * side, y0 + (int(cell[0]) + 0.5) * side

    def draw_point(self, rng: Generator) -> Point:
        """Return a random point of the floor."""
        return self.point(self.cells[int(rng.integers(len(self.cells)))])

    def fits(self, x: float, y: float) -> bool:
        """Return whether a person fits at a point as doors and chairs are now."""
        row, column = self.cell(x, y)
        inside = 0 <= row < self._weights.shape[0] and 0 <= column < self._weights.shape[1]
        return inside and bool(self._weights[row, column] > 0)

    def free(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest solid, m."""
        return float(distance_at(self.distance, self.frame, x, y))

    def in_sight(self, x0: float, y0: float, x1: float, y1: float) -> bool:
        """Return whether no solid stands between two points."""
        return bool(is_visible(self.distance, self.frame, x0, y0, x1, y1))

    def is_clear(self, x0: float, y0: float, x1: float, y1: float, margin: float) -> bool:
        """Return whether the line between two points keeps `margin` metres to the solids."""
        return bool(line_is_clear(self.distance, self.frame, x0, y0, x1, y1, margin))

    def ray(self, x: float, y: float, ux: float, uy: float, limit: float) -> float:
        """Return how far a ray along the unit vector (ux, uy) gets, at most `limit` metres."""
        return float(free_range(self.distance, self.frame, x, y, ux, uy, limit))

    def add_destination(self, x: float, y: float) -> int:
        """Return the number of a new destination."""
        if len(self._destinations) == MAX_DESTINATIONS:
            raise ValueError(f"people have at most {MAX_DESTINATIONS} destinations")
        self._destinations.append((x, y))
        return len(self._destinations) - 1

    def destination(self, number: int) -> Point:
        """Return the point of a destination."""
        return self._destinations[number]

    def path_length(self, number: int, x: float, y: float) -> float:
        """Return the length of the path from (x, y) to a destination, m, longer along walls; inf if there is none."""
        if not self._known[number]:
            self._compute_path_costs(number)
        cost = int(path_cost(self.path_costs[number], self.path_frame, x, y))
        return math.inf if cost >= UNREACHABLE else cost * float(self.path_frame[2]) / 10.0

    def _compute_path_costs(self, number: int) -> None:
        self._known[number] = True
        row, column = self.cell(*self._destinations[number])
        if self.fits(*self._destinations[number]):
            spread(self._weights, row, column, self.path_costs[number])
        else:
            self.path_costs[number] = UNREACHABLE


def _region(bounds: Bounds, start: Point) -> tuple[float, float, float, float, float]:
    """Return the rectangle in which people walk and the side of its cells, m."""
    x0, y0, x1, y1 = bounds
    area = (x1 - x0) * (y1 - y0)
    cell = min(max(PATH_CELL, math.sqrt(area / MAX_PATH_CELLS)), 2.0 * PATH_CELL)
    half = 0.5 * cell * math.sqrt(MAX_PATH_CELLS)
    if area > MAX_PATH_CELLS * cell * cell:
        x0, x1 = max(x0, start[0] - half), min(x1, start[0] + half)
        y0, y1 = max(y0, start[1] - half), min(y1, start[1] + half)
    return x0, y0, x1, y1, cell


def _border(frame: Floats, shape: tuple[int, ...]) -> Floats:
    """Return the four sides of the grid as boxes (4, 7) without width: nobody leaves it."""
    x0, y0, cell = frame.tolist()
    width, height = 0.5 * shape[1] * cell, 0.5 * shape[0] * cell
    x, y = x0 + width, y0 + height
    sides = [(x, y0, width, 0.0), (x, y0 + 2 * height, width, 0.0)]
    sides += [(x0, y, 0.0, height), (x0 + 2 * width, y, 0.0, height)]
    return np.array([(*side, 1.0, 0.0, 0.0) for side in sides])


def solid_boxes(solids: Sequence[SimulatedShape]) -> Floats:
    """Return the solids at the height of a person as boxes (n, 7) with rounding; round ones have no sides."""
    rows = [
        (s.x, s.y, s.half[0], s.half[1], math.cos(s.yaw), math.sin(s.yaw), 0.0)
        if s.kind == BOX
        else (s.x, s.y, 0.0, 0.0, 1.0, 0.0, s.half[0])
        for s in solids
        if s.bottom < PERSON_HEIGHT and s.top > STEP_HEIGHT
    ]
    # The last digits of the cosines depend on the processor.
    return np.round(np.array(rows, dtype=np.float64).reshape(-1, 7), DIGITS)
