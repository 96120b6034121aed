"""Solids of the objects in a world file: walls, tables, chairs, doors and people."""

from __future__ import annotations

import math

from chefbot.buildings.world_file import BoxSpec, Chair, Cylinder, Door, Opening, Table, Wall, WallTag
from chefbot.maths.se2 import SE2
from chefbot.sim.world.shapes import MATERIALS, RgbColour, SimulatedShape, box, capsule, cylinder

TABLE_TOP, TABLE_LEG = 0.03, 0.05  # m: thickness of the top, side of a leg
SEAT, SEAT_HEIGHT, SEAT_THICKNESS, CHAIR_LEG, BACK_HEIGHT = 0.40, 0.45, 0.03, 0.035, 0.88  # m
CHAIR_GAP = 0.12
"""Metres from the table's edge to the centre of a chair's seat, which stands partly under the table."""
PERSON_RADIUS, LEG_RADIUS, HIP_HEIGHT, SHOULDER_HEIGHT, PERSON_HEIGHT = 0.22, 0.075, 0.8, 1.45, 1.75  # m
TAG_BOARD = 0.003
"""Thickness of the board of a tag, m."""
WHITE: RgbColour = (230, 230, 230)
TROUSERS: RgbColour = (58, 66, 88)
SKIN: RgbColour = (214, 168, 140)
SHIRTS: tuple[RgbColour, ...] = ((180, 60, 60), (60, 120, 170), (80, 150, 90), (190, 150, 60))


def rgb(colour: str) -> RgbColour:
    """Convert '#ff8000' to (255, 128, 0)."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def wall_shapes(wall: Wall, name: str) -> list[SimulatedShape]:
    """Return the boxes of a wall between, above and below its openings."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    length, yaw = math.hypot(x1 - x0, y1 - y0), math.atan2(y1 - y0, x1 - x0)
    frame, colour = SE2(x0, y0, yaw), rgb(wall.colour)
    pieces = _wall_pieces(length, wall)
    shapes = []
    for i, (a, b, low, high) in enumerate(pieces):
        at = frame @ SE2((a + b) / 2, 0.0, 0.0)
        shapes.append(box(f"{name}/{i}", at, low, (b - a, wall.thickness, high - low), colour))
    return [shape._replace(material=MATERIALS[wall.material]) for shape in shapes]


def _wall_pieces(length: float, wall: Wall) -> list[tuple[float, float, float, float]]:
    """Return (from, to, bottom, top) of every solid rectangle of a wall.

    The ends extend by half the thickness, to close corners.
    """
    pieces, position = [], -wall.thickness / 2
    for opening in sorted(wall.openings, key=lambda o: o.at):
        a, b = opening.at - opening.width / 2, opening.at + opening.width / 2
        if a > position:
            pieces.append((position, a, 0.0, wall.height))
        pieces += [(a, b, low, high) for low, high in _lintel_and_sill(opening, wall.height)]
        position = b
    end = length + wall.thickness / 2
    if end > position:
        pieces.append((position, end, 0.0, wall.height))
    return pieces


def _lintel_and_sill(opening: Opening, height: float) -> list[tuple[float, float]]:
    spans = [(0.0, opening.sill), (opening.height, height)]
    return [(low, high) for low, high in spans if high > low]


def tag_shape(tag: WallTag, name: str) -> SimulatedShape:
    """Return the white board of a tag, behind the frame of its front."""
    side = tag.board_size
    centre = tag.pose @ SE2(-TAG_BOARD / 2.0, 0.0, 0.0)
    return box(name, centre, tag.z - side / 2.0, (TAG_BOARD, side, side), WHITE)


def table_shapes(table: Table) -> list[SimulatedShape]:
    """Return the solids of a table: top, four legs, and the chairs around it."""
    colour, underside = rgb(table.colour), table.height - TABLE_TOP
    shapes = [_table_top(table, underside, colour)]
    inset = TABLE_LEG if table.shape == "square" else 0.2 * table.size
    across = _table_sides(table)
    offsets = across[0] / 2 - inset, across[1] / 2 - inset
    shapes += _legs(table.name, table.pose, offsets, (TABLE_LEG, TABLE_LEG, underside), colour)
    for i, bearing in enumerate(table.chairs):
        side = across[0] if abs(math.cos(bearing)) >= abs(math.sin(bearing)) else across[1]
        chair_pose = SE2(0.0, 0.0, bearing) @ SE2(side / 2 + CHAIR_GAP, 0.0, math.pi)
        shapes += _chair(f"{table.name}_chair_{i}", table.pose @ chair_pose, rgb("#6e4a2a"))
    return shapes


