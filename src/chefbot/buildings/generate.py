"""Generation of a building: rooms, doorways, furniture, and the places that a robot reaches."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple
from zlib import crc32

import msgspec
import numpy as np
from numpy.random import Generator

from chefbot.buildings import furniture
from chefbot.buildings.floor_plans import FLOOR_PLANS
from chefbot.buildings.furnishing import Furnishing, before_doorway
from chefbot.buildings.furniture import PlacedPiece
from chefbot.buildings.interiors import INTERIORS, Interior, add_clutter
from chefbot.buildings.layout import Doorway, Room, Use, connecting_sides, doorway, shared_sides
from chefbot.buildings.parameters import BuildingError, draw_numbers
from chefbot.buildings.places import choose_places
from chefbot.buildings.reachable_floor import (
    NARROW_MARGIN,
    PASSAGE_MARGIN,
    ReachableFloor,
    floor_of_door,
    floor_of_piece,
    floor_of_wall,
)
from chefbot.buildings.rectangle import Rectangle
from chefbot.buildings.walls import THICKNESS, doors_of, walls_of
from chefbot.buildings.world_file import (
    BoxSpec,
    Carpet,
    Chair,
    Cylinder,
    Door,
    FloorHole,
    NamedPose,
    Table,
    Wall,
    WorldSpec,
)
from chefbot.maths.se2 import SE2

AISLE_MARGIN = 0.4
"""Width of the aisles between furniture beyond that of the robot, m."""
CARPET_FRICTION = (0.3, 1.2)
"""Range of the friction of a carpet."""
DOOR_MARGIN = 0.05
"""Width of a doorway beyond the narrowest that the robot passes, m, if the drawn one is narrower."""
ATTEMPTS = 8
"""Times that a building is drawn again, with less in it each time, until its places can be reached."""
FEWEST_TABLES = 1
ELEMENTS = ("walls", "doors", "tables", "chairs", "boxes", "cylinders", "holes", "carpets")
"""Sections of a world file that have a position."""


class Shell(NamedTuple):
    """A building without its furniture and places."""

    rooms: list[Room]
    doorways: list[Doorway]
    walls: list[Wall]
    doors: list[Door]


def generate(kind: str, seed: int, given: Mapping[str, float], radius: float) -> WorldSpec:
    """Return the building of a kind that a robot of `radius` metres gets about in.

    given: numbers that are not drawn; see `parameters.ranges_of`. The same arguments give the same building. Every
    place can be reached; `home` is (0, 0, 0), so that the robot's maps have the frame of the world. Raises
    BuildingError for an unknown kind or number, one outside its range, and if the robot does not fit.
    """
    stream = crc32(kind.encode())  # kinds of the same seed have nothing in common
    numbers = draw_numbers(kind, given, np.random.default_rng([seed, stream]))
    numbers["door_width"] = max(numbers["door_width"], 2 * (radius + PASSAGE_MARGIN) + DOOR_MARGIN)
    for attempt in range(ATTEMPTS):
        emptier = {**numbers, **_less(numbers, attempt), **given}
        rng = np.random.default_rng([seed, stream, 1 + attempt])
        spec = _build(kind, f"{kind}_{seed}", emptier, radius, rng)
        if {"home", "kitchen"} <= spec.places.keys() and len(spec.places) >= 2 + FEWEST_TABLES:
            return _from_home(spec)
    raise BuildingError(
        f"no building of kind {kind} with seed {seed} leaves a robot of {radius:.2f} m radius a path from home to the"
        " kitchen and a table; give it more room"
    )


def _from_home(spec: WorldSpec) -> WorldSpec:
    """Return the building shifted so that the robot starts at (0, 0) and looks along x."""
    home = spec.places["home"]
    shifted = {key: [_shifted(one, home) for one in getattr(spec, key)] for key in ELEMENTS}
    places = {name: _shifted(place, home) for name, place in spec.places.items()}
    return msgspec.structs.replace(spec, **shifted, places={**places, "home": NamedPose(x=0.0, y=0.0)})


def _shifted(one: Any, home: NamedPose) -> Any:
    if isinstance(one, Wall):
        ends = {key: _minus(getattr(one, key), home) for key in ("start", "end")}
        return msgspec.structs.replace(one, **ends)
    x, y = _minus([one.x, one.y], home)
    return msgspec.structs.replace(one, x=x, y=y)


def _minus(point: list[float], home: NamedPose) -> list[float]:
    return [round(point[0] - home.x, 3), round(point[1] - home.y, 3)]


def _less(numbers: Mapping[str, float], attempt: int) -> dict[str, float]:
    """Return the numbers of what is in the way, less with every attempt after the first."""
    share = 1.0 - attempt / (ATTEMPTS - 1)
    less = {name: numbers[name] * share for name in ("clutter", "moved_chairs", "furniture", "door_leaves")}
    return {**less, "closed_doors": 0.0} if attempt else {}


def _build(kind: str, name: str, n: Mapping[str, float], radius: float, rng: Generator) -> WorldSpec:
    """Return a building whose places may lack what the robot does not reach."""
    shell = _shell(kind, n, radius, rng)
    pieces = _furnish(shell, n, radius, rng)
    places = _places(shell, pieces, n, radius, rng)
    elements = _elements(pieces)
    return WorldSpec(
        name=name,
        ceiling=round(n["wall_height"], 2),
        walls=shell.walls,
        doors=shell.doors,
        tables=[one for one in elements if isinstance(one, Table)],
        chairs=[one for one in elements if isinstance(one, Chair)],
        boxes=[one for one in elements if isinstance(one, BoxSpec)],
        cylinders=[one for one in elements if isinstance(one, Cylinder)],
        holes=[one for one in elements if isinstance(one, FloorHole)],
        carpets=_carpets(shell.rooms, n, rng),
        places=places,
    )


def _places(
    shell: Shell, pieces: list[PlacedPiece], n: Mapping[str, float], radius: float, rng: Generator
) -> dict[str, NamedPose]:
    """Return the places that the robot reaches past walls, doors and furniture."""
    obstacles = [floor for wall in shell.walls for floor in floor_of_wall(wall)]
    obstacles += [floor_of_door(door) for door in shell.doors]
    obstacles += [floor_of_piece(placed.rect) for placed in pieces]
    margin = NARROW_MARGIN if "gap" in n else PASSAGE_MARGIN
    floor = ReachableFloor([r.rect for r in shell.rooms if r.use is not Use.SOLID], obstacles, radius, margin)
    served = [placed for placed in pieces if placed.piece.served]
    return choose_places(shell.rooms, served, floor, radius, int(n["tables"]), rng)


def _shell(kind: str, n: Mapping[str, float], radius: float, rng: Generator) -> Shell:
    rooms = FLOOR_PLANS[kind](n, rng)
    sides = shared_sides(rooms)
    width = round(2 * radius + n["gap"], 3) if "gap" in n else round(n["door_width"], 2)
    doorways = [
        doorway(side, width, _leaf(n, rng), rng)
        for side in connecting_sides(rooms, sides, width, n["loops"], rng)
    ]
    doorways = _alike(doorways, rooms)
    walls = walls_of(rooms, sides, doorways, round(n["wall_height"], 2), n["glass"], rng)
    return Shell(rooms, doorways, walls, doors_of(doorways))


def _leaf(n: Mapping[str, float], rng: Generator) -> float:
    """Return the open fraction of a doorway's leaf, -1 for a doorway without one."""
    draw, fraction = float(rng.random()), float(rng.uniform(0.6, 1.0))
    if draw < n["closed_doors"]:
        return 0.0
    return round(fraction, 2) if draw < n["closed_doors"] + n["door_leaves"] else -1.0


