"""Checks the zones of a map: invalid polygons, contradicting lanes, places in keep-out zones."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

from chefbot.errors import ChefbotError
from chefbot.maths.grid import Grid
from chefbot.maths.lanes import MAX_LANES
from chefbot.maths.polygon import contains
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, MapZone

if TYPE_CHECKING:
    from shapely import Polygon

OVERLAP_AREA = 0.01
"""Area up to which two lanes touch and do not overlap, m^2: drawn by hand, edges seldom coincide."""
CROSSES, FEW_CORNERS, NO_AREA = (
    "its edges cross or touch each other",
    "it needs three corners or more",
    "it has no area",
)


class ZoneError(ChefbotError):
    """Zones that contradict each other or the map; the message names them."""


class ZoneReport(NamedTuple):
    """Warnings about zones that can be obeyed, a sentence each."""

    warnings: tuple[str, ...]


def check_zones(zones: tuple[MapZone, ...], grid: Grid | None, places: Mapping[str, SE2]) -> ZoneReport:
    """Return warnings about the zones of a map with its named places; raise ZoneError if they cannot be obeyed.

    grid: the map, None if it is not known.
    """
    shapes = {zone.name: _shape(zone) for zone in zones}
    _check_lanes([zone for zone in zones if zone.kind == ONE_WAY], shapes)
    warnings = [*_outside_map(zones, shapes, grid)] if grid is not None else []
    return ZoneReport((*warnings, *_covered(zones, shapes), *_unreachable_places(zones, places)))


def _shape(zone: MapZone) -> Polygon:
    """Return a zone's polygon; ZoneError if it is invalid."""
    from shapely import Polygon  # takes a quarter of a second, and only maps with zones need it

    if len(zone.corners) < 3:
        raise ZoneError(f"{zone.title}: {FEW_CORNERS}, and has {len(zone.corners)}")
    shape = Polygon(zone.array)
    if shape.convex_hull.area <= 0.0:
        raise ZoneError(f"{zone.title}: {NO_AREA}")
    if not shape.is_valid:
        raise ZoneError(f"{zone.title}: {CROSSES}")
    return shape


def _check_lanes(lanes: list[MapZone], shapes: Mapping[str, Polygon]) -> None:
    """Raise ZoneError if two one-way lanes overlap: no step there would obey both."""
    if len(lanes) > MAX_LANES:
        raise ZoneError(f"there are {len(lanes)} one-way lanes; at most {MAX_LANES} are supported")
    for a, b in combinations(lanes, 2):
        common = shapes[a.name].intersection(shapes[b.name])
        if common.area > OVERLAP_AREA:
            at = common.representative_point()
            between = abs(math.degrees(math.remainder(b.direction - a.direction, math.tau)))
            raise ZoneError(
                f"the {a.title} and the {b.title} overlap at x {at.x:.2f} m, y {at.y:.2f} m, and their "
                f"directions differ by {between:.0f} deg; end one where the other begins"
            )


def _outside_map(zones: tuple[MapZone, ...], shapes: Mapping[str, Polygon], grid: Grid) -> Iterator[str]:
    """Yield the zones that lie partly outside the map; ZoneError for one that lies outside altogether."""
    from shapely import box

    right = grid.origin_x + grid.width * grid.resolution
    top = grid.origin_y + grid.height * grid.resolution
    area = box(grid.origin_x, grid.origin_y, right, top)
    for zone in zones:
        shape = shapes[zone.name]
        if not shape.intersects(area):
            raise ZoneError(
                f"the {zone.title} lies outside the map, which extends over x {grid.origin_x:.2f} to {right:.2f} m, "
                f"y {grid.origin_y:.2f} to {top:.2f} m"
            )
        if not shape.within(area):
            yield f"The {zone.title} lies partly outside the map."


def _covered(zones: tuple[MapZone, ...], shapes: Mapping[str, Polygon]) -> Iterator[str]:
    """Yield the zones of other kinds that lie inside a keep-out zone and so have no effect."""
    for zone in zones:
        for other in zones:
            inside = other.kind == KEEP_OUT != zone.kind and shapes[zone.name].within(shapes[other.name])
            if inside:
                yield f"The {zone.title} lies in the {other.title} and has no effect."


def _unreachable_places(zones: tuple[MapZone, ...], places: Mapping[str, SE2]) -> Iterator[str]:
    """Yield the named places that lie inside a keep-out zone."""
    for name, pose in places.items():
        for zone in zones:
            if zone.kind == KEEP_OUT and contains(zone.array, pose.x, pose.y):
                yield f"The place {name} lies in the {zone.title} and cannot be reached."
