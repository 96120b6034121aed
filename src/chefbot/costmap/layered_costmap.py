"""A layered costmap: the static map, the marks of each sensor, and the layers that compute costs from them."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap import raytrace
from chefbot.costmap.cell_masks import disc_mask, discs_mask, polygon_mask
from chefbot.costmap.inflation import cost_table
from chefbot.costmap.layer import CellMark, CostmapLayer, LayerSettings
from chefbot.costmap.layers import InflationLayer, StaticLayer, built_in_layers
from chefbot.costmap.master_costmap import MasterCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sensor_marks import SensorMarks, marks_in, permanent_marks, shifted
from chefbot.costmap.sources import CONTACT, CONTACT_TIME, LASTING_SOURCES
from chefbot.costmap.update_window import EMPTY_WINDOW, CellWindow
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.footprint import Footprint
from chefbot.maths.grid import Grid
from chefbot.maths.lanes import NO_LANES
from chefbot.maths.polygon import GridGeometry
from chefbot.maths.se2 import SE2
from chefbot.msgs.idl.message import Message

_NO_FLOOR = np.empty(0)
NARROW_SCALING_FACTOR = 30.0
"""Exponential decay of the cost with distance in a narrow passage, 1/m: the middle costs noticeably less."""
DECAY_PERIOD = 1.0
"""Time between two searches for marks that have decayed, s."""


class LayeredCostmap:
    """A static map and the marks of each sensor, from which layers compute costs on demand.

    A cell is lethal if it is lethal in the map or in any layer. A source clears its own marks and, if given, those of
    one other (`also_clear`), which it would detect if they were still there. So the lidar, whose plane passes under
    the table, never clears the table edge that the camera marked, but does clear the leg of a person who has left. A
    mark stays until a beam clears it, the robot itself stands there, a recovery behavior clears it, or, with
    `params.decay_time`, no measurement has confirmed it for that time: a camera sees neither beside itself nor near.
    In a costmap of the whole map that time runs only while the robot is within marking range of the mark, and could
    see it, and not for what other sensors may not see.

    `avoid_unknown`: the robot's centre keeps its radius from unknown space, as it does from obstacles. A sensor that
    looks ahead only does not see the corner beside it that the robot turns about.

    With `rolling=True` the costmap is a square window (params.size) that follows `move_to`, else it has the size of
    the map given to `set_static`, which may be replaced by a larger one at any time; the sources keep their marks.
    """

    def __init__(
        self,
        params: CostmapParams,
        robot: Footprint,
        *,
        rolling: bool = False,
        avoid_unknown: bool = False,
        layers: Sequence[CostmapLayer] | None = None,
    ) -> None:
        self.params = params
        self.rolling = rolling
        self.avoid_unknown = avoid_unknown
        self.lanes = NO_LANES
        self._time = 0.0
        self._decayed_at = -math.inf
        self._sensor: SE2 | None = None
        if avoid_unknown:
            import scipy.ndimage  # noqa: F401 (the import takes 0.1 s and more: now, not in the first update)
        self._robot = robot
        self.layers = tuple(built_in_layers(LayerSettings(params)) if layers is None else layers)
        n = max(1, round(params.size / params.resolution)) if rolling else 1
        self._reset_layers(params.resolution, 0.0, 0.0, n, n)
        if rolling:
            self.move_to(0.0, 0.0)

    def _reset_layers(
        self, resolution: float, origin_x: float, origin_y: float, height: int, width: int
    ) -> None:
        """Set the geometry of the grid and reset all layers."""
        self.resolution, self.origin_x, self.origin_y = resolution, origin_x, origin_y
        self.reconfigure(self.params)
        self.static = np.full((height, width), UNKNOWN, np.uint8)
        self.sources: dict[str, SensorMarks] = {}

    def reconfigure(self, params: CostmapParams) -> None:
        """Change the inflation and ranges and keep the obstacles; only parameters in `LIVE_PARAMS` may differ."""
        self.params = params
        self._footprint = self._robot.polygon(params.padding)
        # an obstacle fills its cell and a disc may be anywhere in its own: two half cells more; a polygon is checked
        # where it is, and the inscribed circle only excludes what no heading avoids
        cell = 0.0 if len(self._footprint) else self.resolution
        self.inscribed_radius = self._robot.inscribed_radius + params.padding + cell
        reach = max(params.inflation_radius, self.inscribed_radius)
        self.cost_table = cost_table(
            self.resolution, self.inscribed_radius, reach, params.cost_scaling_factor
        )
        self._combined: MasterCostmap | None = None  # recalculate everything

    def set_static(self, grid: Grid) -> None:
        """Set or replace the static map; the sensors' marks are kept, to the nearest cell."""
        cells = np.where(grid.cells < 0, UNKNOWN, FREE).astype(np.uint8)
        cells[grid.cells >= self.params.occupied_threshold] = LETHAL
        old, old_x, old_y = self.sources, self.origin_x, self.origin_y
        same_resolution = self.resolution == grid.resolution
        self._reset_layers(grid.resolution, grid.origin_x, grid.origin_y, grid.height, grid.width)
        self.static = cells
        if same_resolution:
            columns = round((old_x - grid.origin_x) / grid.resolution)
            rows = round((old_y - grid.origin_y) / grid.resolution)
            self.sources = {name: marks.shifted(rows, columns, cells.shape) for name, marks in old.items()}

    def set_static_points(self, points: NDArray[np.float64]) -> None:
        """Replace what is lethal in the static map of a rolling window by the cells of points (n, 2), m."""
        cells = np.full_like(self.static, UNKNOWN)
        columns = np.floor((points[:, 0] - self.origin_x) / self.resolution).astype(int)
        rows = np.floor((points[:, 1] - self.origin_y) / self.resolution).astype(int)
        inside = (rows >= 0) & (rows < cells.shape[0]) & (columns >= 0) & (columns < cells.shape[1])
        cells[rows[inside], columns[inside]] = LETHAL
        if not np.array_equal(cells, self.static):
            self.static = cells
            self.note_all_changed()

    def marked_points(self) -> NDArray[np.float64]:
        """Return the middles (n, 2) of the cells that any sensor has marked."""
        marked = np.zeros(self.static.shape, bool)
        for marks in self.sources.values():
            marked |= marks.cells == LETHAL
        rows, columns = np.nonzero(marked)
        return (np.column_stack([columns, rows]) + 0.5) * self.resolution + [self.origin_x, self.origin_y]

    def move_to(self, x: float, y: float) -> None:
        """Centre the rolling window on the point (m) by whole cells; its content keeps its position in the frame."""
        h, w = self.static.shape
        column = int(np.floor(x / self.resolution)) - w // 2
        row = int(np.floor(y / self.resolution)) - h // 2
        dc = round(self.origin_x / self.resolution) - column
        dr = round(self.origin_y / self.resolution) - row
        if dr or dc:
            self.static = shifted(self.static, dr, dc, (h, w), UNKNOWN)
            self.sources = {name: marks.shifted(dr, dc, (h, w)) for name, marks in self.sources.items()}
            self._combined = None
        self.origin_x, self.origin_y = column * self.resolution, row * self.resolution

    def mark_and_clear(
        self,
        source: str,
        sensor: SE2,
        angles: NDArray[np.float64],
        ranges: NDArray[np.float64],
        floor: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
        also_clear: str | None = None,
    ) -> None:
        """Mark and clear cells of `source` with a scan from the pose `sensor` in the costmap's frame.

        angles, ranges: (n,) rad, m. A range of inf clears up to the clearing range; NaN and ranges <= 0 are invalid.
        With `floor` (from, to), each (n,), of an obstacle scan from depth images, a beam clears that interval only
        (nothing if not finite or <= 0) and marks where the range is finite. `also_clear`: another source, if it
        has cells, that the beams clear but do not mark.
        """
        p, marks, self._sensor = self.params, self._source(source), sensor
        start, end = (_NO_FLOOR, _NO_FLOOR) if floor is None else floor
        mark, clear = np.empty(len(ranges)), np.empty(len(ranges))
        longest = raytrace.limit_beams(ranges, start, end, p.marking_range, p.clearing_range, mark, clear)
        # a sensor may report any range; no cell beyond the two maximum ranges changes
        self.note_change(sensor, min(longest, max(p.marking_range, p.clearing_range)))
        raytrace.mark_and_clear(
            marks.cells,
            self.resolution,
            self.origin_x,
            self.origin_y,
            sensor.array(),
            angles,
            mark,
            np.zeros(len(ranges)) if floor is None else start,
            clear,
            self.sources.get(also_clear or source, marks).cells,
            marks.marked_at,
            self._time,
        )

    def note_all_changed(self) -> None:
        """Note that a layer may have changed everywhere."""
        self._combined = None

    def note_change(self, pose: SE2, radius: float) -> None:
        """Note that layers may have changed within `radius` metres of the pose."""
        if self._combined is not None:
            self._combined.touch(self.window_around(pose, radius))

    def window_around(self, pose: SE2, radius: float) -> CellWindow:
        """Return the window of all cells within `radius` metres of the pose, which may extend beyond the costmap."""
        column, row = (pose.x - self.origin_x) / self.resolution, (pose.y - self.origin_y) / self.resolution
        return CellWindow.around(row, column, radius / self.resolution)

    @property
    def geometry(self) -> GridGeometry:
        """Where the cells of the costmap lie."""
        return GridGeometry(self.resolution, self.origin_x, self.origin_y, *self.shape)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the costmap."""
        height, width = self.static.shape
        return height, width

    def obstacles(self, window: CellWindow, without: Collection[str]) -> NDArray[np.bool_]:
        """Return which cells of a window are lethal in the static map or by any source but these."""
        lethal: NDArray[np.bool_] = self.static[window.slices] == LETHAL
        for name, marks in self.sources.items():
            if name not in without:
                lethal = lethal | (marks.cells[window.slices] == LETHAL)
        return lethal

    def has_source(self, source: str) -> bool:
        """Return whether a source has marked or cleared any cell."""
        return source in self.sources

    def source_cells(self, source: str) -> NDArray[np.uint8]:
        """Return the cells of a source, created empty at its first scan; only LETHAL and FREE cells count."""
        return self._source(source).cells

    def _source(self, source: str) -> SensorMarks:
        if source not in self.sources:
            self.sources[source] = SensorMarks.empty(self.static.shape, always_near=self.rolling)
        return self.sources[source]

    def note_marks(self, source: str, cells: Any) -> None:
        """Note that cells of a source, given as an index, were marked now other than by `mark_and_clear`."""
        self._source(source).marked_at[cells] = self._time

    def marks(self, x: float, y: float) -> list[CellMark]:
        """Return all that marked the cell at a point (m): sources, zones and the map, from the top layer down."""
        row = math.floor((y - self.origin_y) / self.resolution)
        column = math.floor((x - self.origin_x) / self.resolution)
        if not (0 <= row < self.static.shape[0] and 0 <= column < self.static.shape[1]):
            return []
        return [mark for layer in reversed(self.layers) for mark in layer.marks(self, row, column)]

    def marked_by(self, x: float, y: float) -> CellMark | None:
        """Return which source marked the cell at a point (m) last, else the zone or map that has it, else None."""
        return max(self.marks(x, y), key=lambda mark: mark.time, default=None)

    def set_time(self, time: float) -> None:
        """Set the time (s) of the marks that follow, and remove those that have decayed."""
        self._time = time
        if self.params.decay_time <= 0.0 or abs(time - self._decayed_at) < DECAY_PERIOD:
            return
        self._decayed_at = time
        for name, marks in self.sources.items():
            removed = self._decay(name, marks)
            if self._combined is not None and not removed.empty:
                self._combined.touch(removed)

    def _decay(self, name: str, marks: SensorMarks) -> CellWindow:
        """Remove the marks of a source that have decayed, and return their window."""
        decay = self.params.decay_time
        if self.rolling:
            return marks.remove_older(self._time - decay)
        if name == CONTACT:
            return marks.remove_older(self._time - CONTACT_TIME)
        if self._sensor is None or name in LASTING_SOURCES:
            return EMPTY_WINDOW
        column = (self._sensor.x - self.origin_x) / self.resolution
        row = (self._sensor.y - self.origin_y) / self.resolution
        return marks.remove_missed(
            row, column, self.params.marking_range / self.resolution, self._time, decay
        )

    def clear_around(
        self, pose: SE2, radius: float, source: str | None = None, keep: Collection[str] = ()
    ) -> None:
        """Clear the marks of all sources but `keep`, or only of `source`, within `radius` metres of the pose."""
        mask = disc_mask(self.geometry, pose, radius)
        self.note_change(pose, radius)
        for name, marks in self.sources.items():
            if source in (None, name) and name not in keep:
                marks.cells[mask] = UNKNOWN

    def clear_footprint(self, pose: SE2, keep: Collection[str] = ()) -> None:
        """Clear the marks of all sources but `keep` in the cells that the robot covers: nothing else can be there.

        A false mark under the robot would stay otherwise, since no sensor looks there (compare
        `footprint_clearing_enabled` of nav2_costmap_2d). A cell that the robot covers in part keeps its mark.
        """
        margin = self.resolution / math.sqrt(2.0)
        radius = max(self._robot.circumscribed_radius - margin, 0.0)
        window = self.window_around(pose, radius).expanded(0, self.static.shape)
        if window.empty:
            return  # the robot is outside the costmap
        covered = disc_mask(self.geometry, pose, radius, window)
        if len(self._footprint):
            covered &= polygon_mask(self.geometry, pose, self._robot.polygon(), margin, window)
        self._unmark(covered, window, keep)

    def clear_discs(self, centres: NDArray[np.float64], radius: float, keep: Collection[str] = ()) -> None:
        """Clear the marks of all sources but `keep` in the cells that touch a disc about a centre, (n, 2), m."""
        reach = radius + self.resolution / math.sqrt(2.0)
        for x, y in centres.tolist():
            pose = SE2(x, y, 0.0)
            window = self.window_around(pose, reach).expanded(0, self.static.shape)
            if not window.empty:
                self._unmark(disc_mask(self.geometry, pose, reach, window), window, keep)

    def _unmark(self, covered: NDArray[np.bool_], window: CellWindow, keep: Collection[str]) -> None:
        """Make marked cells of a window unknown where `covered`, in the marks of all sources but `keep`."""
        for cells in (marks.cells for name, marks in self.sources.items() if name not in keep):
            marked = covered & (cells[window.slices] == LETHAL)
            if marked.any():
                cells[window.slices][marked] = UNKNOWN
                if self._combined is not None:
                    self._combined.touch(window)

    def clear(self) -> None:
        """Clear the marks of all sources and keep the static map."""
        self.sources = {}
        self._combined = None

    def process(self, message: Message, frame: SE2) -> None:
        """Pass a message, whose frame is at `frame` in the costmap, to the layers, which take what they know."""
        for layer in self.layers:
            layer.process(self, message, frame)

    def update(self) -> Costmap:
        """Combine the layers where they have changed, and return the costs, which the next update overwrites.

        Who keeps them copies the cells: a copy of a large map takes longer than the update after a scan.
        """
        if self._combined is None:
            self._combined = self._new_master(self.layers)
        self._combined.update(self)
        return self._costmap(self._combined.costs)

    def costs_without_far_marks(self, poses: Sequence[SE2]) -> Costmap:
        """Return the costs as `update` does, but without marks beyond the marking range of all poses that may have
        left since."""
        near = discs_mask(self.geometry, poses, self.params.marking_range)
        return self._costs_of(marks_in(self.sources, near))

    def costs_without_marks(self) -> Costmap:
        """Return the costs of the map, its zones and what is as permanent, without other marks."""
        return self._costs_of(permanent_marks(self.sources))

    def permanent_cells(self) -> tuple[bytes, ...]:
        """Return which cells the permanent sources have marked, to be compared with a later result."""
        permanent = permanent_marks(self.sources).values()
        return tuple(np.flatnonzero(marks.cells == LETHAL).tobytes() for marks in permanent)

    def narrow_costs(
        self,
        margin: float,
        people: NDArray[np.float64],
        radius: float,
        counted: NDArray[np.bool_] | None = None,
    ) -> Costmap:
        """Return the costs as `update` does, but with passages open through which the body may just fit.

        margin: distance from the body to the middle of occupied cells, m; below 0 where an obstacle may cover a part
        of its cell only. None is open beside people (n, 2), m, from whom the robot's centre stays at `radius` metres.
        counted: the cells (h, w) in which marks of what may leave count, None for all.
        """
        inscribed = max(self._robot.inscribed_radius + margin, 0.0)
        reach = max(self.params.inflation_radius, inscribed)
        usual = self.cost_table
        self.cost_table = cost_table(self.resolution, inscribed, reach, NARROW_SCALING_FACTOR)
        try:
            costs = self._costs_of(self.sources if counted is None else marks_in(self.sources, counted))
        finally:
            self.cost_table = usual
        for x, y in people.tolist():
            beside = disc_mask(self.geometry, SE2(x, y, 0.0), radius)
            costs.cells[beside & (costs.cells < INSCRIBED)] = INSCRIBED
        return replace(costs, footprint=self._robot.polygon(margin))

    def _costs_of(self, marks: dict[str, SensorMarks]) -> Costmap:
        """Return the costs of all layers with other marks than the present ones."""
        present, self.sources = self.sources, marks
        try:
            combined = self._new_master(self.layers)
            combined.update(self)
        finally:
            self.sources = present
        return self._costmap(combined.costs)

    def static_costs(self) -> Costmap:
        """Return the costs of the static map alone, without the marks of any sensor and without zones."""
        combined = self._new_master([x for x in self.layers if isinstance(x, (StaticLayer, InflationLayer))])
        combined.update(self)
        return replace(self._costmap(combined.costs), lanes=NO_LANES)

    def _new_master(self, layers: Sequence[CostmapLayer]) -> MasterCostmap:
        radius = self._robot.inscribed_radius / self.resolution if self.avoid_unknown else 0.0
        return MasterCostmap(self, layers, radius)

    def _costmap(self, cells: NDArray[np.uint8]) -> Costmap:
        return Costmap(cells, self.resolution, self.origin_x, self.origin_y, self._footprint, self.lanes)
