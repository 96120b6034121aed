"""Which remembered points a ray clears, and which ground it shows, against a clipping of each cell."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.safety.local_memory import (
    CAMERA,
    GRAZING_DISTANCE,
    GROUND,
    LIDAR,
    LocalMemory,
    clear_rays,
    new_memory,
)

RESOLUTION, CELLS, REACH = 0.125, 22, 1.25
"""Numbers that binary fractions hold. CELLS: side of the grid, cells. REACH: of a ray, m."""
ALL_LAYERS, BOTH = np.ones(3, np.bool_), np.ones(2, np.bool_)
TOO_CLOSE = 1e-6
"""m: at the borders of a cell and of the grazing distance rounding decides, so no point is put there."""
Floats = NDArray[np.float64]
Cell = tuple[int, int]


def length_within(cell: Cell, sensor: Floats, angle: float, start: float, end: float) -> float:
    """Return the length (m) of the ray from `start` to `end` within a cell, negative without any (Liang-Barsky)."""
    for axis, slope in ((0, math.cos(sensor[2] + angle)), (1, math.sin(sensor[2] + angle))):
        low, high = cell[axis] * RESOLUTION - sensor[axis], (cell[axis] + 1) * RESOLUTION - sensor[axis]
        if abs(slope) < 1e-12:
            if not low <= 0.0 < high:
                return -math.inf
            continue
        first, last = sorted((low / slope, high / slope))
        start, end = max(start, first), min(end, last)
    return end - start


def distance_beside(point: Floats, sensor: Floats, angle: float) -> float:
    """Return the distance (m) of a point from the line of a ray."""
    bearing = math.atan2(point[1] - sensor[1], point[0] - sensor[0]) - sensor[2] - angle
    return abs(math.dist(point, sensor[:2]) * math.sin(bearing))


def cells_around(sensor: Floats) -> list[Cell]:
    """Return all cells that the grid can hold around a sensor."""
    column, row = math.floor(sensor[0] / RESOLUTION), math.floor(sensor[1] / RESOLUTION)
    return [(column + i, row + j) for i in range(-10, 11) for j in range(-10, 11)]


def full_memory(points: dict[Cell, Floats], layer: int) -> LocalMemory:
    """Return a memory with one old point in each cell."""
    memory = new_memory(10.0 * RESOLUTION, RESOLUTION)
    for (column, row), xy in points.items():
        memory.hit_ns[layer, row % CELLS, column % CELLS] = 1
        memory.hit_xy[layer, row % CELLS, column % CELLS] = xy
    return memory


def points_left(memory: LocalMemory, points: dict[Cell, Floats], layer: int) -> set[Cell]:
    """Return the cells whose point is still remembered."""
    return {(u, v) for u, v in points if memory.hit_ns[layer, v % CELLS, u % CELLS] == 1}


def ground_seen(memory: LocalMemory, cells: list[Cell]) -> set[Cell]:
    """Return the cells whose ground was seen by the ray."""
    return {
        (u, v)
        for u, v in cells
        if memory.seen_ns[GROUND, v % CELLS, u % CELLS] == 2
        and memory.seen_cell[GROUND, v % CELLS, u % CELLS].tolist() == [u, v]
    }


def distance_of_entry(cell: Cell, sensor: Floats, angle: float) -> float:
    """Return the distance (m) at which a ray enters a cell, 0 where the sensor is in it."""
    entries = [0.0]
    for axis, slope in ((0, math.cos(sensor[2] + angle)), (1, math.sin(sensor[2] + angle))):
        edges = ((cell[axis] + k) * RESOLUTION - sensor[axis] for k in (0, 1))
        entries.append(min(edge / slope for edge in edges))
    return max(entries)


@pytest.mark.parametrize("neighbour", [None, -0.05, -0.01, 0.01, 0.05])
@pytest.mark.parametrize("seed", range(1, 60, 2))
def test_a_ray_clears_what_it_passes_close_by(seed: int, neighbour: float | None) -> None:
    """From any place in any direction: up to the grazing distance, or to the next ray if that is farther.

    Of a ray alone the next one is itself, a full turn away.
    """
    rng = np.random.default_rng(seed)
    sensor = np.array([*rng.uniform(-3.0, 3.0, 2), rng.uniform(-math.pi, math.pi)])
    angle, (start, end) = rng.uniform(-math.pi, math.pi), np.sort(rng.uniform(0.0, 1.1 * REACH, 2)).tolist()
    angles = np.array([angle] if neighbour is None else [angle, angle + neighbour])
    spacing = math.tau if neighbour is None else abs(neighbour)
    starts, ends = np.full(len(angles), start), np.full(len(angles), -1.0)
    ends[0] = end  # the neighbour sees nothing
    cells = cells_around(sensor)
    points = {cell: (np.array(cell) + rng.uniform(0.01, 0.99, 2)) * RESOLUTION for cell in cells}
    memory = full_memory(points, CAMERA)
    clear_rays(memory, sensor, angles, starts, ends, 2, ALL_LAYERS, BOTH)
    seen, left = ground_seen(memory, cells), points_left(memory, points, CAMERA)
    for cell in cells:
        length = length_within(cell, sensor, angle, start, min(end, REACH))
        limit = max(
            GRAZING_DISTANCE * RESOLUTION, spacing * max(start, distance_of_entry(cell, sensor, angle))
        )
        margin = limit - distance_beside(points[cell], sensor, angle)
        if min(abs(length), abs(margin)) > TOO_CLOSE:
            assert (cell in seen) == (length > 0.0)
            assert (cell in left) == (length < 0.0 or margin < 0.0)


@pytest.mark.parametrize(
    ("offset", "kept"), [(0.025, False), (-0.025, False), (0.0375, True), (-0.0375, True)]
)
def test_a_point_beside_a_ray_stays_on_either_side(offset: float, kept: bool) -> None:
    """Along the x axis through the middle of a row; 0.2 cells of 0.125 m are 0.025 m."""
    sensor = np.array([0.0625, 0.0625, 0.0])
    cell = (4, 0)
    points = {cell: np.array([0.5625, 0.0625 + offset * (1.0 - 1e-9)])}
    memory = full_memory(points, LIDAR)
    angles = np.array([0.0, 1e-9])
    clear_rays(memory, sensor, angles, np.zeros(2), np.array([REACH, -1.0]), 2, ALL_LAYERS, BOTH)
    assert (cell in points_left(memory, points, LIDAR)) == kept


def test_a_ray_through_a_corner_goes_on_diagonally() -> None:
    """At a corner of four cells the one beyond is next; of those beside it one may count."""
    sensor, half = np.array([0.0625, 0.0625, 0.0]), math.pi / 4
    cells = cells_around(sensor)
    points = {cell: (np.array(cell) + 0.5) * RESOLUTION for cell in cells}
    memory = full_memory(points, LIDAR)
    clear_rays(memory, sensor, np.array([half]), np.zeros(1), np.array([0.6]), 2, ALL_LAYERS, BOTH)
    seen = ground_seen(memory, cells)
    assert {(i, i) for i in range(4)} <= seen and all(abs(u - v) <= 1 for u, v in seen)
