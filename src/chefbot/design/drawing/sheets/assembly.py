"""The assembly: front view, right side view and the lowest deck from above, with a parts list."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from chefbot.design.drawing.drawing import (
    MM,
    BoundingBox,
    Item,
    Linear,
    Plan,
    Radial,
    Text,
    Title,
    around,
    item_box,
    moved,
    number,
    segment,
)
from chefbot.design.drawing.hidden_lines import VisibleLines, visible
from chefbot.design.drawing.sheets.common import row
from chefbot.design.drawing.sheets.parts_list import Mark, balloons, entries, table
from chefbot.design.drawing.views import FRONT, SIDE, TOP, View, part_seen
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.layout import body_height, ground_clearance
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.geometry.solids import RobotPart, link_origin, solids

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

CAPTION = 3.5
"""Height of the captions of views, mm on paper."""
NUMBERS = 14.0
"""Distance from a view to its balloons, mm on paper."""


class Face(NamedTuple):
    """A view with the visible shapes of each kind of part."""

    items: list[Item]
    box: BoundingBox
    marks: dict[str, VisibleLines]


def assembly(robot: Robot, factor: float) -> Plan:
    """Return three views in first-angle projection with the parts list to their right."""
    front, side, top = _faces(robot)
    front_marks, side_marks, top_marks = _marks(robot, [front, side, top])
    views = (
        (front, front_marks, _front_sizes, "Front"),
        (side, side_marks, _side_sizes, "Right side"),
        (top, top_marks, _top_sizes, "Lowest deck from above"),
    )
    drawn = [
        _dressed(face, marks, sizes(robot, face.box, factor), name, factor, face is top)
        for face, marks, sizes, name in views
    ]
    boxes = [around(item_box(item, factor) for item in items) for items in drawn]
    beside = boxes[0].right - boxes[1].left + 4.0 * factor
    below = boxes[0].low - boxes[2].high - 3.0 * factor
    items = drawn[0] + [moved(item, beside, 0.0) for item in drawn[1]]
    items += [moved(item, 0.0, below) for item in drawn[2]]
    items += table(robot, boxes[1].right + beside + 8.0 * factor, boxes[0].high, factor)
    return Plan(_title(robot, front.box, side.box), tuple(items))


@lru_cache(maxsize=8)
def _faces(robot: Robot) -> tuple[Face, Face, Face]:
    """Front, side and lowest deck, independent of the scale."""
    parts = solids(robot)
    return _face(robot, parts, FRONT), _face(robot, parts, SIDE), _face(robot, _lowest_deck(robot), TOP)


def _title(robot: Robot, front: BoundingBox, side: BoundingBox) -> Title:
    size = f"{number(side.width)} x {number(front.width)} x {number(front.high)}"
    return Title(robot.name, "Assembly", "see parts list", size, 1, unloaded_mass(robot))


def _lowest_deck(robot: Robot) -> list[RobotPart]:
    """Parts visible from above without the second plate."""
    undersides = layout.plate_undersides(robot)
    ceiling = undersides[1] if len(undersides) > 1 else float("inf")
    return [part for part in solids(robot) if _top_of(robot, part) <= ceiling + 1e-9]


def _top_of(robot: Robot, part: RobotPart) -> float:
    shapes = part_seen(part, link_origin(robot, part.link), TOP)
    return max(shape.near for shape in shapes) / MM


def _face(robot: Robot, parts: Sequence[RobotPart], view: View) -> Face:
    """All visible lines, and for every kind the shape with the largest visible area."""
    shapes, kinds = [], []
    for part in parts:
        for shape in part_seen(part, link_origin(robot, part.link), view):
            shapes.append(shape)
            kinds.append(part.kind)
    seen = visible(shapes)
    items = [item for one in seen for item in one.items]
    marks: dict[str, VisibleLines] = {}
    for kind, one in zip(kinds, seen, strict=True):
        if one.area > 0.0 and (kind not in marks or one.area > marks[kind].area):
            marks[kind] = one
    return Face(items, around(item_box(item, 1.0) for item in items), marks)


def _marks(robot: Robot, faces: list[Face]) -> list[list[Mark]]:
    """For each view its balloons: a part is numbered where its visible area is largest."""
    chosen: list[list[Mark]] = [[] for _ in faces]
    for entry in entries(robot):
        areas = [face.marks[entry.kind].area if entry.kind in face.marks else 0.0 for face in faces]
        best = areas.index(max(areas))
        if areas[best] > 0.0:
            chosen[best].append(Mark(entry.number, faces[best].marks[entry.kind].anchor))
    return chosen


def _dressed(
    face: Face, marks: list[Mark], sizes: list[Item], name: str, factor: float, both: bool
) -> list[Item]:
    """A view with dimensions, balloons (on both sides if there is space) and caption."""
    x, y = face.box.middle
    box = around(item_box(item, factor) for item in [*sizes, *face.items])
    gap = NUMBERS * factor / 2
    left = [mark for mark in marks if both and mark.anchor[0] < x]
    numbers = balloons([mark for mark in marks if mark not in left], box.right + gap, y, factor)
    numbers += balloons(left, box.left - gap, y, factor)
    caption = Text("TITLE", x, face.box.high + 7.0 * factor, name, CAPTION, "middle")
    return [*face.items, *sizes, *numbers, caption]


def _floor(box: BoundingBox, factor: float) -> Item:
    return segment("REFERENCE", (box.left - 6.0 * factor, 0.0), (box.right + 6.0 * factor, 0.0))


def _front_sizes(robot: Robot, box: BoundingBox, factor: float) -> list[Item]:
    """Heights of the plates, of all, wheel separation and width."""
    undersides = [z * MM for z in layout.plate_undersides(robot)]
    thickness, edge = robot.plates.thickness * MM, robot.body.plate.half_width * MM
    half, left = robot.wheels.separation * MM / 2, -edge
    steps = [0.0, *(z for low in undersides for z in (low, low + thickness))]
    chain = [(a, b) for a, b in itertools.pairwise(steps) if b - a > thickness + 1e-6]
    items, lanes = _chain(left, box.left, chain, factor)
    items.append(Linear((left, 0.0), (left, body_height(robot) * MM), "y", box.left - row(lanes, factor)))
    if box.high > body_height(robot) * MM + 1e-6:
        items.append(Linear((left, 0.0), (left, box.high), "y", box.left - row(lanes + 1, factor)))
    return [
        *items,
        _floor(box, factor),
        Linear((-half, 0.0), (half, 0.0), "x", -row(0, factor)),
        Linear((box.left, undersides[0]), (box.right, undersides[0]), "x", -row(1, factor)),
    ]


def _chain(x: float, edge: float, steps: list[tuple[float, float]], factor: float) -> tuple[list[Item], int]:
    """Heights one above the other: in a row, or in two by turns where a text has no room between its ends."""
    line = [Linear((x, a), (x, b), "y", edge - row(0, factor)) for a, b in steps]
    if not any(step.text_shift(factor) for step in line):
        return list(line), 1
    return [step._replace(at=edge - row(i % 2, factor)) for i, step in enumerate(line)], 2


def _side_sizes(robot: Robot, box: BoundingBox, factor: float) -> list[Item]:
    """Wheel, casters, and clearance: actual and required."""
    wheel, offset = robot.wheel_radius * MM, robot.casters.offset * MM
    clear, wanted, front = (
        ground_clearance(robot) * MM,
        robot.body.clearance * MM,
        robot.body.plate.front * MM,
    )
    motor = robot.motor.diameter * MM / 2
    return [
        _floor(box, factor),
        segment("REFERENCE", (box.left, wanted), (box.right, wanted)),
        Linear((front, 0.0), (front, wanted), "y", box.right + row(1, factor), "min. <>"),
        Linear((front, 0.0), (motor, clear), "y", box.right + row(0, factor)),
        Radial("diameter", 0.0, wheel, wheel, 305.0, 8.0),
        Linear((-offset, 0.0), (offset, 0.0), "x", -row(0, factor)),
    ]


def _top_sizes(robot: Robot, box: BoundingBox, factor: float) -> list[Item]:
    """The plate's width with the notches."""
    floor, low = layout.notch_floor(robot) * MM, box.low - row(0, factor)
    return [Linear((-floor, 0.0), (floor, 0.0), "x", low)] if robot.plates.notch else []
