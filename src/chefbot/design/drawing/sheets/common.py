"""Functions that several sheets use: centre lines, shapes as items, title blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chefbot.design.drawing.drawing import FIRST_ROW, ROW, Item, Title, loop_item, segment
from chefbot.design.drawing.views import ViewShape
from chefbot.robot.geometry.solids import RobotPart, solids

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

OVERHANG = 2.5
"""Of centre lines beyond the edge, mm on paper."""


def pieces(robot: Robot, kind: str) -> list[RobotPart]:
    """Return all equal parts of a kind."""
    return [part for part in solids(robot) if part.kind == kind]


def title(robot: Robot, kind: str, size: str) -> Title:
    """Return name, material, number and mass of a kind of part."""
    parts = pieces(robot, kind)
    name = kind.replace("_", " ").capitalize()
    return Title(robot.name, name, parts[0].material, size, len(parts), parts[0].mass)


def shape_items(shape: ViewShape, hidden: bool = True) -> list[Item]:
    """Return edges, holes and hidden bores of a shape."""
    items: list[Item] = [loop_item("OUTLINE", shape.edge)]
    items += [loop_item("HOLES", hole) for hole in shape.holes]
    return items + ([loop_item("HOLES", bore, hidden=True) for bore in shape.hidden] if hidden else [])


def cross(x: float, y: float, radius: float, factor: float) -> list[Item]:
    """Return the centre lines of a circle."""
    reach = radius + OVERHANG * factor
    return [
        segment("CENTRE", (x - reach, y), (x + reach, y)),
        segment("CENTRE", (x, y - reach), (x, y + reach)),
    ]


def row(number: int, factor: float) -> float:
    """Return the distance of a row of dimension lines from the view; row 0 is the nearest."""
    return (FIRST_ROW + number * ROW) * factor