def _alike(doorways: list[Doorway], rooms: list[Room]) -> list[Doorway]:
    """Return the doorways with those of rooms that are built alike at the same place of the room."""
    of_room = {d.side.b: d for d in doorways if rooms[d.side.b].alike >= 0}
    return [_as_in_first(d, rooms, of_room) if d.side.b in of_room else d for d in doorways]


def _as_in_first(one: Doorway, rooms: list[Room], of_room: Mapping[int, Doorway]) -> Doorway:
    room = rooms[one.side.b]
    pattern = of_room[room.alike]
    offset = room.rect.x0 - rooms[room.alike].rect.x0
    return pattern._replace(side=one.side, centre=round(pattern.centre + offset, 2))


def _furnish(shell: Shell, n: Mapping[str, float], radius: float, rng: Generator) -> list[PlacedPiece]:
    furnished: list[Furnishing] = []
    aisle = 2 * radius + AISLE_MARGIN
    for number, room in enumerate(shell.rooms):
        zones = _zones_before_doorways(shell.doorways, number, aisle)
        one = Interior(Furnishing(room.rect.expanded(-THICKNESS / 2), zones, aisle), n, radius, rng)
        if 0 <= room.alike < number:
            _copy(furnished[room.alike], shell.rooms[room.alike], room, one.room)
        else:
            INTERIORS[room.use](one)
        furnished.append(one.room)
    inside = [one for one, room in zip(furnished, shell.rooms, strict=True) if room.use is not Use.SOLID]
    for furnishing in inside:
        add_clutter(Interior(furnishing, n, radius, rng))
    _add_hazards(inside, n, rng)
    return [placed for one in furnished for placed in one.pieces]


