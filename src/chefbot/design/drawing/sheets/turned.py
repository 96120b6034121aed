"""Poles and tubes: section along the axis, and view along it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chefbot.design.drawing.drawing import MM, Hatch, Item, Linear, Plan, loop_box, number, segment
from chefbot.design.drawing.sheets.common import OVERHANG, cross, pieces, row, shape_items, title
from chefbot.design.drawing.views import View, cut, seen
from chefbot.maths.outline import Corner, Loop
from chefbot.robot.geometry.shapes import Prism

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

LYING_VIEW = View((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
AXIAL_VIEW = View((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
VIEW_SPACING = 30.0
"""Of the two views, mm on paper."""


def turned(robot: Robot, kind: str, factor: float) -> Plan:
    """Return the sheet of a pole, a rod with a bore for the screw, or of a tube that slides over two poles."""
    solid = pieces(robot, kind)[0].solids[0]
    assert isinstance(solid, Prism)
    length, radius = solid.length * MM, loop_box(solid.outline.edge).width * MM / 2
    bore = loop_box(solid.outline.holes[0]).width * MM / 2
    items = _section(solid, factor) + _end(solid, length / 2 + VIEW_SPACING * factor + radius, factor)
    items += [
        Linear((-length / 2, -radius), (length / 2, -radius), "x", -radius - row(0, factor)),
        Linear((-length / 2, -radius), (-length / 2, radius), "y", -length / 2 - row(1, factor), "Ø<>"),
        Linear((-length / 2, -bore), (-length / 2, bore), "y", -length / 2 - row(0, factor), "Ø<>"),
    ]
    size = f"Ø{number(2 * radius)} x {number(length)}"
    return Plan(title(robot, kind, size), tuple(items))


def _section(solid: Prism, factor: float) -> list[Item]:
    """Walls hatched, the bore's edges at both ends, the axis."""
    half = solid.length * MM / 2
    walls = [_wall(low * MM, high * MM, half) for low, high in cut(solid.outline)]
    shape = seen(solid, LYING_VIEW)
    items: list[Item] = [Hatch((wall,)) for wall in walls]
    items += shape_items(shape, hidden=False)
    for bore in map(loop_box, shape.hidden):
        items += [segment("HOLES", (bore.left, y), (bore.right, y)) for y in (bore.low, bore.high)]
    overhang = half + OVERHANG * factor
    return [*items, segment("CENTRE", (-overhang, 0.0), (overhang, 0.0))]


def _wall(low: float, high: float, half: float) -> Loop:
    return (Corner(half, low), Corner(half, high), Corner(-half, high), Corner(-half, low))


def _end(solid: Prism, x: float, factor: float) -> list[Item]:
    """Seen along the axis; the wall's radius where the part is a tube's or rod's outside."""
    shape = seen(solid._replace(at=(x / MM, 0.0, 0.0)), AXIAL_VIEW)
    radius = loop_box(shape.edge).width / 2
    return [*shape_items(shape), *cross(x, 0.0, radius, factor)]
