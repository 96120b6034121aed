"""The floor that a round robot reaches, as a polygon."""

from __future__ import annotations

import math
from collections.abc import Iterable

from shapely import Geometry, Point, affinity, box, prepare, unary_union

from chefbot.buildings.rectangle import Rectangle, around
from chefbot.buildings.world_file import Door, Wall

PLACE_MARGIN = 0.15
"""Room that a place leaves around the robot, m."""
PASSAGE_MARGIN, NARROW_MARGIN = 0.08, 0.0245
"""Room that the narrowest passage leaves on both sides of the robot, m: so much that a grid of 5 cm shows it, and
in a building of narrow gaps half of the smallest `gap` less a rounding, also beside the leaf of a door."""


class ReachableFloor:
    """The largest part of the rooms that a disc of `radius` metres reaches between obstacles.

    margin: room that a passage leaves on both sides of the disc, m.
    """

    def __init__(
        self, rooms: Iterable[Rectangle], obstacles: Iterable[Geometry], radius: float, margin: float
    ) -> None:
        inside, solid = unary_union([box(*room) for room in rooms]), unary_union(list(obstacles))
        passable = inside.difference(solid.buffer(radius + margin, quad_segs=4))
        parts = list(getattr(passable, "geoms", [passable]))
        self.centres: Geometry = max(parts, key=lambda part: part.area)
        """Where the disc's centre may be."""
        comfortable = inside.difference(solid.buffer(radius + PLACE_MARGIN, quad_segs=4))
        self._places = comfortable.intersection(self.centres)
        prepare(self._places)

    def holds(self, x: float, y: float) -> bool:
        """Return whether the disc gets to a point and has room to spare there."""
        return bool(self._places.contains(Point(x, y)))


def floor_of_piece(rect: Rectangle) -> Geometry:
    """Return the floor that a piece of furniture takes."""
    return box(*rect)


def floor_of_wall(wall: Wall) -> list[Geometry]:
    """Return the floor that a wall along an axis takes between its openings."""
    x0, y0 = wall.start
    vertical, length = x0 == wall.end[0], math.dist(wall.start, wall.end)
    stops = [-wall.thickness / 2]
    for opening in sorted(wall.openings, key=lambda o: o.at):
        stops += [opening.at - opening.width / 2, opening.at + opening.width / 2]
    stops.append(length + wall.thickness / 2)
    floors = []
    for low, high in zip(stops[::2], stops[1::2], strict=True):
        middle, extent = (low + high) / 2, high - low
        rect = (
            around(x0, y0 + middle, wall.thickness, extent)
            if vertical
            else around(x0 + middle, y0, extent, wall.thickness)
        )
        floors.append(box(*rect))
    return floors


def floor_of_door(door: Door) -> Geometry:
    """Return the floor that the leaf of a hinged door takes as far open as it is."""
    leaf = box(0.0, -door.thickness / 2, door.width, door.thickness / 2)
    turned = affinity.rotate(leaf, door.yaw + door.open * door.swing, origin=(0.0, 0.0), use_radians=True)
    return affinity.translate(turned, door.x, door.y)
