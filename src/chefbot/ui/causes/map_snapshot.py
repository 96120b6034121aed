"""A picture of the map about the robot at the moment of a cause."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import SE2

WIDTH = 8.0
"""Width of the part of the map, m."""
PIXELS = 320
"""Width of the picture."""
UNKNOWN_COLOUR, FREE_COLOUR, WALL_COLOUR = (222, 224, 220), (250, 250, 248), (58, 66, 62)
ROBOT_COLOUR, OBSTACLE_COLOUR = (12, 118, 110), (200, 30, 30)
CROSS = 7
"""Half the width of the cross on the obstacle, pixels."""


def map_snapshot(grid: Grid, robot: SE2, radius: float, obstacle: tuple[float, float] | None) -> bytes:
    """Return a PNG of the map with the robot in its middle (radius in m), and a cross on the obstacle, if any."""
    picture = Image.fromarray(_map_about(grid, robot.x, robot.y))
    draw = ImageDraw.Draw(picture)
    size, middle = radius * PIXELS / WIDTH, PIXELS / 2
    draw.ellipse((middle - size, middle - size, middle + size, middle + size), outline=ROBOT_COLOUR, width=3)
    nose = (middle + size * np.cos(robot.yaw), middle - size * np.sin(robot.yaw))
    draw.line(((middle, middle), nose), fill=ROBOT_COLOUR, width=3)
    if obstacle is not None:
        x, y = _pixel(obstacle[0] - robot.x), _pixel(robot.y - obstacle[1])
        for side in (-CROSS, CROSS):
            draw.line(((x - CROSS, y - side), (x + CROSS, y + side)), fill=OBSTACLE_COLOUR, width=3)
    out = io.BytesIO()
    picture.save(out, "PNG")
    return out.getvalue()


def _map_about(grid: Grid, x: float, y: float) -> NDArray[np.uint8]:
    """Return the colours (PIXELS, PIXELS, 3) of the map about a point, the nearest cell of each pixel."""
    offsets = (np.arange(PIXELS) + 0.5) * WIDTH / PIXELS - WIDTH / 2
    height, width = grid.cells.shape
    columns = np.floor((x + offsets - grid.origin_x) / grid.resolution).clip(-1, width).astype(int)
    rows = np.floor((y - offsets - grid.origin_y) / grid.resolution).clip(-1, height).astype(int)
    values = grid.cells[np.ix_(rows.clip(0, height - 1), columns.clip(0, width - 1))]
    inside = np.logical_and.outer((rows >= 0) & (rows < height), (columns >= 0) & (columns < width))
    colours = np.full((PIXELS, PIXELS, 3), UNKNOWN_COLOUR, np.uint8)
    colours[inside & (values >= 0)] = FREE_COLOUR
    colours[inside & (values >= OCCUPIED_THRESHOLD)] = WALL_COLOUR
    return colours


def _pixel(metres: float) -> float:
    return PIXELS / 2 + metres * PIXELS / WIDTH