def _zones_before_doorways(doorways: list[Doorway], room: int, aisle: float) -> list[Rectangle]:
    return [
        before_doorway(*_centre(d), d.side.vertical, d.width, aisle)
        for d in doorways
        if room in (d.side.a, d.side.b)
    ]


def _copy(furnished: Furnishing, pattern: Room, room: Room, into: Furnishing) -> None:
    dx, dy = room.rect.x0 - pattern.rect.x0, room.rect.y0 - pattern.rect.y0
    for placed in furnished.pieces:
        x, y, yaw = placed.pose
        into.add(placed.piece, SE2(round(x + dx, 3), round(y + dy, 3), yaw), 0.0)


def _add_hazards(rooms: list[Furnishing], n: Mapping[str, float], rng: Generator) -> None:
    """Add what a laser does not see: boards above its plane, platforms below it, holes, and mirrors."""
    makers = {
        "boards": furniture.hanging_board,
        "steps": furniture.step,
        "holes": furniture.hole,
        "mirrors": furniture.mirror,
    }
    for name, make in makers.items():
        for _ in range(int(n[name])):
            room = rooms[int(rng.integers(len(rooms)))]
            piece = make(rng)
            _ = (name == "boards" and room.inside(piece, rng)) or room.at_wall(piece, rng)


def _centre(one: Doorway) -> tuple[float, float]:
    return (one.side.at, one.centre) if one.side.vertical else (one.centre, one.side.at)


def _elements(pieces: list[PlacedPiece]) -> list[furniture.Furniture]:
    counts: Counter[str] = Counter()

    def number(name: str) -> str:
        counts[name] += 1
        return f"{name}_{counts[name]}"

    return [element for placed in pieces for element in placed.elements(number)]


def _carpets(rooms: list[Room], n: Mapping[str, float], rng: Generator) -> list[Carpet]:
    carpets = []
    for room in rooms:
        if room.use is not Use.SOLID and float(rng.random()) < n["carpets"]:
            area = room.rect.expanded(-0.3)
            x, y = area.centre
            friction = round(float(rng.uniform(*CARPET_FRICTION)), 2)
            size = [round(area.width, 2), round(area.depth, 2)]
            carpets.append(Carpet(x=round(x, 3), y=round(y, 3), size=size, friction=friction))
    return carpets
