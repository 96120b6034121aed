"""The built-in layers of the map, of the sensors, and of the inflation."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.costmap.conversions import ObstacleMarking, mark_laser, mark_obstacles
from chefbot.costmap.inflation import inflate
from chefbot.costmap.layer import CellMark, CostmapLayer, LayerSettings
from chefbot.costmap.ranger_marks import contact_radius, mark_contact, mark_range
from chefbot.costmap.sources import CONTACT, LASTING_SOURCES, RANGER
from chefbot.costmap.update_window import CellWindow
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan, Range

if TYPE_CHECKING:
    from chefbot.costmap.layered_costmap import LayeredCostmap

STATIC = "static"
"""Name of the static map as what marked a cell."""


class StaticLayer(CostmapLayer):
    """The static map, which all other layers overwrite."""

    def __init__(self, settings: LayerSettings) -> None:
        """Take the map from the costmap: it determines the size of all layers."""

    def process(self, costs: LayeredCostmap, message: Message, frame: SE2) -> None:  # noqa: ARG002
        """Set a new or grown map, unless the costmap is a window that follows the robot."""
        if isinstance(message, OccupancyGrid) and not costs.rolling:
            costs.set_static(message.grid)

    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Write the static map into the window; unknown cells become free unless they are tracked."""
        static = costs.static[window.slices]
        if costs.params.track_unknown:
            cells[window.slices] = static
        else:
            cells[window.slices] = np.where(static == UNKNOWN, FREE, static)

    def marks(self, costs: LayeredCostmap, row: int, column: int) -> list[CellMark]:
        """Name the map where it has an obstacle."""
        return [CellMark(STATIC, 0.0)] if costs.static[row, column] == LETHAL else []


class ObstacleLayer(CostmapLayer):
    """Obstacles that scans and depth images show, and the marks of all sources but those of the ranger."""

    def __init__(self, settings: LayerSettings) -> None:
        robot = settings.robot
        self._marking = None if robot is None else ObstacleMarking.of(robot, settings.drop_range)

    def process(self, costs: LayeredCostmap, message: Message, frame: SE2) -> None:
        """Mark and clear with a scan."""
        if isinstance(message, LaserScan):
            mark_laser(costs, frame, message)
        elif isinstance(message, ObstacleScan) and self._marking is not None:
            mark_obstacles(costs, frame, message, self._marking)

    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Merge the marks of all sources but ranger and contact into the window."""
        merge_sources(costs, _others(costs), cells, window)

    def marks(self, costs: LayeredCostmap, row: int, column: int) -> list[CellMark]:
        """Name the sources that have marked the cell."""
        return source_marks(costs, _others(costs), row, column)


class RangeSensorLayer(CostmapLayer):
    """Obstacles of the ranger's echoes, and those that the robot has touched."""

    def __init__(self, settings: LayerSettings) -> None:
        self._contact_radius = 0.0 if settings.robot is None else contact_radius(settings.robot)

    def process(self, costs: LayeredCostmap, message: Message, frame: SE2) -> None:
        """Mark and clear with an echo; mark where a contact was, with the motion that ended there as its pose."""
        if isinstance(message, Range):
            mark_range(costs, frame, message)
        elif isinstance(message, PoseStamped):
            mark_contact(costs, frame @ message.pose.se2, self._contact_radius)

    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Merge the marks of ranger and contact into the window."""
        merge_sources(costs, (RANGER, CONTACT), cells, window)

    def marks(self, costs: LayeredCostmap, row: int, column: int) -> list[CellMark]:
        """Name the sources that have marked the cell."""
        return source_marks(costs, (RANGER, CONTACT), row, column)


class InflationLayer(CostmapLayer):
    """Costs around the lethal cells of the layers below; those above are not inflated."""

    def __init__(self, settings: LayerSettings) -> None:
        """Take the costs by distance from the costmap, which knows the footprint."""

    def reach(self, costs: LayeredCostmap) -> int:
        """Return the inflation radius, cells."""
        return math.isqrt(len(costs.cost_table) - 1)

    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Inflate all cells and write those of the window, which their surroundings determine."""
        cells[window.slices] = inflate(cells, costs.cost_table)[window.slices]


def _others(costs: LayeredCostmap) -> tuple[str, ...]:
    return tuple(name for name in costs.sources if name not in LASTING_SOURCES)


def merge_sources(
    costs: LayeredCostmap, names: Iterable[str], cells: NDArray[np.uint8], window: CellWindow
) -> None:
    """Merge the marks of sources into a window: obstacles overwrite, free space replaces only unknown cells."""
    master: NDArray[np.uint8] | None = None
    for name in names:
        marks = costs.sources.get(name)
        if marks is not None:
            master = np.ascontiguousarray(cells[window.slices]) if master is None else master
            _merge(master.reshape(-1), np.ascontiguousarray(marks.cells[window.slices]).reshape(-1))
    if master is not None:
        cells[window.slices] = master


@njit(cache=True, nogil=True)
def _merge(master: NDArray[np.uint8], layer: NDArray[np.uint8]) -> None:
    """Merge the marks of a source into the costs."""
    for i in range(master.shape[0]):
        if layer[i] == LETHAL or (layer[i] == FREE and master[i] == UNKNOWN):
            master[i] = layer[i]


def source_marks(costs: LayeredCostmap, names: Iterable[str], row: int, column: int) -> list[CellMark]:
    """Return which of the sources have marked a cell, and when each did so last."""
    found = ((name, costs.sources[name]) for name in names if name in costs.sources)
    return [
        CellMark(name, float(source.marked_at[row, column]))
        for name, source in found
        if source.cells[row, column] == LETHAL
    ]


def built_in_layers(settings: LayerSettings) -> tuple[CostmapLayer, ...]:
    """Return the layers of a costmap without zones."""
    return tuple(kind(settings) for kind in (StaticLayer, ObstacleLayer, RangeSensorLayer, InflationLayer))
