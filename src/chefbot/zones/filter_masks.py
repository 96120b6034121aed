"""Zones as the filter masks of Nav2's costmap filters, which RViz displays as maps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from chefbot.maths.grid import Grid
from chefbot.maths.polygon import GridGeometry, cells_inside, cells_touched
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, PREFERRED, SLOW_ZONE, MapZones

KEEP_OUT_FILTER, SPEED_FILTER = 0, 2
"""Types of nav2_msgs/CostmapFilterInfo: keep-out and preferred areas; maximum speed, m/s."""
KEEP_OUT_OCCUPANCY, OTHER_OCCUPANCY = 100, 33
"""Occupancy in a keep-out zone, and outside preferred zones if there are any, percent."""


class FilterMask(NamedTuple):
    """A filter mask: the value of a cell is `multiplier` times its occupancy."""

    type: int
    grid: Grid
    multiplier: float


def keep_out_mask(zones: MapZones, map_grid: Grid) -> FilterMask:
    """Return the mask of Nav2's KeepoutFilter for keep-out and preferred zones, of the size of the map."""
    geometry = _geometry(map_grid)
    preferred = zones.of_kind(PREFERRED)
    cells = np.full(map_grid.cells.shape, OTHER_OCCUPANCY if preferred else 0, np.int8)
    for zone in preferred:
        cells[cells_inside(zone.array, geometry)] = 0
    for zone in zones.of_kind(KEEP_OUT):
        cells[cells_touched(zone.array, geometry)] = KEEP_OUT_OCCUPANCY
    return FilterMask(KEEP_OUT_FILTER, _like(map_grid, cells), 1.0)


def speed_mask(zones: MapZones, map_grid: Grid) -> FilterMask:
    """Return the mask of Nav2's SpeedFilter, in hundredths of the fastest slow zone; 0 is no limit."""
    geometry, slow = _geometry(map_grid), zones.of_kind(SLOW_ZONE)
    fastest = max((zone.speed for zone in slow), default=1.0)
    cells = np.zeros(map_grid.cells.shape, np.int8)
    for zone in sorted(slow, key=lambda zone: -zone.speed):  # the slowest of several counts
        cells[cells_inside(zone.array, geometry)] = max(1, int(100.0 * zone.speed / fastest))
    return FilterMask(SPEED_FILTER, _like(map_grid, cells), fastest / 100.0)


def _geometry(grid: Grid) -> GridGeometry:
    return GridGeometry(grid.resolution, grid.origin_x, grid.origin_y, grid.height, grid.width)


def _like(grid: Grid, cells: np.ndarray[tuple[int, ...], np.dtype[np.int8]]) -> Grid:
    return Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)
