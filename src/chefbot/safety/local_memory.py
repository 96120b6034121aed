"""Short memory of obstacles and of seen ground around the robot, in a frame that does not jump (odom).

A camera does not see what is near or beside the body. What it saw a moment ago is kept on a rolling grid: for each
cell the newest point of each layer with its time, and the time at which its ground was last seen free or covered by
the body. A point goes when a later measurement of its layer passes through its cell, when the body is there, or with
age. A cell belongs to all places that are a whole number of grids apart; which one it stores is written beside its
times.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LIDAR, CAMERA, UPRIGHT = range(3)
"""Layers: obstacles in the plane of the scan; obstacles of the camera that this plane may miss; obstacles of the
camera that extend through the plane, so that the scan clears them as well."""
LAYERS = 3
GROUND, VIEW = range(2)
"""How ground was seen: the floor itself; or only the space above it, in a sensor's view that nothing reaches into."""
NEVER_NS = np.int64(-1)
GRAZING_DISTANCE = 0.2
"""Cells beside a ray, or the distance to the next ray if that is more, within which it clears points."""
MAX_POINTS = 4096
"""Maximum number of remembered points that one check looks at; the others are farther away."""


class LocalMemory(NamedTuple):
    """The arrays of the memory.

    hit_ns (layers, n, n): times of the points, -1 for none. hit_xy (layers, n, n, 2): their positions, m. seen_ns
    (2, n, n), seen_cell (2, n, n, 2): when the ground was last seen free, and of which cell. resolution: m. All
    positions are in odom.
    """

    hit_ns: NDArray[np.int64]
    hit_xy: Floats
    seen_ns: NDArray[np.int64]
    seen_cell: NDArray[np.int64]
    resolution: float


def new_memory(half_side: float, resolution: float) -> LocalMemory:
    """Return an empty memory that reaches at least `half_side` metres in each direction."""
    n = 2 * math.ceil(half_side / resolution) + 2
    return LocalMemory(
        np.full((LAYERS, n, n), NEVER_NS),
        np.zeros((LAYERS, n, n, 2)),
        np.full((2, n, n), NEVER_NS),
        np.zeros((2, n, n, 2), np.int64),
        resolution,
    )


