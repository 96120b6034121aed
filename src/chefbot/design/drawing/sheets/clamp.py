"""The motor clamp of the left side: its face, from the side, and from above."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from chefbot.design.drawing.drawing import (
    BoundingBox,
    Item,
    Linear,
    Plan,
    Radial,
    around,
    loop_box,
    moved,
    number,
)
from chefbot.design.drawing.sheets.common import cross, pieces, row, shape_items, title
from chefbot.design.drawing.views import View, ViewShape, seen

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

FACE = View((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""Onto the face, from the wheel."""
FROM_LEFT = View((0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
"""Right of FACE in first-angle projection."""
FROM_ABOVE = View((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
"""Below FACE in first-angle projection."""
VIEW_SPACING = 28.0
"""Of two views, mm on paper."""
LEADER_ANGLE, LEADER_CLEARANCE = 35.0, 2.0
"""Degrees; mm on paper."""


def motor_clamp(robot: Robot, factor: float) -> Plan:
    """Return three views of the left motor clamp; the right one is its mirror image."""
    part = pieces(robot, "motor_clamp")[0]
    face, side, above = (
        [seen(solid, view) for solid in part.solids] for view in (FACE, FROM_LEFT, FROM_ABOVE)
    )
    box, side_box, above_box = (_box(view) for view in (face, side, above))
    gap = VIEW_SPACING * factor
    items = _face(face, box, factor)
    items += _at(_side(side, side_box, factor), box.right + gap - side_box.left, 0.0)
    items += _at(_above(above, above_box, factor), 0.0, box.low - gap - above_box.high)
    size = f"{number(box.width)} x {number(side_box.width)} x {number(box.height)}"
    return Plan(title(robot, "motor_clamp", size), tuple(items))


def _box(shapes: list[ViewShape]) -> BoundingBox:
    return around(loop_box(shape.edge) for shape in shapes)


def _at(items: list[Item], x: float, y: float) -> list[Item]:
    return [moved(item, x, y) for item in items]


def _face(shapes: list[ViewShape], box: BoundingBox, factor: float) -> list[Item]:
    """Flange on its edge, the face with the hole for the shaft."""
    flange, face = shapes
    hole = loop_box(face.holes[0])
    x, y = hole.middle
    items = shape_items(flange) + shape_items(face) + cross(x, y, hole.width / 2, factor)
    return [
        *items,
        Radial("diameter", x, y, hole.width / 2, LEADER_ANGLE, _beyond(box, hole, factor)),
        Linear((box.left, box.low), (box.left, box.high), "y", box.left - row(1, factor)),
        Linear((x, y), (box.left, box.high), "y", box.left - row(0, factor)),
    ]


def _beyond(box: BoundingBox, hole: BoundingBox, factor: float) -> float:
    """Length of the leader from the hole to the text outside the face, mm on paper."""
    across = box.right - hole.middle[0] + LEADER_CLEARANCE * factor
    return (across / math.cos(math.radians(LEADER_ANGLE)) - hole.width / 2) / factor


def _side(shapes: list[ViewShape], box: BoundingBox, factor: float) -> list[Item]:
    """The angle, with the thickness of flange and face."""
    flange, face = (loop_box(shape.edge) for shape in shapes)
    return [
        *(item for shape in shapes for item in shape_items(shape)),
        Linear((box.right, flange.low), (box.right, flange.high), "y", box.right + row(0, factor)),
        Linear((face.left, box.low), (face.right, box.low), "x", box.low - row(0, factor)),
    ]


def _above(shapes: list[ViewShape], box: BoundingBox, factor: float) -> list[Item]:
    """The flange with its screw holes."""
    holes = [loop_box(hole) for hole in shapes[0].holes]
    xs, ys = zip(*(hole.middle for hole in holes), strict=True)
    x, y = max(xs), max(ys)
    items = shape_items(shapes[0])
    for hole in holes:
        items += cross(*hole.middle, hole.width / 2, factor)
    return [
        *items,
        Linear((box.left, box.low), (box.right, box.low), "x", box.low - row(1, factor)),
        Linear((min(xs), min(ys)), (x, min(ys)), "x", box.low - row(0, factor)),
        Linear((box.left, box.low), (box.left, box.high), "y", box.left - row(1, factor)),
        Linear((min(xs), min(ys)), (min(xs), y), "y", box.left - row(0, factor)),
        Radial("diameter", x, y, holes[0].width / 2, 30.0, 12.0, f"{len(holes)}× <>"),
    ]
