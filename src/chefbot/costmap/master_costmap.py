"""The master costmap: the costs of all layers, updated where they have changed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from chefbot.costmap.layer import CostmapLayer
from chefbot.costmap.unknown_space import cells_near_unknown
from chefbot.costmap.update_window import EMPTY_WINDOW, CellWindow
from chefbot.maths.costs import FREE, INSCRIBED, UNKNOWN

if TYPE_CHECKING:
    from chefbot.costmap.layered_costmap import LayeredCostmap


class MasterCostmap:
    """Costs (h, w) of the layers, bit-identical to a full recalculation at every update.

    A layer with a reach, such as the inflation, needs the costs below it unchanged by itself: it writes into a copy
    of its own. unseen_radius: distance in cells that the robot's centre keeps from unknown space; 0 for none.
    """

    def __init__(self, costs: LayeredCostmap, layers: Sequence[CostmapLayer], unseen_radius: float) -> None:
        self._layers = [(layer, layer.reach(costs)) for layer in layers]
        self._unseen_radius = unseen_radius
        spreading = sum(reach > 0 for _, reach in self._layers)
        self._copies = [np.full(costs.shape, FREE, np.uint8) for _ in range(spreading + 1)]
        self._near_unknown = np.zeros(costs.shape, np.bool_)
        self.costs = np.full(costs.shape, FREE, np.uint8) if unseen_radius else self._copies[-1]
        self._changed = CellWindow(0, 0, *costs.shape)

    def touch(self, window: CellWindow) -> None:
        """Add a window in which layers may have changed; cells outside the grid are ignored."""
        self._changed = self._changed.union(window.expanded(0, self.costs.shape))

    def update(self, costs: LayeredCostmap) -> None:
        """Update `self.costs` from the layers in the changed window."""
        window, self._changed = self._changed, EMPTY_WINDOW
        if window.empty:
            return
        level, cells, changed = 0, self._copies[0], window
        unknown = cells[changed.slices] == UNKNOWN if self._unseen_radius else None
        cells[changed.slices] = UNKNOWN if costs.params.track_unknown else FREE
        for layer, reach in self._layers:
            if reach:
                window = self._spread(costs, layer, reach, level, window)
                level, cells = level + 1, self._copies[level + 1]
            else:
                layer.update_costs(costs, cells, window)
        if unknown is not None:
            same = np.array_equal(unknown, self._copies[0][changed.slices] == UNKNOWN)
            self._add_unknown_margin(window, same)

    def _spread(
        self, costs: LayeredCostmap, layer: CostmapLayer, reach: int, level: int, window: CellWindow
    ) -> CellWindow:
        """Update a layer with a reach, and return the window that it affects: changes spread by its reach.

        The costs in there depend on cells another reach away.
        """
        affected = window.expanded(reach, self.costs.shape)
        source = affected.expanded(reach, self.costs.shape)
        cells, inner = self._copies[level][source.slices].copy(), affected.relative_to(source)
        layer.update_costs(costs, cells, inner)
        self._copies[level + 1][affected.slices] = cells[inner.slices]
        return affected

    def _add_unknown_margin(self, window: CellWindow, same_unknown: bool) -> None:
        """Raise the costs near unknown space; recalculated for the whole grid if any cell changed from or to unknown.

        The size of an unknown region depends on all of its cells.
        """
        if not same_unknown:
            self._near_unknown = cells_near_unknown(self._copies[0], self._unseen_radius)
            window = CellWindow(0, 0, *self.costs.shape)
        costs = self._copies[-1][window.slices].copy()
        costs[self._near_unknown[window.slices] & (costs < INSCRIBED)] = INSCRIBED
        self.costs[window.slices] = costs