@njit(cache=True, nogil=True)
def clear_rays(
    memory: LocalMemory,
    sensor: Floats,
    angles: Floats,
    starts: Floats,
    ends: Floats,
    stamp_ns: int,
    layers: NDArray[np.bool_],
    shows: NDArray[np.bool_],
) -> None:
    """Remove older points of some layers along rays (n,) that were free from `starts` to `ends`, m from the sensor.

    sensor: its pose (3,) in odom. layers (3,): those that the rays clear. shows (2,): how the rays show the
    ground below them, `GROUND` and `VIEW`. Each cell that a ray crosses counts (Amanatides and Woo 1987).
    """
    n, resolution = memory.seen_ns.shape[1], memory.resolution
    reach = (n // 2 - 1) * resolution
    spacing = abs(angles[1] - angles[0]) if angles.shape[0] > 1 else math.tau  # the next ray is itself
    for i in range(angles.shape[0]):
        c, s = math.cos(sensor[2] + angles[i]), math.sin(sensor[2] + angles[i])
        start, end = max(starts[i], 0.0), min(ends[i], reach)
        if not start <= end:  # nothing within reach, or NaN
            continue
        column = math.floor((sensor[0] + start * c) / resolution)
        row = math.floor((sensor[1] + start * s) / resolution)
        r = start
        while r <= end:
            u, t = column % n, row % n
            for layer in range(LAYERS):
                if not layers[layer] or not NEVER_NS < memory.hit_ns[layer, t, u] < stamp_ns:
                    continue
                # a ray that passes beside a point in its cell shows nothing about it: it may be the edge of a surface
                dx, dy = memory.hit_xy[layer, t, u, 0] - sensor[0], memory.hit_xy[layer, t, u, 1] - sensor[1]
                if abs(dy * c - dx * s) <= max(GRAZING_DISTANCE * resolution, spacing * r):
                    memory.hit_ns[layer, t, u] = NEVER_NS
            for kind in range(2):
                if shows[kind] and memory.seen_ns[kind, t, u] < stamp_ns:
                    memory.seen_ns[kind, t, u] = stamp_ns
                    memory.seen_cell[kind, t, u, 0], memory.seen_cell[kind, t, u, 1] = column, row
            # the next cell is behind the nearer of the two edges that the ray leaves this one by
            to_column = ((column + (c > 0.0)) * resolution - sensor[0]) / c if c else math.inf
            to_row = ((row + (s > 0.0)) * resolution - sensor[1]) / s if s else math.inf
            if to_column < to_row:
                r, column = to_column, column + (1 if c > 0.0 else -1)
            else:
                r, row = to_row, row + (1 if s > 0.0 else -1)


@njit(cache=True, nogil=True)
def mark_points(
    memory: LocalMemory, sensor: Floats, angles: Floats, ranges: Floats, stamp_ns: int, layer: int
) -> None:
    """Store the ends of beams (n,) in a layer; of several points in a cell the one nearest to the sensor (3,)."""
    n, resolution = memory.seen_ns.shape[1], memory.resolution
    reach = (n // 2 - 1) * resolution
    for i in range(angles.shape[0]):
        r = ranges[i]
        if not 0.0 <= r <= reach:  # farther away, nothing, or no distance
            continue
        x = sensor[0] + r * math.cos(sensor[2] + angles[i])
        y = sensor[1] + r * math.sin(sensor[2] + angles[i])
        t, u = math.floor(y / resolution) % n, math.floor(x / resolution) % n
        held = memory.hit_xy[layer, t, u]
        nearer = math.hypot(held[0] - sensor[0], held[1] - sensor[1]) <= r
        if memory.hit_ns[layer, t, u] == stamp_ns and nearer:
            continue
        memory.hit_ns[layer, t, u] = stamp_ns
        held[0], held[1] = x, y


@njit(cache=True, nogil=True)
def _inside(x: float, y: float, radius: float, corners: Floats) -> bool:
    """Return whether a point in base_link is inside a disc or a convex polygon (n, 2); the edge is not."""
    n = corners.shape[0]
    if n == 0:
        return x * x + y * y < radius * radius
    for i in range(n):
        ax, ay, bx, by = corners[i, 0], corners[i, 1], corners[(i + 1) % n, 0], corners[(i + 1) % n, 1]
        if (bx - ax) * (y - ay) - (by - ay) * (x - ax) <= 0.0:
            return False
    return True


@njit(cache=True, nogil=True)
def cover_body(memory: LocalMemory, pose: Floats, radius: float, corners: Floats, now_ns: int) -> None:
    """Mark the ground below the body (a disc or a polygon) as seen, and remove points there: the robot is there.

    pose: of base_link (3,) in odom. radius: of the circle around the body, m.
    """
    n, resolution = memory.seen_ns.shape[1], memory.resolution
    c, s = math.cos(pose[2]), math.sin(pose[2])
    cells = math.ceil(radius / resolution)
    middle_column, middle_row = math.floor(pose[0] / resolution), math.floor(pose[1] / resolution)
    for row in range(middle_row - cells, middle_row + cells + 1):
        for column in range(middle_column - cells, middle_column + cells + 1):
            dx, dy = (column + 0.5) * resolution - pose[0], (row + 0.5) * resolution - pose[1]
            if not _inside(c * dx + s * dy, c * dy - s * dx, radius, corners):
                continue
            t, u = row % n, column % n
            for kind in range(2):
                memory.seen_ns[kind, t, u] = now_ns
                memory.seen_cell[kind, t, u, 0], memory.seen_cell[kind, t, u, 1] = column, row
            for layer in range(LAYERS):
                held = memory.hit_xy[layer, t, u]
                px, py = held[0] - pose[0], held[1] - pose[1]
                # a point in the cell, but outside the body, stays
                if _inside(c * px + s * py, c * py - s * px, radius - resolution / 2, corners):
                    memory.hit_ns[layer, t, u] = NEVER_NS


@njit(cache=True, nogil=True)
def points_around(
    memory: LocalMemory,
    pose: Floats,
    reach: float,
    oldest_ns: int,
    points: Floats,
    layers: NDArray[np.int64],
    stamps: NDArray[np.int64],
) -> int:
    """Fill points (m, 2) in base_link with those not farther than `reach` (m) and not older; return their number.

    pose: of base_link (3,) in odom. layers, stamps (m,): the layer and the time of each point. The cells are visited
    in squares around the robot, so that what does not find room is farther away.
    """
    n, resolution = memory.seen_ns.shape[1], memory.resolution
    c, s = math.cos(pose[2]), math.sin(pose[2])
    cells = min(math.ceil(reach / resolution), n // 2 - 1)
    middle_column, middle_row = math.floor(pose[0] / resolution), math.floor(pose[1] / resolution)
    found = 0
    for ring in range(cells + 1):
        for i in range(-ring, ring + 1):
            t = (middle_row + i) % n
            step = 1 if abs(i) == ring else 2 * ring  # of the rows between only both ends
            for j in range(-ring, ring + 1, step):
                u = (middle_column + j) % n
                for layer in range(LAYERS):
                    if memory.hit_ns[layer, t, u] < oldest_ns or memory.hit_ns[layer, t, u] == NEVER_NS:
                        continue
                    dx, dy = memory.hit_xy[layer, t, u, 0] - pose[0], memory.hit_xy[layer, t, u, 1] - pose[1]
                    if dx * dx + dy * dy > reach * reach:
                        continue  # farther away, or of another place that the cell stands for
                    if found == points.shape[0]:
                        return found
                    points[found, 0], points[found, 1] = c * dx + s * dy, c * dy - s * dx
                    layers[found], stamps[found] = layer, memory.hit_ns[layer, t, u]
                    found += 1
    return found


@njit(cache=True, nogil=True)
def _is_seen(memory: LocalMemory, x: float, y: float, oldest_ns: int, kind: int) -> bool:
    n, resolution = memory.seen_ns.shape[1], memory.resolution
    column, row = math.floor(x / resolution), math.floor(y / resolution)
    t, u = row % n, column % n
    known = memory.seen_cell[kind, t, u, 0] == column and memory.seen_cell[kind, t, u, 1] == row
    return known and memory.seen_ns[kind, t, u] >= oldest_ns and memory.seen_ns[kind, t, u] != NEVER_NS


@njit(cache=True, nogil=True)
def time_on_seen_ground(
    memory: LocalMemory,
    pose: Floats,
    v: float,
    w: float,
    outline: Floats,
    duration: float,
    oldest_ns: int,
    tolerated: int,
    kind: int,
) -> float:
    """Return the time (s) for which a twist keeps the body on ground seen since `oldest_ns`; inf for all of
    `duration`.

    outline (n, 2): points on the body's edge in base_link, at most a cell apart. tolerated: number of neighbouring
    points of it that may be over unseen ground, as between two rays.
    """
    fastest = 0.0
    for i in range(outline.shape[0]):
        fastest = max(fastest, math.hypot(v - w * outline[i, 1], w * outline[i, 0]))
    if fastest == 0.0:
        return math.inf
    step = memory.resolution / fastest
    for k in range(1, int(duration / step) + 2):
        # exact arc: over an angle of 2 half the chord is 2 r sin(half), in the mean direction
        half, ds = w * k * step / 2.0, v * k * step
        chord = ds if half == 0.0 else ds * math.sin(half) / half
        x, y = pose[0] + chord * math.cos(pose[2] + half), pose[1] + chord * math.sin(pose[2] + half)
        c, s = math.cos(pose[2] + 2.0 * half), math.sin(pose[2] + 2.0 * half)
        run = 0
        for i in range(outline.shape[0]):
            px, py = outline[i, 0], outline[i, 1]
            run = (
                0 if _is_seen(memory, x + c * px - s * py, y + s * px + c * py, oldest_ns, kind) else run + 1
            )
            if run > tolerated:
                return (k - 1) * step
    return math.inf
