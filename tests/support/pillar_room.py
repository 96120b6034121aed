"""A room with a pillar, so that no two places in it look alike, and the scans of a laser in it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams

CORNERS = (-1.0, -2.0, 5.0, 3.0)
"""Two opposite corners of the room: x and y, m."""
PILLAR = (4.0, 2.0, 0.4)
"""Centre and radius of the pillar, m."""
ANGLES = np.linspace(-math.pi, math.pi, 180, endpoint=False)
"""Angles of the laser's beams, rad."""


def ranges_at(laser: SE2) -> NDArray[np.float32]:
    """Return the ranges (180,) of a laser at a pose in the room, m."""
    x0, y0, x1, y1 = CORNERS
    bearing = ANGLES + laser.yaw
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(bearing) > 0, x1 - laser.x, x0 - laser.x) / np.cos(bearing)
        to_y = np.where(np.sin(bearing) > 0, y1 - laser.y, y0 - laser.y) / np.sin(bearing)
    x, y, radius = PILLAR
    distance = np.hypot(y - laser.y, x - laser.x)
    turn = bearing - np.arctan2(y - laser.y, x - laser.x)
    off = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    pillar = np.where(off < math.asin(min(0.99, radius / distance)), distance - radius, np.inf)
    return np.minimum(np.minimum(to_x, to_y), pillar).astype(np.float32)


def circle(turns: float) -> list[SE2]:
    """Return poses 3 cm apart on a circle of 1 m radius to the left of the origin."""
    return [
        SE2(math.sin(angle), 1.0 - math.cos(angle), angle)
        for angle in np.arange(0.0, turns * 2 * math.pi, 0.03).tolist()
    ]


def mapped() -> Grid:
    """Return the map of the room that the particle filter makes on one circle."""
    slam = Gmapping(GmappingParams(particles=5))
    for pose in circle(1.0):
        slam.update(ANGLES.astype(np.float32), ranges_at(pose), pose)
    return slam.map()
