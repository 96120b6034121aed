"""The floor of a world: a plane, or slabs around its holes; carpets on it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from chefbot.buildings.world_file import Carpet, FloorHole
from chefbot.maths.se2 import SE2
from chefbot.sim.world.shapes import RgbColour, SimulatedShape, box

SURROUNDINGS = 20.0
"""Width of floor around the bounds of a world with holes, m."""
SLAB = 0.2
"""Thickness of the bottom of a hole, m."""
COLOUR: RgbColour = (191, 178, 153)

SLAB_NAME = "floor/slab_"
"""Beginning of the names of the floor's boxes."""

Interval = tuple[float, float]


def floor_slabs(
    bounds: tuple[float, float, float, float], holes: Sequence[FloorHole]
) -> list[SimulatedShape]:
    """Return boxes with their tops at height 0 that cover all but the holes, and the bottoms of these."""
    x0, y0, x1, y1 = bounds
    outer = x0 - SURROUNDINGS, x1 + SURROUNDINGS
    thickness = SLAB + max(hole.depth for hole in holes)
    rows = _cuts((y0 - SURROUNDINGS, y1 + SURROUNDINGS), [_along(hole.y, hole.size[1]) for hole in holes])
    slabs = [
        _slab((left, right), row, 0.0, thickness)
        for row in rows
        for left, right in _uncovered(outer, [_along(h.x, h.size[0]) for h in holes if _spans(h, row)])
    ]
    bottoms = [
        _slab(_along(h.x, h.size[0]), _along(h.y, h.size[1]), -h.depth, thickness - h.depth) for h in holes
    ]
    return [slab._replace(name=f"{SLAB_NAME}{i}") for i, slab in enumerate(slabs + bottoms)]


def over_holes(holes: Sequence[FloorHole], height: float) -> list[SimulatedShape]:
    """Return boxes of `height` metres over the holes: where a robot cannot go."""
    return [
        box(hole.name, SE2(hole.x, hole.y, 0.0), 0.0, (hole.size[0], hole.size[1], height), COLOUR)
        for hole in holes
    ]


def carpet_at(carpets: Sequence[Carpet], x: float, y: float) -> Carpet | None:
    """Return the uppermost carpet at a point, None on bare floor."""
    for carpet in reversed(carpets):
        local = carpet.pose.between(SE2(x, y, 0.0))
        if abs(local.x) <= carpet.size[0] / 2 and abs(local.y) <= carpet.size[1] / 2:
            return carpet
    return None


def _along(centre: float, size: float) -> Interval:
    return centre - size / 2, centre + size / 2


def _cuts(extent: Interval, intervals: Sequence[Interval]) -> list[Interval]:
    """Divide the extent at all ends of the intervals."""
    ends = sorted({*extent, *(end for interval in intervals for end in interval)})
    return list(pairwise(ends))


def _spans(hole: FloorHole, row: Interval) -> bool:
    """Return whether the hole takes the row from its lower to its upper end."""
    low, high = _along(hole.y, hole.size[1])
    return low <= row[0] and row[1] <= high


def _uncovered(extent: Interval, covered: Sequence[Interval]) -> list[Interval]:
    """Return the parts of the extent that no interval covers."""
    parts, at = [], extent[0]
    for low, high in sorted(covered):
        if low > at:
            parts.append((at, low))
        at = max(at, high)
    return [*parts, (at, extent[1])] if at < extent[1] else parts


def _slab(across: Interval, along: Interval, top: float, thickness: float) -> SimulatedShape:
    centre = SE2((across[0] + across[1]) / 2, (along[0] + along[1]) / 2, 0.0)
    size = (across[1] - across[0], along[1] - along[0], thickness)
    return box("floor", centre, top - thickness, size, COLOUR)
