"""A world from a map: occupied cells become walls, merged to as few boxes as a greedy pass finds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.sim.shapes import Shape, box, clearance
from chefbot.sim.world import MAX_SHAPES, ROBOT_SPACE, World

OCCUPIED_FROM = 65
"""Percent from which a cell is a wall, as ROS's map_server reads maps."""
WALL_COLOUR = (200, 195, 185)

Rectangle = tuple[int, int, int, int]
"""First row, first column, rows, columns."""


def world_from_map(
    name: str,
    grid: Grid,
    start: SE2 = IDENTITY,
    height: float = 1.0,
    places: dict[str, SE2] | None = None,
) -> World:
    """Every occupied cell as a wall of `height` metres; the robot starts at `start` in the map's frame.

    Unknown cells stay empty. places: named poses besides `home`, which is the start. Raises UserError for a
    map with more than 20 000 boxes, and for a start off the map or in a wall.
    """
    if not 0.0 < height <= 20.0:
        raise UserError(f"map {name}: walls of {height} m are not between 0 and 20 m")
    rectangles = greedy_rectangles(grid.cells >= OCCUPIED_FROM)
    if len(rectangles) > MAX_SHAPES:
        raise UserError(f"map {name}: {len(rectangles)} boxes are too many to simulate; clean or coarsen it")
    walls = tuple(_wall(grid, r, height, f"wall_{i}") for i, r in enumerate(rectangles))
    _check_start(grid, walls, start, name)
    bounds = (
        grid.origin_x,
        grid.origin_y,
        grid.origin_x + grid.width * grid.resolution,
        grid.origin_y + grid.height * grid.resolution,
    )
    return World(name, walls, (), (), 0, {**(places or {}), "home": start}, bounds)


def greedy_rectangles(occupied: NDArray[np.bool_]) -> list[Rectangle]:
    """Rectangles that cover each true cell once: the first one left, as far right, then up, as it goes."""
    left = occupied.copy()
    rectangles: list[Rectangle] = []
    for row, column in np.argwhere(occupied).tolist():
        if not left[row, column]:
            continue
        width = _run(left[row, column:])
        height = 1
        while row + height < len(left) and left[row + height, column : column + width].all():
            height += 1
        left[row : row + height, column : column + width] = False
        rectangles.append((row, column, height, width))
    return rectangles


def _run(cells: NDArray[np.bool_]) -> int:
    """How many are true from the first on."""
    return len(cells) if cells.all() else int(np.argmin(cells))


def _wall(grid: Grid, rectangle: Rectangle, height: float, name: str) -> Shape:
    row, column, rows, columns = rectangle
    x = grid.origin_x + (column + columns / 2) * grid.resolution
    y = grid.origin_y + (row + rows / 2) * grid.resolution
    size = (columns * grid.resolution, rows * grid.resolution, height)
    return box(name, SE2(x, y, 0.0), 0.0, size, WALL_COLOUR)


def _check_start(grid: Grid, walls: tuple[Shape, ...], start: SE2, name: str) -> None:
    if not grid.contains(start.x, start.y):
        raise UserError(
            f"map {name}: the start ({start.x:.2f}, {start.y:.2f}) lies off the map; give another"
        )
    if clearance(walls, start.x, start.y, *ROBOT_SPACE) <= 0.0:
        raise UserError(f"map {name}: the start ({start.x:.2f}, {start.y:.2f}) lies in a wall; give another")
