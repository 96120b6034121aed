"""Worlds made from maps: occupied cells become walls, merged into boxes, inside a border wall."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chefbot.buildings.people_spec import NOBODY
from chefbot.errors import UserError
from chefbot.maths.grid import FREE, OCCUPIED, OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import SE2
from chefbot.sim.world.free_floor import FreeFloor
from chefbot.sim.world.furniture import ceiling_shape
from chefbot.sim.world.shapes import SimulatedShape, box, clearance
from chefbot.sim.world.world import ROBOT_SPACE, Bounds, World
from chefbot.storage.places import places_path

CEILING_HEIGHT = 2.6
"""Metres from floor to ceiling: without one, a depth camera looking over low walls would see nothing."""
WALL_COLOUR = (200, 195, 185)
MIN_SOLID_AREA = 4.0
"""Minimum area, m^2, of an unknown region that counts as solid; a smaller one is unseen floor."""
BORDER = 0.1
"""Thickness in metres of the wall around the map, which keeps the robot inside the simulated area."""

UnknownCells = Literal["auto", "wall", "free"]
"""What unknown cells of a map become; `auto` makes walls of large regions and of those at the map's edge."""
Rectangle = tuple[int, int, int, int]
"""First row, first column, number of rows, number of columns."""


def world_from_map(
    name: str,
    grid: Grid,
    radius: float,
    start: SE2 | None = None,
    places: dict[str, SE2] | None = None,
    unknown: UnknownCells = "auto",
) -> World:
    """Build a world in which every occupied cell of a map is a wall up to a ceiling.

    name: name or file of the map. grid: the map; poses are in its frame. radius: radius of the robot, m. places:
    named poses. start: start pose; without it the place `home`, or else the pose with the most clearance in the
    largest free area. unknown: whether unknown cells are walls or free. `auto`: unknown regions are walls if they
    are large or reach the map's edge, since the robot would drive out through any gap in the walls; small ones,
    such as those behind furniture, stay empty.
    Raises UserError for a map on which the robot fits nowhere, for a start off the map or in a wall, and for a
    place in a wall or in another area than the start.
    """
    walls = MapWalls(grid, unknown)
    floor, places = FreeFloor(grid, radius, unknown == "free"), places or {}
    reason = "as requested" if start else "the place home"
    home, note = _start_pose(floor, start or places.get("home"), reason, name)
    is_place = start is None and "home" in places
    what = f"the place home in {places_path(Path(name))}" if is_place else "the start"
    places = {**places, "home": home}
    bounds = _bounds(grid)
    solids = (*walls.boxes, *_border(bounds), ceiling_shape(bounds, CEILING_HEIGHT))
    _check_start(floor, solids, home, f"map {name}: {what} ({home.x:.2f}, {home.y:.2f})")
    if len(places) > 1:
        _check_places(walls, radius, places, name)
    return World(Path(name).stem, solids, (), (), NOBODY, places, bounds, floor, note)


class MapWalls:
    """The walls of a map: solid (h, w), its solid cells, and boxes that cover these."""

    def __init__(self, grid: Grid, unknown: UnknownCells) -> None:
        self._grid, self.solid = grid, grid.cells >= OCCUPIED_THRESHOLD
        if unknown == "wall":
            self.solid |= grid.cells < 0
        elif unknown == "auto":
            self.solid |= _solid_unknown_cells(grid)
        self.boxes = tuple(
            _wall(grid, rectangle, f"wall_{i}") for i, rectangle in enumerate(merged_rectangles(self.solid))
        )

    def around_walls(self) -> Grid:
        """Return the map with all that is not a wall as free, unknown or not."""
        cells = np.where(self.solid, OCCUPIED, FREE).astype(np.int8)
        return dataclasses.replace(self._grid, cells=cells)


def _solid_unknown_cells(grid: Grid) -> NDArray[np.bool_]:
    """Return (h, w): unknown cells of 4-connected regions that are large or touch the edge of the map."""
    from scipy import ndimage  # takes half a second, and most worlds do not need it

    regions: NDArray[np.int32] = ndimage.label(grid.cells < 0)[0]
    is_solid = np.bincount(regions.ravel()) * grid.resolution**2 >= MIN_SOLID_AREA
    for edge in (regions[0], regions[-1], regions[:, 0], regions[:, -1]):
        is_solid[edge] = True
    is_solid[0] = False
    solid: NDArray[np.bool_] = is_solid[regions]
    return solid


def merged_rectangles(occupied: NDArray[np.bool_]) -> list[Rectangle]:
    """Cover each true cell by exactly one rectangle, from runs of rows or of columns, whichever are fewer."""
    by_rows = _merged_runs(occupied)
    by_columns = _merged_runs(occupied.T)
    if len(by_rows) <= len(by_columns):
        return by_rows
    return [(column, row, columns, rows) for row, column, rows, columns in by_columns]


