"""The master costmap: layers merged and inflated, incrementally where they have changed."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.costmap.inflation import inflate
from chefbot.costmap.unknown_space import cells_near_unknown
from chefbot.costmap.update_window import EMPTY_WINDOW, CellWindow
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN


class MasterCostmap:
    """Merged and inflated costs (h, w) of the layers, bit-identical to a full recalculation at every update.

    table: cost by squared distance to the nearest obstacle, see `inflation.cost_table`. unseen_radius: distance in
    cells that the robot's centre keeps from unknown space; 0 for none.
    """

    def __init__(self, shape: tuple[int, ...], table: NDArray[np.uint8], unseen_radius: float) -> None:
        self._table = table
        self._unseen_radius = unseen_radius
        self._master = np.full(shape, FREE, np.uint8)
        self._inflated = np.full(shape, FREE, np.uint8)
        self._near_unknown = np.zeros(shape, np.bool_)
        self.costs = np.full(shape, FREE, np.uint8) if unseen_radius else self._inflated
        self._changed = CellWindow(0, 0, *shape)

    def touch(self, window: CellWindow) -> None:
        """Add a window in which layers may have changed; cells outside the grid are ignored."""
        self._changed = self._changed.union(window.expanded(0, self._master.shape))

    def update(
        self, static: NDArray[np.uint8], layers: Iterable[NDArray[np.uint8]], track_unknown: bool
    ) -> None:
        """Update `costs` from the layers in the changed window."""
        window, self._changed = self._changed, EMPTY_WINDOW
        if window.empty:
            return
        old = self._master[window.slices]
        new = _merge_layers(static, layers, window, track_unknown)
        same_unknown = np.array_equal(old == UNKNOWN, new == UNKNOWN)
        self._master[window.slices] = new
        affected = self._inflate(window)
        if self._unseen_radius:
            self._add_unknown_margin(affected, same_unknown)

    def _inflate(self, window: CellWindow) -> CellWindow:
        """Inflate around the window and return the affected window: changes spread by one inflation radius.

        The costs in there depend on cells another inflation radius away.
        """
        radius = math.isqrt(len(self._table) - 1)
        affected = window.expanded(radius, self._master.shape)
        source = affected.expanded(radius, self._master.shape)
        inflated = inflate(np.ascontiguousarray(self._master[source.slices]), self._table)
        self._inflated[affected.slices] = inflated[affected.relative_to(source).slices]
        return affected

    def _add_unknown_margin(self, window: CellWindow, same_unknown: bool) -> None:
        """Raise the costs near unknown space; recalculated for the whole grid if any cell changed from or to unknown.

        The size of an unknown region depends on all of its cells.
        """
        if not same_unknown:
            self._near_unknown = cells_near_unknown(self._master, self._unseen_radius)
            window = CellWindow(0, 0, *self._master.shape)
        costs = self._inflated[window.slices].copy()
        costs[self._near_unknown[window.slices] & (costs < INSCRIBED)] = INSCRIBED
        self.costs[window.slices] = costs


def _merge_layers(
    static: NDArray[np.uint8], layers: Iterable[NDArray[np.uint8]], window: CellWindow, track_unknown: bool
) -> NDArray[np.uint8]:
    """Merge the layers over the static map in the window, without inflation."""
    master = static[window.slices].copy()
    for layer in layers:
        _merge_layer(master.reshape(-1), np.ascontiguousarray(layer[window.slices]).reshape(-1))
    if not track_unknown:
        master[master == UNKNOWN] = FREE
    return master


@njit(cache=True, nogil=True)
def _merge_layer(master: NDArray[np.uint8], layer: NDArray[np.uint8]) -> None:
    """Merge a layer into the master: its obstacles overwrite, its free space replaces only unknown cells."""
    for i in range(master.shape[0]):
        if layer[i] == LETHAL or (layer[i] == FREE and master[i] == UNKNOWN):
            master[i] = layer[i]
