"""Ground-truth maps of a world: what a mapper should find, and where a robot can go."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.geometry.layout import ground_clearance, overall_height
from chefbot.robot.spec import Robot
from chefbot.sim.world.shapes import SimulatedShape, distance
from chefbot.sim.world.world import Bounds, World

RESOLUTION = 0.05  # m
MARGIN = 0.5  # m of grid around the world
MAX_CELLS = 50_000_000


class _Shapes(NamedTuple):
    """Solids to rasterize, with the name of their world and bounds (x0, y0, x1, y1) around them."""

    world: str
    bounds: Bounds
    shapes: tuple[SimulatedShape, ...]


def floor_plan(world: World, low: float, high: float | None = None, frame: SE2 = IDENTITY) -> Grid:
    """Return the map that a sensor for the heights low..high (m) finds, doors opened as the file specifies.

    low alone gives the slice of a lidar. frame: pose in the world of the map's frame. Cells whose inscribed circle a
    solid touches are OCCUPIED; cells connected to the start without crossing those are FREE; everything else, such as
    the outside, is UNKNOWN.
    """
    seen = _in_frame(world, frame)
    plan = _rasterize(seen, low, low if high is None else high, RESOLUTION)
    free_cells = (plan.cells == FREE) & _within_bounds(plan, world, frame)
    unreachable = (plan.cells == FREE) & ~_connected_to_start(free_cells, plan, frame.between(world.start))
    cells = np.where(unreachable, np.int8(UNKNOWN), plan.cells)
    return Grid(cells, plan.resolution, plan.origin_x, plan.origin_y)


def reachable(world: World, robot: Robot, margin: float = 0.0, resolution: float = RESOLUTION) -> Grid:
    """Return a grid that is FREE where the robot's centre can get to from the start, OCCUPIED elsewhere.

    The robot is a disc with its footprint radius plus `margin` metres. resolution: size of the cells, m.
    """
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    heights = ground_clearance(robot), overall_height(robot)
    plan = _rasterize(_Shapes(world.name, world.bounds, world.obstacles_at_rest()), *heights, resolution)
    radius = robot.circumscribed_radius + margin
    # Distance transform to the obstacles, thresholded at the circumscribed radius.
    clearance_m = ndimage.distance_transform_edt(plan.cells != OCCUPIED) * resolution
    free_cells = (clearance_m - resolution / 2 >= radius) & _within_bounds(plan, world, IDENTITY)
    cells = np.where(_connected_to_start(free_cells, plan, world.start), FREE, OCCUPIED).astype(np.int8)
    return Grid(cells, plan.resolution, plan.origin_x, plan.origin_y)


def _in_frame(world: World, frame: SE2) -> _Shapes:
    """Return the solids at rest in a frame at `frame` in the world, with bounds around the world's own."""
    if frame == IDENTITY:
        return _Shapes(world.name, world.bounds, world.shapes_at_rest())
    to_frame = frame.inverse()
    x0, y0, x1, y1 = world.bounds
    corners = to_frame.apply(np.array([[x0, y0], [x1, y0], [x0, y1], [x1, y1]]))
    (left, bottom), (right, top) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    shapes = tuple(shape.transformed(to_frame) for shape in world.shapes_at_rest())
    return _Shapes(world.name, (left, bottom, right, top), shapes)


def _rasterize(solids: _Shapes, low: float, high: float, resolution: float) -> Grid:
    """Return a grid of OCCUPIED and FREE cells only."""
    x0, y0, x1, y1 = solids.bounds
    left, bottom = _snap(x0 - MARGIN, resolution), _snap(y0 - MARGIN, resolution)
    width = math.ceil((x1 + MARGIN - left) / resolution)
    height = math.ceil((y1 + MARGIN - bottom) / resolution)
    if width * height > MAX_CELLS:
        raise UserError(
            f"world {solids.world} needs {width} x {height} cells of {resolution} m; choose larger cells"
        )
    grid = Grid(np.zeros((height, width), dtype=np.int8), resolution, left, bottom)
    for shape in solids.shapes:
        if shape.bottom <= high and shape.top >= low:
            _mark_occupied(grid, shape)
    return grid


def _snap(value: float, resolution: float) -> float:
    return math.floor(value / resolution) * resolution


def _mark_occupied(grid: Grid, shape: SimulatedShape) -> None:
    """Mark cells whose inscribed circle the shape touches, which keeps thin legs between cell centres."""
    ex, ey = shape.extent
    r0, c0 = grid.cell(shape.x - ex, shape.y - ey)
    r1, c1 = grid.cell(shape.x + ex, shape.y + ey)
    r0, c0 = max(r0 - 1, 0), max(c0 - 1, 0)
    r1, c1 = min(r1 + 2, grid.height), min(c1 + 2, grid.width)
    x = grid.origin_x + (np.arange(c0, c1) + 0.5) * grid.resolution
    y = grid.origin_y + (np.arange(r0, r1) + 0.5) * grid.resolution
    near = distance(shape, *np.meshgrid(x, y)) <= grid.resolution / 2
    grid.cells[r0:r1, c0:c1][near] = OCCUPIED


def _within_bounds(grid: Grid, world: World, frame: SE2) -> NDArray[np.bool_]:
    """Return the mask of cells within the world's bounds, since the outside is not explored."""
    x0, y0, x1, y1 = world.bounds
    x = grid.origin_x + (np.arange(grid.width) + 0.5) * grid.resolution
    y = grid.origin_y + (np.arange(grid.height) + 0.5) * grid.resolution
    c, s = math.cos(frame.yaw), math.sin(frame.yaw)
    # Cell centres in the world: frame * (x, y)
    world_x = frame.x + c * x[None, :] - s * y[:, None]
    world_y = frame.y + s * x[None, :] + c * y[:, None]
    return (world_x >= x0) & (world_x <= x1) & (world_y >= y0) & (world_y <= y1)


def _connected_to_start(free_cells: NDArray[np.bool_], grid: Grid, start: SE2) -> NDArray[np.bool_]:
    """Return the free cells in the 4-connected component of the start."""
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    labels, _ = ndimage.label(free_cells)
    label = labels[grid.cell(start.x, start.y)]
    if label == 0:
        raise UserError(f"the start ({start.x:.2f}, {start.y:.2f}) is not free in this world")
    return np.asarray(labels == label)
