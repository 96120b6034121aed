"""The layers of a costmap put together and inflated again where they have changed."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.costmap.inflation import inflate
from chefbot.costmap.unknown_space import beside_unseen
from chefbot.costmap.update_window import NOTHING, Window
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN


class Combined:
    """Costs (h, w) of the layers of one frame, with the same bytes as if all were done again every time.

    table: cost by squared distance to the next obstacle, see `inflation.cost_table`. unseen_radius: cells
    that the robot's middle keeps from what nothing has seen; 0 for none.
    """

    def __init__(self, shape: tuple[int, ...], table: NDArray[np.uint8], unseen_radius: float) -> None:
        self._table = table
        self._unseen_radius = unseen_radius
        self._master = np.full(shape, FREE, np.uint8)
        self._inflated = np.full(shape, FREE, np.uint8)
        self._beside_unseen = np.zeros(shape, np.bool_)
        self.costs = np.full(shape, FREE, np.uint8) if unseen_radius else self._inflated
        self._changed = Window(0, 0, *shape)

    def touch(self, window: Window) -> None:
        """What the layers say in there may have changed; cells off the grid do not matter."""
        self._changed = self._changed.joined(window.grown(0, self._master.shape))

    def update(
        self, static: NDArray[np.uint8], layers: Iterable[NDArray[np.uint8]], track_unknown: bool
    ) -> None:
        """Bring `costs` up to date with the layers."""
        window, self._changed = self._changed, NOTHING
        if window.empty:
            return
        old = self._master[window.slices]
        new = _combined(static, layers, window, track_unknown)
        same_unknown = np.array_equal(old == UNKNOWN, new == UNKNOWN)
        self._master[window.slices] = new
        around = self._inflate(window)
        if self._unseen_radius:
            self._keep_from_unseen(around, same_unknown)

    def _inflate(self, window: Window) -> Window:
        """Costs change as far about the window as inflation reaches, and come from as far again; the former."""
        reach = math.isqrt(len(self._table) - 1)
        around = window.grown(reach, self._master.shape)
        source = around.grown(reach, self._master.shape)
        inflated = inflate(np.ascontiguousarray(self._master[source.slices]), self._table)
        self._inflated[around.slices] = inflated[around.seen_from(source).slices]
        return around

    def _keep_from_unseen(self, window: Window, same_unknown: bool) -> None:
        """How large an unseen region is depends on all of it: all costs, where a cell was seen first or lost."""
        if not same_unknown:
            self._beside_unseen = beside_unseen(self._master, self._unseen_radius)
            window = Window(0, 0, *self._master.shape)
        costs = self._inflated[window.slices].copy()
        costs[self._beside_unseen[window.slices] & (costs < INSCRIBED)] = INSCRIBED
        self.costs[window.slices] = costs


def _combined(
    static: NDArray[np.uint8], layers: Iterable[NDArray[np.uint8]], window: Window, track_unknown: bool
) -> NDArray[np.uint8]:
    """The layers over the map, without inflation, in the window."""
    master = static[window.slices].copy()
    for layer in layers:
        _combine(master.reshape(-1), np.ascontiguousarray(layer[window.slices]).reshape(-1))
    if not track_unknown:
        master[master == UNKNOWN] = FREE
    return master


@njit(cache=True, nogil=True)
def _combine(master: NDArray[np.uint8], layer: NDArray[np.uint8]) -> None:
    """An obstacle of the layer wins; free space that it saw replaces only what is unknown."""
    for i in range(master.shape[0]):
        if layer[i] == LETHAL or (layer[i] == FREE and master[i] == UNKNOWN):
            master[i] = layer[i]
