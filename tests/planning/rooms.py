"""Grids of simple rooms, with 5 cm cells and walls of 10 cm; the origin is the inner lower left corner."""

from __future__ import annotations

import numpy as np

from chefbot.maths.grid import FREE, OCCUPIED, Grid

RESOLUTION = 0.05
WALL = 2


def walled(width: float, height: float) -> Grid:
    """Return an empty room."""
    columns, rows = round(width / RESOLUTION), round(height / RESOLUTION)
    cells = np.full((rows + 2 * WALL, columns + 2 * WALL), OCCUPIED, np.int8)
    cells[WALL:-WALL, WALL:-WALL] = FREE
    return Grid(cells, RESOLUTION, -WALL * RESOLUTION, -WALL * RESOLUTION)


def corridor(width: float) -> Grid:
    """Return a corridor of 10 m along x with its ends open."""
    grid = walled(10.0, width)
    grid.cells[WALL:-WALL] = FREE
    return grid


def two_rooms(door: float) -> Grid:
    """Return two rooms of 4 m x 4 m side by side with a doorway of this width in the middle of their wall, x = 4."""
    grid = walled(8.0, 4.0)
    column = WALL + round(4.0 / RESOLUTION)
    grid.cells[:, column - 1 : column + 1] = OCCUPIED
    low, high = (WALL + round((2.0 + side * door / 2.0) / RESOLUTION) for side in (-1, 1))
    grid.cells[low:high, column - 1 : column + 1] = FREE
    return grid