def _table_top(table: Table, underside: float, colour: RgbColour) -> SimulatedShape:
    name = f"{table.name}/top"
    if table.shape == "round":
        return cylinder(name, (table.x, table.y), underside, table.size / 2, TABLE_TOP, colour)
    return box(name, table.pose, underside, (*_table_sides(table), TABLE_TOP), colour)


def _table_sides(table: Table) -> tuple[float, float]:
    return table.size, table.size if table.depth is None else table.depth


def chair_shapes(chair: Chair, name: str) -> list[SimulatedShape]:
    """Return the solids of a chair: seat, back and four legs."""
    return _chair(name, chair.pose, rgb(chair.colour))


_CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))


def _chair(name: str, pose: SE2, colour: RgbColour) -> list[SimulatedShape]:
    seat_bottom, leg_offset = SEAT_HEIGHT - SEAT_THICKNESS, (SEAT - CHAIR_LEG) / 2
    seat = box(f"{name}/seat", pose, seat_bottom, (SEAT, SEAT, SEAT_THICKNESS), colour)
    back_pose = pose @ SE2(-leg_offset, 0.0, 0.0)
    back = box(f"{name}/back", back_pose, SEAT_HEIGHT, (CHAIR_LEG, SEAT, BACK_HEIGHT - SEAT_HEIGHT), colour)
    return [
        seat,
        back,
        *_legs(name, pose, (leg_offset, leg_offset), (CHAIR_LEG, CHAIR_LEG, seat_bottom), colour),
    ]


def _legs(
    name: str, pose: SE2, offset: tuple[float, float], size: tuple[float, float, float], colour: RgbColour
) -> list[SimulatedShape]:
    """Return four legs, each `offset` metres from the middle along x and y."""
    places = [pose @ SE2(sx * offset[0], sy * offset[1], 0.0) for sx, sy in _CORNERS]
    return [box(f"{name}/leg_{i}", at, 0.0, size, colour) for i, at in enumerate(places)]


def box_shape(item: BoxSpec) -> SimulatedShape:
    """Return the solid of a box."""
    x, y, z = item.size
    shape = box(item.name, item.pose, item.bottom, (x, y, z), rgb(item.colour))
    return shape._replace(material=MATERIALS[item.material])


def cylinder_shape(item: Cylinder) -> SimulatedShape:
    """Return the solid of a cylinder."""
    return cylinder(item.name, (item.x, item.y), item.bottom, item.radius, item.height, rgb(item.colour))


def door_leaf(door: Door) -> SimulatedShape:
    """Return the leaf of a door in the frame of its hinge; yaw 0 is closed."""
    size = (door.width, door.thickness, door.height)
    return box(door.name, SE2(door.width / 2, 0.0, 0.0), 0.0, size, rgb(door.colour))


def door_pose(door: Door, fraction: float) -> SE2:
    """Return the pose of the leaf's frame in the world when the door is open by `fraction` (0..1)."""
    if door.kind == "slide":
        return door.pose @ SE2(-fraction * door.width, 0.0, 0.0)
    return door.pose @ SE2(0.0, 0.0, fraction * door.swing)


def person_shapes(number: int) -> tuple[SimulatedShape, ...]:
    """Return legs, trunk and head of person `number` in their own frame, x forward."""
    name, shirt = f"person_{number}", SHIRTS[number % len(SHIRTS)]
    legs = [
        cylinder(f"{name}/leg_{i}", (0.0, side * 0.11), 0.0, LEG_RADIUS, HIP_HEIGHT, TROUSERS)
        for i, side in enumerate((1, -1))
    ]
    trunk = cylinder(
        f"{name}/trunk", (0.0, 0.0), HIP_HEIGHT, PERSON_RADIUS, SHOULDER_HEIGHT - HIP_HEIGHT, shirt
    )
    head = capsule(f"{name}/head", (0.0, 0.0), SHOULDER_HEIGHT, 0.1, PERSON_HEIGHT - SHOULDER_HEIGHT, SKIN)
    return (*legs, trunk, head)


def ceiling_shape(bounds: tuple[float, float, float, float], height: float) -> SimulatedShape:
    """Return a slab at `height` metres over the bounds of the world."""
    x0, y0, x1, y1 = bounds
    centre = SE2((x0 + x1) / 2, (y0 + y1) / 2, 0.0)
    return box("ceiling", centre, height, (x1 - x0, y1 - y0, 0.1), (235, 235, 230))