def _merged_runs(occupied: NDArray[np.bool_]) -> list[Rectangle]:
    """Return the runs of true cells of each row, merged with equal runs of the row before."""
    # Run-length encoding of each row: rising edges start a run, falling edges end it.
    edges = np.diff(np.pad(occupied, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(edges == 1)
    ends = np.nonzero(edges == -1)[1]
    finished: list[Rectangle] = []
    growing: dict[tuple[int, int], tuple[int, int]] = {}  # run to the first and last row that contain it
    for row, begin, end in zip(rows.tolist(), begins.tolist(), ends.tolist(), strict=True):
        first, last = growing.get((begin, end), (row, row - 1))
        if last != row - 1:
            finished.append((first, begin, last - first + 1, end - begin))
            first = row
        growing[begin, end] = first, row
    open_runs = [
        (first, begin, last - first + 1, end - begin) for (begin, end), (first, last) in growing.items()
    ]
    return finished + open_runs


def _wall(grid: Grid, rectangle: Rectangle, name: str) -> SimulatedShape:
    row, column, rows, columns = rectangle
    x = grid.origin_x + (column + columns / 2) * grid.resolution
    y = grid.origin_y + (row + rows / 2) * grid.resolution
    size = (columns * grid.resolution, rows * grid.resolution, CEILING_HEIGHT)
    return box(name, SE2(x, y, 0.0), 0.0, size, WALL_COLOUR)


def _bounds(grid: Grid) -> Bounds:
    right = grid.origin_x + grid.width * grid.resolution
    return grid.origin_x, grid.origin_y, right, grid.origin_y + grid.height * grid.resolution


def _border(bounds: Bounds) -> list[SimulatedShape]:
    """Return four walls just outside the map."""
    x0, y0, x1, y1 = bounds
    x, y, width, depth = (x0 + x1) / 2, (y0 + y1) / 2, x1 - x0 + 2 * BORDER, y1 - y0
    sides = [
        (x, y0 - BORDER / 2, width, BORDER), (x, y1 + BORDER / 2, width, BORDER),
        (x0 - BORDER / 2, y, BORDER, depth), (x1 + BORDER / 2, y, BORDER, depth),
    ]  # fmt: skip
    return [
        box(f"border_{i}", SE2(cx, cy, 0.0), 0.0, (sx, sy, CEILING_HEIGHT), WALL_COLOUR)
        for i, (cx, cy, sx, sy) in enumerate(sides)
    ]


def _start_pose(floor: FreeFloor, requested: SE2 | None, note: str, name: str) -> tuple[SE2, str]:
    """Return the start pose and the reason for it."""
    if requested is not None:
        return requested, note
    try:
        home, clearance_m = floor.roomiest()
    except UserError as error:
        raise UserError(f"map {name}: {error}") from None
    reason = f"where the clearance is largest in the largest free area, {clearance_m:.2f} m"
    return home, f"{reason}; another one by start:='[x, y, yaw]'"


def _check_start(floor: FreeFloor, solids: tuple[SimulatedShape, ...], start: SE2, at: str) -> None:
    """Raise UserError, with the nearest free pose, for a start off the map or in a wall; `at` begins its sentence."""
    grid = floor.grid
    if not grid.contains(start.x, start.y):
        x0, y0, x1, y1 = _bounds(grid)
        spans = f"x {x0:.2f} to {x1:.2f} and y {y0:.2f} to {y1:.2f} m"
        raise UserError(f"{at} lies off the map, which spans {spans}{_suggestion(floor, start)}")
    if clearance(solids, start.x, start.y, *ROBOT_SPACE) < floor.radius:
        robot = f"a robot of {floor.radius:.2f} m radius"
        raise UserError(f"{at} lies in a wall or too near to one for {robot}{_suggestion(floor, start)}")


def _check_places(walls: MapWalls, radius: float, places: dict[str, SE2], name: str) -> None:
    """Raise UserError for a place off the map, in a wall, or where the robot does not get to from `home`."""
    floor, home = FreeFloor(walls.around_walls(), radius), places["home"]
    for place, pose in places.items():
        at = f"map {name}: the place {place} ({pose.x:.2f}, {pose.y:.2f})"
        move = f"move it in {places_path(Path(name))}, "
        if not floor.grid.contains(pose.x, pose.y):
            raise UserError(f"{at} lies off the map; {move}or remove it")
        free, distance_m = floor.reachable_near(home, pose.x, pose.y)
        move += f"the nearest point that the robot gets to is ({free.x:.2f}, {free.y:.2f})"
        if floor.grid.at(pose.x, pose.y) == OCCUPIED:
            raise UserError(f"{at} lies in a wall; {move}")
        if distance_m > radius:
            start = f"the start ({home.x:.2f}, {home.y:.2f})"
            raise UserError(f"{at} lies in a free area that the robot does not get to from {start}; {move}")


def _suggestion(floor: FreeFloor, start: SE2) -> str:
    """Return the nearest free pose as start:= text, or why there is none."""
    try:
        free = floor.nearest(start.x, start.y)
    except UserError as error:
        return f"; {error}"
    return f"; the nearest free pose is start:='[{free.x:.2f}, {free.y:.2f}, {start.yaw:.2f}]'"
