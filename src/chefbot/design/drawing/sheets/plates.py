"""Plates seen from above, forward up, with mounted parts for reference, and seen from the side."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from chefbot.design.drawing.drawing import (
    MM,
    TEXT,
    Item,
    Linear,
    Plan,
    Radial,
    Text,
    Title,
    loop_box,
    loop_item,
    number,
    segment,
)
from chefbot.design.drawing.sheets.common import cross, pieces, row, shape_items, title
from chefbot.design.drawing.views import PLAN, View, ViewShape, part_seen, seen
from chefbot.maths.outline import Loop
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.solids import link_origin, solids
from chefbot.robot.plate_shape import RectangularPlate, RoundPlate

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

MOUNTED = ("motor_clamp", "motor", "wheel", "caster")
FROM_LEFT = View((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
"""A plate on its edge, beside the view from above: right of it in first-angle projection."""
LETTERS_IN_HOLE = 14.0
"""Radius of a hole, mm on paper, that has room for its size."""
EDGE_VIEW = 24.0
"""From the plate to the view of its edge, mm on paper; a row of dimensions stands between."""


def base_plate(robot: Robot, factor: float) -> Plan:
    """Return the sheet of the base plate with wheels, motors, casters and poles as neighbours."""
    items = [*_neighbours(robot), *_plate(robot, "base_plate", factor), *_pole_radius(robot)]
    items += _clamp_sizes(robot, factor) + _caster_sizes(robot, factor) + _labels(robot, factor)
    return Plan(_title(robot, "base_plate"), tuple(items + _notch_sizes(robot, factor)))


def upper_plate(robot: Robot, kind: str, factor: float) -> Plan:
    """Return the sheet of the middle or top plate: a plate with holes."""
    return Plan(_title(robot, kind), tuple(_plate(robot, kind, factor)))


def _title(robot: Robot, kind: str) -> Title:
    return title(robot, kind, f"{number(robot.plates.thickness * MM)} thick")


def _plate(robot: Robot, kind: str, factor: float) -> list[Item]:
    """Outline, holes, edge, and the dimensions that all plates have."""
    solid = pieces(robot, kind)[0].solids[0]
    shape, plate = seen(solid, PLAN), robot.body.plate
    items = shape_items(shape) + cross(0.0, 0.0, max(plate.front, plate.back) * MM, factor)
    items += _plate_size(plate, factor)
    for screw in _screws(shape):
        box = loop_box(screw)
        items += cross(*box.middle, box.width / 2, factor)
    if kind != "top_plate":
        hole_radius = robot.plates.centre_hole * MM / 2
        roomy = hole_radius > LETTERS_IN_HOLE * factor
        angle, reach = (60.0, -hole_radius / factor / 2) if roomy else (300.0, 8.0)
        items.append(Radial("diameter", 0.0, 0.0, hole_radius, angle, reach))
    return items + _edge(robot, shape, seen(solid, FROM_LEFT), factor) + _holes(robot, shape, factor)


def _plate_size(plate: RoundPlate | RectangularPlate, factor: float) -> list[Item]:
    """Radius of a round plate; length and width of a rectangular one."""
    if isinstance(plate, RoundPlate):
        return [Radial("radius", 0.0, 0.0, plate.radius * MM, 105.0, 4.0)]
    front, back, side = plate.front * MM, plate.back * MM, plate.half_width * MM
    return [
        Linear((-side, front), (side, front), "x", front + row(3, factor)),
        Linear((-side, -back), (-side, front), "y", -side - row(3, factor)),
    ]


def _edge(robot: Robot, plate: ViewShape, edge: ViewShape, factor: float) -> list[Item]:
    """The plate on its edge, with its thickness."""
    box = loop_box(edge.edge)
    x = loop_box(plate.edge).right + EDGE_VIEW * factor - box.left
    moved = edge._replace(edge=tuple(c._replace(x=c.x + x) for c in edge.edge), hidden=())
    left, low, right, _ = loop_box(moved.edge)
    notch = robot.plates.notch if len(plate.edge) > 2 else None
    ends = (-notch.length * MM / 2, notch.length * MM / 2) if notch else ()
    return [
        *shape_items(moved),
        *(segment("OUTLINE", (left, y), (right, y)) for y in ends),
        Linear((left, low), (right, low), "x", low - row(0, factor)),
    ]


def _screws(shape: ViewShape) -> list[Loop]:
    """The holes beside the middle."""
    return [hole for hole in shape.holes if math.hypot(*loop_box(hole).middle) > 0.0]


def _holes(robot: Robot, shape: ViewShape, factor: float) -> list[Item]:
    """Size and number of the screw holes, and where those of the poles are."""
    screws = _screws(shape)
    if not screws:
        return []
    x, y = max((loop_box(screw).middle for screw in screws), key=lambda at: (round(at[0] + at[1], 6), at[0]))
    items: list[Item] = [
        Radial("diameter", x, y, robot.plates.screw_hole * MM / 2, 60.0, 24.0, f"{len(screws)}× <>")
    ]
    if robot.plates.count > 1:
        reach, plate = robot.poles.reach * MM, robot.body.plate
        items.append(Linear((-reach, reach), (reach, reach), "x", plate.front * MM + row(1, factor)))
        items.append(Linear((-reach, -reach), (-reach, reach), "y", -plate.half_width * MM - row(0, factor)))
    return items


def _neighbours(robot: Robot) -> list[Item]:
    parts = [
        p for p in solids(robot) if p.kind in MOUNTED or (p.name.startswith("pole_1") and "foot" in p.name)
    ]
    shapes = [shape for part in parts for shape in part_seen(part, link_origin(robot, part.link), PLAN)]
    return [loop_item("REFERENCE", edge) for edge in dict.fromkeys(shape.edge for shape in shapes)]


def _pole_radius(robot: Robot) -> list[Item]:
    if robot.plates.count < 2:
        return []
    reach = robot.poles.reach * MM
    return [Radial("radius", reach, -reach, robot.poles.radius * MM, 200.0, 5.0)]


def _notch_sizes(robot: Robot, factor: float) -> list[Item]:
    """Length, depth, and the distance of both floors."""
    notch, edge = robot.plates.notch, robot.body.plate.half_width * MM
    if notch is None:
        return []
    floor, corner = layout.notch_floor(robot) * MM, layout.notch_corner(robot) * MM
    half, low = notch.length * MM / 2, -robot.body.plate.back * MM - row(0, factor)
    return [
        Linear((corner, -half), (corner, half), "y", edge + row(0, factor)),
        Linear((floor, -half), (edge, 0.0), "x", low),
        Linear((-floor, -half), (floor, -half), "x", low),
    ]


def _clamp_sizes(robot: Robot, factor: float) -> list[Item]:
    """The flange on the right; its screws on the left; the distance of both below the plate."""
    clamp, back = robot.motor_clamp, robot.body.plate.back * MM
    middle, half, width = layout.clamp_middle(robot) * MM, clamp.length * MM / 2, clamp.width * MM / 2
    sx, sy = (MM * value for value in layout.clamp_screws(robot)[0])
    return [
        Linear((middle - half, width), (middle + half, width), "x", width + 6.0 * factor),
        Linear((middle - half, -width), (middle - half, width), "y", middle - half - 4.0 * factor, shift=5.0),
        Linear((-middle - sy, sx), (-middle + sy, sx), "x", width + 6.0 * factor),
        Linear((-middle + sy, -sx), (-middle + sy, sx), "y", -middle + half + 6.0 * factor, shift=4.0),
        Linear((-middle, 0.0), (middle, 0.0), "x", -back - row(1, factor)),
    ]


def _caster_sizes(robot: Robot, factor: float) -> list[Item]:
    """Radius, distance of both, and of their screws."""
    offset, radius, plate = robot.casters.offset * MM, robot.casters.radius * MM, robot.body.plate
    _, screw = layout.caster_screws(robot)[0]
    return [
        Radial("radius", 0.0, -offset, radius, -35.0, 6.0),
        Linear((-screw * MM, -offset), (-screw * MM, offset), "y", -plate.half_width * MM - row(1, factor)),
        Linear((-screw * MM, offset), (screw * MM, offset), "x", plate.front * MM + row(0, factor)),
    ]


def _labels(robot: Robot, factor: float) -> list[Item]:
    """Labels as in the chapter's figure, away from dimensions."""
    middle, width = layout.clamp_middle(robot) * MM, robot.motor_clamp.width * MM / 2
    offset, front = robot.casters.offset * MM, robot.body.plate.front * MM
    beside = (robot.casters.radius + robot.casters.wall) * MM + 2.0 * factor
    below = -width - 4.0 * factor
    items: list[Item] = [
        Text("TITLE", -middle + 2.0 * factor, below, "M1", 3.5),
        Text("TITLE", middle - 2.0 * factor, below, "M2", 3.5, "right"),
        Text("TITLE", beside, offset + 3.0 * factor, "C1", 3.5),
        Text("TITLE", beside, 3.0 * factor - offset, "C2", 3.5),
        Text("TITLE", 0.0, front + row(2, factor) + TEXT * factor, "FRONT", 3.5, "middle"),
    ]
    return items + _pole_labels(robot, factor)


def _pole_labels(robot: Robot, factor: float) -> list[Item]:
    poles = layout.pole_positions(robot) if robot.plates.count > 1 else []
    under = robot.poles.radius * MM + 3.5 * factor
    if isinstance(robot.body.plate, RectangularPlate):
        under = -under  # beyond the poles: between them are the sizes of the clamps
    return [
        Text("TITLE", -y * MM, x * MM - math.copysign(1.0, x) * under, f"P1-{i}", 3.5, "middle")
        for i, (x, y) in enumerate(poles, start=1)
    ]
