"""Changes of the map itself, as a message requests them."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from chefbot.errors import UserError
from chefbot.mapping.map_changes import cropped, rotated, with_stroke
from chefbot.maths.grid import FREE, OCCUPIED, OCCUPIED_THRESHOLD, UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import MapEdit, MapZone
from chefbot.msgs.geometry_msgs import Point
from chefbot.storage.places import PlaceEntry

BRUSH_VALUES = (OCCUPIED, FREE, UNKNOWN)


def changes_grid(edit: MapEdit) -> bool:
    """Return whether a change concerns the map itself."""
    return bool(edit.strokes or edit.crop or edit.rotation)


def edited_grid(grid: Grid, edit: MapEdit) -> Grid:
    """Return the map after strokes, crop and rotation, in this order. Raises UserError or MapFormatError."""
    for stroke in edit.strokes:
        if stroke.value not in BRUSH_VALUES:
            raise UserError(f"a stroke has the value 100, 0 or -1, not {stroke.value}")
        points = np.array([(point.x, point.y) for point in stroke.points])
        grid = with_stroke(grid, points, stroke.width, stroke.value)
    if edit.crop:
        if len(edit.crop) != 2:
            raise UserError("a crop has two corners")
        (x, other_x), (y, other_y) = ([getattr(point, axis) for point in edit.crop] for axis in "xy")
        low, high = (min(x, other_x), min(y, other_y)), (max(x, other_x), max(y, other_y))
        grid = cropped(grid, low, high)
    if edit.rotation:
        grid = rotated(grid, edit.rotation)
    if not (grid.cells >= OCCUPIED_THRESHOLD).any():
        raise UserError("the map would have no wall left, so no scan could be matched to it")
    return grid


def same_cells(grid: Grid, other: Grid) -> bool:
    """Return whether two maps have the same cells at the same place."""
    place, other_place = ((one.resolution, one.origin_x, one.origin_y) for one in (grid, other))
    return place == other_place and np.array_equal(grid.cells, other.cells)


def turned_entry(entry: PlaceEntry, yaw: float) -> PlaceEntry:
    """Return a place on a map that was turned about the origin of its frame, rad."""
    pose = SE2(0.0, 0.0, yaw) @ SE2(entry.x, entry.y, entry.yaw)
    return msgspec.structs.replace(entry, x=pose.x, y=pose.y, yaw=pose.yaw)


def turned_zone(zone: MapZone, yaw: float) -> MapZone:
    """Return a zone on a map that was turned about the origin of its frame, rad."""
    corners = SE2(0.0, 0.0, yaw).apply(zone.array)
    points = tuple(Point(float(x), float(y), 0.0) for x, y in corners)
    direction = (
        math.remainder(zone.direction + yaw, math.tau) if zone.direction or zone.kind == "one_way" else 0.0
    )
    return msgspec.structs.replace(zone, corners=points, direction=direction)
