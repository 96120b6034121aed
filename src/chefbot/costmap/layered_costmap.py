"""A costmap made of layers: the map, what each sensor has seen, and the inflation of both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap import raytrace
from chefbot.costmap.inflation import cost_table
from chefbot.costmap.master_costmap import Combined
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.update_window import Window
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2


class LayeredCostmap:
    """Static map and one obstacle layer per sensor, combined and inflated on demand.

    The rule of the layers: a cell is an obstacle when the map or any layer says so. A source clears its own
    layer, and one other if it says so: `also`, of marks that it would have met had they still been there. So the
    lidar, which looks under the table, never erases the edge that the camera saw, but does erase the leg of
    somebody who has left. Nothing decays with time: a mark stays until it is looked through, or a recovery
    clears it.

    `wary`: the middle of the robot keeps its radius from what nothing has seen, as it does from obstacles. A sensor
    that looks ahead only does not see the corner beside it that the robot turns about.

    With `rolling=True` it is a square window (params.size) that follows `move_to`, else it has the size of
    the map given to `set_static`, which may be replaced by a larger one at any time; obstacles seen stay
    where they are.
    """

    def __init__(
        self, params: CostmapParams, robot_radius: float, *, rolling: bool = False, wary: bool = False
    ) -> None:
        self.params = params
        self.rolling = rolling
        self.wary = wary
        self._robot_radius = robot_radius
        n = max(1, round(params.size / params.resolution)) if rolling else 1
        self._frame(params.resolution, 0.0, 0.0, n, n)
        if rolling:
            self.move_to(0.0, 0.0)

    def _frame(self, resolution: float, origin_x: float, origin_y: float, height: int, width: int) -> None:
        """Empty layers. An obstacle fills its cell and the robot may stand anywhere in its own.

        So the inscribed radius grows by two halves of a cell.
        """
        self.resolution, self.origin_x, self.origin_y = resolution, origin_x, origin_y
        self.retune(self.params)
        self._static = np.full((height, width), UNKNOWN, np.uint8)
        self._sources: dict[str, NDArray[np.uint8]] = {}

    def retune(self, params: CostmapParams) -> None:
        """Other costs about the same obstacles; of params only those in `params.LIVE` may differ."""
        self.params = params
        self.inscribed_radius = self._robot_radius + params.padding + self.resolution
        reach = max(params.inflation_radius, self.inscribed_radius)
        self._table = cost_table(self.resolution, self.inscribed_radius, reach, params.cost_scaling_factor)
        self._combined: Combined | None = None  # all to be done again

    def set_static(self, grid: Grid) -> None:
        """Take over a map (again); what sensors have marked is kept, to the nearest cell."""
        cells = np.where(grid.cells < 0, UNKNOWN, FREE).astype(np.uint8)
        cells[grid.cells >= self.params.occupied_threshold] = LETHAL
        old, old_x, old_y, same = (
            self._sources,
            self.origin_x,
            self.origin_y,
            self.resolution == grid.resolution,
        )
        self._frame(grid.resolution, grid.origin_x, grid.origin_y, grid.height, grid.width)
        self._static = cells
        if same:
            columns = round((old_x - grid.origin_x) / grid.resolution)
            rows = round((old_y - grid.origin_y) / grid.resolution)
            self._sources = {name: _moved(layer, rows, columns, cells.shape) for name, layer in old.items()}

    def move_to(self, x: float, y: float) -> None:
        """Centre the rolling window on the point by whole cells; content keeps its place in the frame."""
        h, w = self._static.shape
        column = int(np.floor(x / self.resolution)) - w // 2
        row = int(np.floor(y / self.resolution)) - h // 2
        dc = round(self.origin_x / self.resolution) - column
        dr = round(self.origin_y / self.resolution) - row
        if dr or dc:
            self._static = _moved(self._static, dr, dc, (h, w))
            self._sources = {name: _moved(layer, dr, dc, (h, w)) for name, layer in self._sources.items()}
            self._combined = None
        self.origin_x, self.origin_y = column * self.resolution, row * self.resolution

    def mark_and_clear(
        self,
        source: str,
        sensor: SE2,
        angles: NDArray[np.float64],
        ranges: NDArray[np.float64],
        floor: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
        also: str | None = None,
    ) -> None:
        """One scan of the sensor `source`, seen from the pose `sensor` in the costmap's frame.

        angles, ranges: (n,) radians, metres. A laser's range of inf clears up to the clearing range; NaN and
        ranges not above 0 say nothing. With `floor` (from, to), each (n,), as of an obstacle scan from
        depth images, a beam clears that stretch only (not finite or not above 0: nothing) and marks where
        the range is finite. `also`: another layer, if it exists, that the beams clear but do not mark.
        """
        layer = self._layer(source)
        p = self.params
        valid = ranges > 0.0
        near, far = (np.zeros(len(ranges)), np.where(valid, ranges, 0.0)) if floor is None else floor
        if floor is not None:
            far = np.nan_to_num(far, nan=0.0, posinf=0.0)
        mark = np.where(valid & (ranges <= p.marking_range), ranges, np.nan).astype(np.float64)
        clear = np.minimum(far, p.clearing_range).astype(np.float64)
        # a sensor may say anything of where it sees; no cell beyond the two ranges changes
        self._touch(sensor, min(_reach(mark, near, clear), max(p.marking_range, p.clearing_range)))
        raytrace.mark_and_clear(
            layer,
            self.resolution,
            self.origin_x,
            self.origin_y,
            sensor.array(),
            np.ascontiguousarray(angles, np.float64),
            mark,
            near.astype(np.float64),
            clear,
            self._sources.get(also or source, layer),
        )

    def _touch(self, pose: SE2, radius: float) -> None:
        """Layers may have changed within `radius` metres of the pose."""
        if self._combined is not None:
            column, row = (
                (pose.x - self.origin_x) / self.resolution,
                (pose.y - self.origin_y) / self.resolution,
            )
            self._combined.touch(Window.around(row, column, radius / self.resolution))

    def _layer(self, source: str) -> NDArray[np.uint8]:
        """The source's layer; an empty one at its first scan."""
        if source not in self._sources:
            self._sources[source] = np.full(self._static.shape, UNKNOWN, np.uint8)
        return self._sources[source]

    def clear_around(self, pose: SE2, radius: float, source: str | None = None) -> None:
        """Forget what sensors, or only the one called `source`, marked within `radius` metres of the pose."""
        where = self._within(pose, radius)
        self._touch(pose, radius)
        for name, layer in self._sources.items():
            if source in (None, name):
                layer[where] = UNKNOWN

    def clear(self) -> None:
        """Forget all that sensors marked."""
        self._sources = {}
        self._combined = None

    def update(self) -> Costmap:
        """The layers combined and inflated, which is done again where they have changed; a copy of its own."""
        if self._combined is None:
            self._combined = self._uncombined()
        self._combined.update(self._static, self._sources.values(), self.params.track_unknown)
        costs = self._combined.costs.copy()
        return Costmap(costs, self.resolution, self.origin_x, self.origin_y)

    def without_far_marks(self, pose: SE2) -> Costmap:
        """As `update`, but of the sensors' marks only those that they could see again from the pose."""
        near = self._within(pose, self.params.marking_range)
        layers = [np.where(near | (layer != LETHAL), layer, UNKNOWN) for layer in self._sources.values()]
        combined = self._uncombined()
        combined.update(self._static, layers, self.params.track_unknown)
        return Costmap(combined.costs, self.resolution, self.origin_x, self.origin_y)

    def _uncombined(self) -> Combined:
        radius = self._robot_radius / self.resolution if self.wary else 0.0
        return Combined(self._static.shape, self._table, radius)

    def _within(self, pose: SE2, radius: float) -> NDArray[np.bool_]:
        h, w = self._static.shape
        x = self.origin_x + (np.arange(w) + 0.5) * self.resolution - pose.x
        y = self.origin_y + (np.arange(h) + 0.5) * self.resolution - pose.y
        return x[None, :] ** 2 + y[:, None] ** 2 <= radius * radius


def _reach(*metres: NDArray[np.float64]) -> float:
    """The furthest finite one from the sensor."""
    return float(np.nan_to_num(np.abs(np.concatenate(metres)), nan=0.0, posinf=0.0).max(initial=0.0))


def _moved(layer: NDArray[np.uint8], rows: int, columns: int, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """The layer on a new frame in which its cell [0, 0] is [rows, columns]; what is new is UNKNOWN."""
    out = np.full(shape, UNKNOWN, np.uint8)
    h, w = layer.shape
    top, left = max(rows, 0), max(columns, 0)
    bottom, right = min(rows + h, shape[0]), min(columns + w, shape[1])
    if top < bottom and left < right:
        out[top:bottom, left:right] = layer[top - rows : bottom - rows, left - columns : right - columns]
    return out
