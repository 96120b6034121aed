"""The layers of the zones of the map: keep-out and preferred areas, and one-way lanes."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.layer import CellMark, CostmapLayer, LayerSettings
from chefbot.costmap.update_window import CellWindow
from chefbot.maths.costs import LETHAL
from chefbot.maths.lanes import NO_LANES, OneWayLanes
from chefbot.maths.polygon import GridGeometry, cells_inside, cells_touched
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, PREFERRED, MapZone, MapZones
from chefbot.msgs.idl.message import Message

if TYPE_CHECKING:
    from chefbot.costmap.layered_costmap import LayeredCostmap

OTHER_COST = 84
"""Minimum cost outside preferred zones: with the planner's default `cost_weight` a path there costs twice as much."""
MAX_SHIFT_CELLS = 0.25
"""Motion of the zones in the costmap's frame, in cells, up to which they are not drawn again."""


class ZoneLayer(CostmapLayer):
    """Base class of a layer that draws the zones of one kind; without any it does nothing."""

    kind = ""

    def __init__(self, settings: LayerSettings) -> None:  # noqa: ARG002 (interface)
        self._zones: tuple[MapZone, ...] = ()
        self._frame = IDENTITY
        self._drawn: GridGeometry | None = None

    def process(self, costs: LayeredCostmap, message: Message, frame: SE2) -> None:
        """Set the zones, and where their frame is in the costmap: it moves as localization corrects the odometry."""
        if not isinstance(message, MapZones):
            return
        zones = message.of_kind(self.kind)
        if zones == self._zones and (not zones or not self._moved(costs, frame)):
            return
        self._zones, self._frame, self._drawn = zones, frame, None
        costs.note_all_changed()

    def _moved(self, costs: LayeredCostmap, frame: SE2) -> bool:
        """Return whether any cell of the costmap now covers a different place in the zones' frame."""
        if frame == self._frame:
            return False
        height, width = costs.shape
        middle = SE2(
            costs.origin_x + width * costs.resolution / 2.0,
            costs.origin_y + height * costs.resolution / 2.0,
            0.0,
        )
        motion = (self._frame.inverse() @ middle).between(frame.inverse() @ middle)
        turned = abs(motion.yaw) * max(height, width) * costs.resolution / math.sqrt(2.0)
        return math.hypot(motion.x, motion.y) + turned > MAX_SHIFT_CELLS * costs.resolution

    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Draw the zones if they or the costmap have changed, and write their costs."""
        if not self._zones:
            return
        if self._drawn != costs.geometry:
            self._drawn = costs.geometry
            self.draw(costs, [self._frame.apply(zone.array) for zone in self._zones])
        self.write(cells, window)

    @abstractmethod
    def draw(self, costs: LayeredCostmap, polygons: list[NDArray[np.float64]]) -> None:
        """Take the polygons of the zones, of which there is one at least, each (n, 2), in the costmap's frame, m."""

    def write(self, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Write the costs of the zones into a window."""


class KeepOutLayer(ZoneLayer):
    """Keep-out zones, lethal below the inflation, so that no part of the robot enters them."""

    kind = KEEP_OUT

    def draw(self, costs: LayeredCostmap, polygons: list[NDArray[np.float64]]) -> None:
        """Number the cells by the zone that covers or touches them, from 1 on, 0 for none."""
        self._number = np.zeros(costs.shape, np.uint16)
        for i, polygon in enumerate(polygons):
            self._number[cells_touched(polygon, costs.geometry)] = i + 1

    def write(self, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Make the cells of the zones lethal."""
        cells[window.slices][self._number[window.slices] > 0] = LETHAL

    def marks(self, costs: LayeredCostmap, row: int, column: int) -> list[CellMark]:
        """Name the zone of a cell."""
        number = int(self._number[row, column]) if self._zones and self._drawn == costs.geometry else 0
        return [CellMark(self._zones[number - 1].title, 0.0)] if number else []


class PreferredLayer(ZoneLayer):
    """Preferred zones: if there are any, all other free space costs more. Above the inflation."""

    kind = PREFERRED

    def draw(self, costs: LayeredCostmap, polygons: list[NDArray[np.float64]]) -> None:
        """Find the minimum cost of each cell."""
        self._lowest = np.full(costs.shape, OTHER_COST, np.uint8)
        for polygon in polygons:
            self._lowest[cells_inside(polygon, costs.geometry)] = 0

    def write(self, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Raise the costs outside the zones."""
        cells[window.slices] = np.maximum(cells[window.slices], self._lowest[window.slices])


class OneWayLayer(ZoneLayer):
    """One-way lanes, which do not change costs: a planner does not step against them."""

    kind = ONE_WAY

    def process(self, costs: LayeredCostmap, message: Message, frame: SE2) -> None:
        """Set the zones; without lanes there is nothing to draw."""
        super().process(costs, message, frame)
        if not self._zones:
            costs.lanes = NO_LANES

    def draw(self, costs: LayeredCostmap, polygons: list[NDArray[np.float64]]) -> None:
        """Set the lanes of the costmap."""
        number = np.zeros(costs.shape, np.uint8)
        for i, polygon in enumerate(polygons):
            number[cells_inside(polygon, costs.geometry)] = i + 1
        yaws = np.array([zone.direction + self._frame.yaw for zone in self._zones])
        directions = np.vstack([np.zeros((1, 2)), np.column_stack([np.cos(yaws), np.sin(yaws)])])
        costs.lanes = OneWayLanes(number, directions, tuple(zone.title for zone in self._zones))
