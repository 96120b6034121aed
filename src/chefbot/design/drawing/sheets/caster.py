"""A caster: section through the middle, and view from below."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chefbot.design.drawing.drawing import (
    MM,
    BoundingBox,
    Circle,
    Hatch,
    Item,
    Linear,
    Plan,
    Radial,
    Text,
    around,
    loop_box,
    moved,
    number,
    rectangle,
    segment,
)
from chefbot.design.drawing.hidden_lines import visible
from chefbot.design.drawing.sheets.common import OVERHANG, cross, pieces, row, title
from chefbot.design.drawing.views import SIDE, View, cut, seen
from chefbot.robot.geometry.shapes import Ball, Prism

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

FROM_BELOW = View((1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
VIEW_SPACING = 14.0
"""Of both views, mm on paper."""


def caster(robot: Robot, factor: float) -> Plan:
    """Return the sheet of ball, cup and spacer; the ball is not hatched (ISO 128-44)."""
    solids = pieces(robot, "caster")[0].solids
    box = around(loop_box(seen(solid, SIDE).edge) for solid in solids)
    items = [item for solid in solids for item in _section(solid)]
    axis = OVERHANG * factor
    items.append(segment("CENTRE", (0.0, box.low - axis), (0.0, box.high + axis)))
    items += _sizes(robot, box, factor)
    below = [item for one in visible([seen(solid, FROM_BELOW) for solid in solids]) for item in one.items]
    below += cross(0.0, 0.0, box.width / 2, factor)
    shift = box.right + VIEW_SPACING * factor + row(1, factor) + box.width / 2
    items += [moved(item, shift, box.middle[1]) for item in below]
    caption = box.middle[1] + box.width / 2 + 6.0 * factor
    items.append(Text("TITLE", shift, caption, "From below", 3.5, "middle"))
    size = f"Ø{number(box.width)} x {number(box.height)}"
    return Plan(title(robot, "caster", size), tuple(items))


def _section(solid: Ball | Prism) -> list[Item]:
    if isinstance(solid, Ball):
        return [Circle("OUTLINE", solid.at[0] * MM, solid.at[2] * MM, solid.radius * MM)]
    low, high = ((solid.at[2] + side * solid.length / 2) * MM for side in (-1, 1))
    walls = [rectangle("OUTLINE", BoundingBox(a * MM, low, b * MM, high)) for a, b in cut(solid.outline)]
    return [item for wall in walls for item in (Hatch((wall.corners,)), wall)]


def _sizes(robot: Robot, box: BoundingBox, factor: float) -> list[Item]:
    """Ball, cup, spacer, all."""
    radius = robot.casters.radius * MM
    right = box.right + row(0, factor)
    return [
        Radial("radius", 0.0, 0.0, radius, 205.0, 8.0),
        Linear((box.right, 0.0), (box.right, radius), "y", right),
        Linear((0.0, box.low), (box.right, box.high), "y", box.right + row(1, factor)),
        Linear((box.left, box.high), (box.right, box.high), "x", box.high + row(0, factor), "Ø<>"),
        Linear((box.left, 0.0), (-radius, 0.0), "x", box.low - row(0, factor)),
        Linear((0.0, 0.0), (box.left, box.high), "y", box.left - row(0, factor)),
    ]
