"""Furniture of a room by its use."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from numpy.random import Generator

from chefbot.buildings import furniture
from chefbot.buildings.furnishing import Furnishing
from chefbot.buildings.layout import Use
from chefbot.maths.se2 import SE2


class Interior(NamedTuple):
    """A room that is being furnished. numbers: of the building. radius: of the robot, m."""

    room: Furnishing
    numbers: Mapping[str, float]
    radius: float
    rng: Generator

    def some(self, usual: float) -> int:
        """Return how many pieces of `usual` there are, by the share of furniture, at random rounded."""
        return int(usual * self.numbers["furniture"] + float(self.rng.random()))


def _office(one: Interior) -> None:
    for _ in range(max(1, one.some(one.room.floor.area / 7.0))):
        one.room.at_wall(furniture.desk(one.rng), one.rng)
    for _ in range(one.some(1.5)):
        one.room.at_wall(furniture.cupboard("cupboard", 1.0, 0.45, 1.8), one.rng)


def _meeting(one: Interior) -> None:
    x, y = one.room.floor.centre
    yaw = 0.0 if one.room.floor.width > one.room.floor.depth else math.pi / 2
    one.room.add(furniture.meeting_table(one.rng), SE2(round(x, 3), round(y, 3), yaw))


def _kitchen(one: Interior) -> None:
    length = round(min(2.4, 0.6 * max(one.room.floor.width, one.room.floor.depth)), 2)
    one.room.at_wall(furniture.cupboard("counter", length, 0.6, 0.9, "#c9c2b5"), one.rng)
    one.room.at_wall(furniture.cupboard("fridge", 0.6, 0.6, 1.8, "#e4e6e8"), one.rng)


def _dining(one: Interior) -> None:
    for _ in range(max(1, one.some(one.room.floor.area / 8.0))):
        piece = furniture.dining_table(one.rng, 0.8, int(one.rng.integers(1, 5)))
        _ = one.room.inside(piece, one.rng) or one.room.at_wall(piece, one.rng)


def _bedroom(one: Interior) -> None:
    one.room.at_wall(furniture.cupboard("bed", 1.6, 2.0, 0.5, "#b9a7c4"), one.rng)
    for _ in range(one.some(1.0)):
        one.room.at_wall(furniture.desk(one.rng), one.rng)
    one.room.at_wall(furniture.cupboard("wardrobe", 1.2, 0.6, 2.0), one.rng)


def _living(one: Interior) -> None:
    one.room.at_wall(furniture.cupboard("sofa", 2.0, 0.9, 0.75, "#6f7f92"), one.rng)
    one.room.inside(furniture.dining_table(one.rng, 0.9, 0), one.rng)
    one.room.at_wall(furniture.cupboard("sideboard", 1.6, 0.4, 0.6), one.rng)


def _store(one: Interior) -> None:
    for _ in range(one.some(one.room.floor.area / 5.0)):
        one.room.at_wall(furniture.cupboard("shelf", 1.2, 0.4, 2.0), one.rng)


def _hall(one: Interior) -> None:
    spacing = one.numbers.get("column_spacing", 5.0)
    one.room.in_rows(furniture.column(one.rng, round(one.numbers["wall_height"], 2)), (spacing, spacing))
    for _ in range(one.some(one.room.floor.area / 40.0)):
        one.room.inside(furniture.dining_table(one.rng, 0.8, int(one.rng.integers(0, 5))), one.rng)
    for _ in range(one.some(one.room.floor.area / 60.0)):
        one.room.at_wall(furniture.cupboard("bench", 1.6, 0.45, 0.45, "#7a5c3e"), one.rng)


def _racks(one: Interior) -> None:
    n = one.numbers
    piece = furniture.rack(round(n["rack_length"], 2), 1.0, n["shelf"])
    for left in (0.0, 0.5):  # two halves with a cross aisle between them
        half = one.room.floor._replace(
            x0=one.room.floor.x0 + left * one.room.floor.width,
            x1=one.room.floor.x0 + (left + 0.5) * one.room.floor.width,
        )
        block = Furnishing(half, (), n["aisle"])
        block.in_rows(piece, (n["rack_length"] + n["aisle"], 1.0 + n["aisle"]))
        for placed in block.pieces:
            one.room.add(piece, placed.pose)


def _gates(one: Interior) -> None:
    """Two blocks across the room leave a gate that is a little wider than the robot."""
    floor, gap = one.room.floor, round(2 * one.radius + one.numbers["gap"], 3)
    depth = round(float(one.rng.uniform(0.3, 0.8)), 2)
    gate = round(float(one.rng.uniform(floor.x0 + 0.5, floor.x1 - 0.5 - gap)), 3)
    y = round(floor.centre[1], 3)
    for x0, x1 in ((floor.x0, gate), (gate + gap, floor.x1)):
        width = round(x1 - x0, 3)
        block = furniture.cupboard("gate", width, depth, 1.2, "#8f9aa3")
        one.room.add(block, SE2(round((x0 + x1) / 2, 4), y, 0.0), 0.0)


def _nothing(_: Interior) -> None:
    """Leave the room empty."""


INTERIORS: Mapping[Use, Callable[[Interior], None]] = {
    Use.CORRIDOR: _nothing,
    Use.OFFICE: _office,
    Use.MEETING: _meeting,
    Use.KITCHEN: _kitchen,
    Use.DINING: _dining,
    Use.BEDROOM: _bedroom,
    Use.LIVING: _living,
    Use.STORE: _store,
    Use.HALL: _hall,
    Use.RACKS: _racks,
    Use.GATES: _gates,
    Use.SOLID: _nothing,
}
"""How a room of each use is furnished."""


def add_clutter(one: Interior) -> None:
    """Add clutter and moved chairs, in proportion to the floor."""
    area = one.room.floor.area
    for density, make in (("clutter", furniture.clutter), ("moved_chairs", furniture.moved_chair)):
        count = int(one.rng.poisson(area * one.numbers[density]))
        for _ in range(count):
            piece = make(one.rng)
            _ = one.room.inside(piece, one.rng) or one.room.at_wall(piece, one.rng)
