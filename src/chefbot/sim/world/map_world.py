"""A world from a map: occupied cells become walls, merged to boxes, and the floor ends where the map does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.sim.world.free_floor import OCCUPIED_FROM, FreeFloor
from chefbot.sim.world.furniture import ceiling_shape
from chefbot.sim.world.shapes import Shape, box, clearance
from chefbot.sim.world.world import MAX_SHAPES, ROBOT_SPACE, Bounds, World

STOREY = 2.6
"""Metres from the floor to the ceiling: a depth camera that looks over low walls would see nothing."""
WALL_COLOUR = (200, 195, 185)
SHADOW = 4.0
"""Square metres: a smaller unknown region within a map is floor that nobody saw, a larger one is no floor."""
BORDER = 0.1
"""Metres of wall round the map: the robot does not leave what is simulated."""

Rectangle = tuple[int, int, int, int]
"""First row, first column, rows, columns."""


def world_from_map(
    name: str,
    grid: Grid,
    radius: float,
    start: SE2 | None = None,
    height: float = STOREY,
    places: dict[str, SE2] | None = None,
) -> World:
    """Every occupied cell as a wall of `height` metres up to a ceiling; a robot of `radius` metres starts at `start`.

    Poses are in the map's frame. Without `start` it is the place `home`, else where there is the most room.
    Unknown regions are solid if they are large or reach the map's edge: the robot would drive out through any
    gap in the walls. Small ones, as behind furniture, stay empty. places: named poses; `home` becomes the start.
    Raises UserError for a map with more than 20 000 boxes, for one on which the robot fits nowhere, and for a start
    off the map or in a wall.
    """
    if not 0.0 < height <= 20.0:
        raise UserError(f"map {name}: walls of {height} m are not between 0 and 20 m")
    rectangles = merged_rectangles((grid.cells >= OCCUPIED_FROM) | _outside(grid))
    if len(rectangles) > MAX_SHAPES:
        raise UserError(f"map {name}: {len(rectangles)} boxes are too many to simulate; clean or coarsen it")
    walls = tuple(_wall(grid, r, height, f"wall_{i}") for i, r in enumerate(rectangles))
    floor, places = FreeFloor(grid, radius), places or {}
    home, note = _home(floor, start or places.get("home"), "as told" if start else "the place home", name)
    _check_start(floor, walls, home, name)
    bounds = _bounds(grid)
    return World(
        name,
        (*walls, *_border(bounds, height), ceiling_shape(bounds, height)),
        (),
        (),
        0,
        {**places, "home": home},
        bounds,
        grid,
        note,
    )


def _outside(grid: Grid) -> NDArray[np.bool_]:
    """(h, w): unknown cells of regions that hang together by their sides and are no shadow of something."""
    from scipy import ndimage  # takes half a second, and most worlds do not need it

    regions: NDArray[np.int32] = ndimage.label(grid.cells < 0)[0]
    large = np.bincount(regions.ravel()) * grid.resolution**2 >= SHADOW
    for edge in (regions[0], regions[-1], regions[:, 0], regions[:, -1]):
        large[edge] = True
    large[0] = False
    solid: NDArray[np.bool_] = large[regions]
    return solid


def merged_rectangles(occupied: NDArray[np.bool_]) -> list[Rectangle]:
    """Rectangles that cover each true cell once: equal runs of rows, or of columns if those are fewer."""
    upright = _merged_runs(occupied)
    lying = _merged_runs(occupied.T)
    if len(upright) <= len(lying):
        return upright
    return [(column, row, columns, rows) for row, column, rows, columns in lying]


def _merged_runs(occupied: NDArray[np.bool_]) -> list[Rectangle]:
    """Each row's runs of true cells, joined with the same run of the row before."""
    edges = np.diff(np.pad(occupied, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(edges == 1)
    ends = np.nonzero(edges == -1)[1]
    done: list[Rectangle] = []
    growing: dict[tuple[int, int], tuple[int, int]] = {}  # a run to the first and last row that have it
    for row, begin, end in zip(rows.tolist(), begins.tolist(), ends.tolist(), strict=True):
        first, last = growing.get((begin, end), (row, row - 1))
        if last != row - 1:
            done.append((first, begin, last - first + 1, end - begin))
            first = row
        growing[begin, end] = first, row
    rest = [(first, begin, last - first + 1, end - begin) for (begin, end), (first, last) in growing.items()]
    return done + rest


def _wall(grid: Grid, rectangle: Rectangle, height: float, name: str) -> Shape:
    row, column, rows, columns = rectangle
    x = grid.origin_x + (column + columns / 2) * grid.resolution
    y = grid.origin_y + (row + rows / 2) * grid.resolution
    size = (columns * grid.resolution, rows * grid.resolution, height)
    return box(name, SE2(x, y, 0.0), 0.0, size, WALL_COLOUR)


def _bounds(grid: Grid) -> Bounds:
    right = grid.origin_x + grid.width * grid.resolution
    return grid.origin_x, grid.origin_y, right, grid.origin_y + grid.height * grid.resolution


def _border(bounds: Bounds, height: float) -> list[Shape]:
    """Four walls just outside."""
    x0, y0, x1, y1 = bounds
    x, y, width, depth = (x0 + x1) / 2, (y0 + y1) / 2, x1 - x0 + 2 * BORDER, y1 - y0
    sides = [
        (x, y0 - BORDER / 2, width, BORDER), (x, y1 + BORDER / 2, width, BORDER),
        (x0 - BORDER / 2, y, BORDER, depth), (x1 + BORDER / 2, y, BORDER, depth),
    ]  # fmt: skip
    return [
        box(f"border_{i}", SE2(cx, cy, 0.0), 0.0, (sx, sy, height), WALL_COLOUR)
        for i, (cx, cy, sx, sy) in enumerate(sides)
    ]


def _home(floor: FreeFloor, wished: SE2 | None, note: str, name: str) -> tuple[SE2, str]:
    """Where the robot starts, and why there."""
    if wished is not None:
        return wished, note
    try:
        home, room = floor.roomiest()
    except UserError as error:
        raise UserError(f"map {name}: {error}") from None
    return home, f"where there is the most room, {room:.2f} m; another one by start:='[x, y, yaw]'"


def _check_start(floor: FreeFloor, walls: tuple[Shape, ...], start: SE2, name: str) -> None:
    """UserError, with the nearest free pose, for a start off the map or in a wall."""
    grid = floor.grid
    if not grid.contains(start.x, start.y):
        x0, y0, x1, y1 = _bounds(grid)
        spans = f"x {x0:.2f} to {x1:.2f} and y {y0:.2f} to {y1:.2f} m"
        raise UserError(f"{_at(name, start)} lies off the map, which spans {spans}{_instead(floor, start)}")
    if clearance(walls, start.x, start.y, *ROBOT_SPACE) < floor.radius:
        wide = f"a robot of {floor.radius:.2f} m radius"
        raise UserError(
            f"{_at(name, start)} lies in a wall or too near to one for {wide}{_instead(floor, start)}"
        )


def _at(name: str, start: SE2) -> str:
    return f"map {name}: the start ({start.x:.2f}, {start.y:.2f})"


def _instead(floor: FreeFloor, start: SE2) -> str:
    """The nearest free pose as it is written, or that there is none."""
    try:
        free = floor.nearest(start.x, start.y)
    except UserError as error:
        return f"; {error}"
    return f"; the nearest free pose is start:='[{free.x:.2f}, {free.y:.2f}, {start.yaw:.2f}]'"
