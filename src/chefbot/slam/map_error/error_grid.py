"""The estimated error of a map as a grid, for display beside the map."""

from __future__ import annotations

import numpy as np

from chefbot.maths.grid import UNKNOWN, Grid
from chefbot.slam.map_error.estimate import REGION, MapErrorEstimate

MAX_VALUE = 100
"""Value of errors from 1 m on."""


def error_grid(estimate: MapErrorEstimate) -> Grid:
    """Return cells of REGION m with the error in cm, at most MAX_VALUE; UNKNOWN where no region is."""
    corners = np.array([(region.x, region.y) for region in estimate.regions])
    errors = 100.0 * np.array([region.error for region in estimate.regions])
    low = corners.min(axis=0)
    columns, rows = np.round((corners - low) / REGION).astype(int).T
    cells = np.full((rows.max() + 1, columns.max() + 1), UNKNOWN, np.int8)
    cells[rows, columns] = np.minimum(np.round(errors), MAX_VALUE)
    return Grid(cells, REGION, float(low[0]), float(low[1]))
