"""The layer of glass walls, which a lidar measures only where its beams meet them at nearly a right angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.glass_detection import GlassDetector, beams_of
from chefbot.costmap.layer import CellMark, CostmapLayer, LayerSettings
from chefbot.costmap.layers import merge_sources, source_marks
from chefbot.costmap.reflections import MAX_DISTANCE
from chefbot.costmap.sources import GLASS
from chefbot.costmap.update_window import CellWindow
from chefbot.maths.costs import LETHAL, UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import LaserScan

if TYPE_CHECKING:
    from chefbot.costmap.layered_costmap import LayeredCostmap

Floats = NDArray[np.float64]

CLEARING_INCIDENCE = 0.04
"""Angle of incidence up to which glass returns a beam: one that passes shows that there is none, rad."""
CLEARING_DEPTH = 0.25
"""Distance behind a mark from which on a beam has passed it, m."""
MAX_PASSES = 3
"""Number of scans with such a beam after which a mark goes."""


class GlassLayer(CostmapLayer):
    """Marks of the glass walls in a lidar's scans, which beams at a right angle clear, and the robot where it is."""

    def __init__(self, settings: LayerSettings) -> None:
        robot = settings.robot
        self._has_lidar = robot is not None and robot.sensors.lidar is not None
        self._detector = GlassDetector()
        self._marks: Floats = np.zeros((0, 4))
        """x, y (m), direction of the normal (rad) and number of beams that passed of each mark."""

    def process(self, costs: LayeredCostmap, message: Message, frame: SE2) -> None:
        """Mark the glass that a scan shows, and clear what its beams pass at a right angle."""
        if not (self._has_lidar and isinstance(message, LaserScan)):
            return
        glass_points = self._detector.process_scan(frame, message)
        if len(self._marks):
            self._clear(costs, frame, *beams_of(message))
        for glass in glass_points:
            self._mark(costs, frame, glass.points, glass.normal)

    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Merge the marks into the window."""
        merge_sources(costs, (GLASS,), cells, window)

    def marks(self, costs: LayeredCostmap, row: int, column: int) -> list[CellMark]:
        """Name glass where it has marked the cell."""
        return source_marks(costs, (GLASS,), row, column)

    def _mark(self, costs: LayeredCostmap, sensor: SE2, points: Floats, normal: float) -> None:
        """Mark the cells of points (n, 2), m, that are not marked."""
        rows, columns, inside = _cells(costs, points)
        points, rows, columns = points[inside], rows[inside], columns[inside]
        cells = costs.source_cells(GLASS)
        _, first = np.unique(rows * cells.shape[1] + columns, return_index=True)
        new = first[cells[rows[first], columns[first]] != LETHAL]
        cells[rows[first], columns[first]] = LETHAL
        costs.note_marks(GLASS, (rows[first], columns[first]))
        added = np.column_stack([points[new], np.full(len(new), normal), np.zeros(len(new))])
        self._marks = np.vstack([self._marks, added])
        reach = np.hypot(points[:, 0] - sensor.x, points[:, 1] - sensor.y).max(initial=0.0)
        costs.note_change(sensor, float(reach) + costs.resolution)

    def _clear(self, costs: LayeredCostmap, sensor: SE2, angles: Floats, ranges: Floats) -> None:
        """Clear the marks that beams have passed at a right angle in MAX_PASSES scans."""
        cells = costs.source_cells(GLASS)
        rows, columns, inside = _cells(costs, self._marks[:, :2])
        inside[inside] = cells[rows[inside], columns[inside]] == LETHAL
        self._marks, rows, columns = self._marks[inside], rows[inside], columns[inside]
        self._marks[:, 3] += _are_passed(self._marks, sensor, angles, ranges)
        gone = self._marks[:, 3] >= MAX_PASSES
        if gone.any():
            cells[rows[gone], columns[gone]] = UNKNOWN
            self._marks = self._marks[~gone]
            costs.note_change(sensor, MAX_DISTANCE + costs.resolution)


def _cells(
    costs: LayeredCostmap, points: Floats
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Return rows and columns of points (n, 2), m, and which are in the costmap."""
    rows = np.floor((points[:, 1] - costs.origin_y) / costs.resolution).astype(np.int64)
    columns = np.floor((points[:, 0] - costs.origin_x) / costs.resolution).astype(np.int64)
    h, w = costs.shape
    return rows, columns, (rows >= 0) & (rows < h) & (columns >= 0) & (columns < w)


def _are_passed(marks: Floats, sensor: SE2, angles: Floats, ranges: Floats) -> NDArray[np.bool_]:
    """Return which marks (n, 4) a beam at nearly a right angle has passed, and the beams beside it, too."""
    step = (angles[-1] - angles[0]) / (len(angles) - 1) if len(angles) > 1 else 0.0
    if step == 0.0:
        return np.zeros(len(marks), np.bool_)
    away = marks[:, :2] - np.array([sensor.x, sensor.y])
    distance, bearing = np.hypot(away[:, 0], away[:, 1]), np.arctan2(away[:, 1], away[:, 0])
    is_normal = np.abs(np.sin(bearing - marks[:, 2])) <= CLEARING_INCIDENCE
    is_normal &= distance <= MAX_DISTANCE
    turn = np.mod(np.sign(step) * (bearing - sensor.yaw - angles[0]), 2.0 * np.pi)  # clockwise lidars, too
    beam = np.round(turn / abs(step)).astype(np.int64)
    passed = is_normal & (beam >= 1) & (beam < len(angles) - 1)
    for i in (-1, 0, 1):
        near = ranges[np.clip(beam + i, 0, len(ranges) - 1)]
        passed &= near > distance + CLEARING_DEPTH  # false for NaN
    return passed
