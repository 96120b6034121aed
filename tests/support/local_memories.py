"""A local memory of the collision monitor, as its tests fill and read it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.safety.local_memory import (
    GROUND,
    LIDAR,
    LocalMemory,
    clear_rays,
    mark_points,
    new_memory,
    points_around,
    time_on_seen_ground,
)

RESOLUTION, HALF_SIDE = 0.1, 1.0
ORIGIN = np.zeros(3)
ALL_LAYERS, NO_LAYER = np.ones(3, np.bool_), np.zeros(3, np.bool_)
BOTH = np.array([True, True])
Floats = NDArray[np.float64]


def memory() -> LocalMemory:
    """Return an empty memory of ten cells in each direction."""
    return new_memory(HALF_SIDE, RESOLUTION)


def at(*pose: float) -> Floats:
    """Return numbers as an array, such as a pose."""
    return np.array(pose)


def mark(one: LocalMemory, x: float, y: float, stamp_ns: int = 1, layer: int = LIDAR) -> None:
    """Mark a point in odom, seen from the origin."""
    mark_points(one, ORIGIN, at(math.atan2(y, x)), at(math.hypot(x, y)), stamp_ns, layer)


def clear(
    one: LocalMemory, angle: float, start: float, end: float, stamp_ns: int = 2,
    layers: NDArray[np.bool_] = ALL_LAYERS, shows: NDArray[np.bool_] = BOTH, sensor: Floats = ORIGIN,
) -> None:  # fmt: skip
    """Clear along one ray at an angle from a sensor."""
    clear_rays(one, sensor, at(angle), at(start), at(end), stamp_ns, layers, shows)


def found(
    one: LocalMemory, pose: Floats = ORIGIN, reach: float = 0.9, oldest_ns: int = 0, room: int = 100
) -> Floats:
    """Return x, y, layer and stamp (n, 4) of the points around a pose."""
    points, layers, stamps = np.zeros((room, 2)), np.zeros(room, np.int64), np.zeros(room, np.int64)
    count = points_around(one, pose, reach, oldest_ns, points, layers, stamps)
    return np.column_stack([points, layers, stamps])[:count]


def free_time(
    one: LocalMemory, v: float, w: float, outline: Floats, pose: Floats = ORIGIN,
    duration: float = 1.0, oldest_ns: int = 0, tolerated: int = 0, kind: int = GROUND,
) -> float:  # fmt: skip
    """Return the time for which an outline stays on seen ground."""
    return time_on_seen_ground(one, pose, v, w, outline, duration, oldest_ns, tolerated, kind)


def is_seen(one: LocalMemory, x: float, y: float, oldest_ns: int = 0, kind: int = GROUND) -> bool:
    """Return whether the ground at a place is known: where a point drives that begins a cell before it."""
    before = at(x - RESOLUTION, y, 0.0)
    return free_time(one, 0.1, 0.0, at(0.0, 0.0)[None], before, 0.5, oldest_ns, kind=kind) == math.inf


def see_all(one: LocalMemory, stamp_ns: int, kinds: NDArray[np.bool_] = BOTH) -> None:
    """See the ground in all directions around the origin."""
    for angle in np.linspace(-math.pi, math.pi, 200):
        clear(one, float(angle), 0.0, 0.9, stamp_ns, NO_LAYER, kinds)
