"""Floor plans of the kinds of buildings: rooms that tile a rectangle."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from numpy.random import Generator

from chefbot.buildings.layout import Room, Use
from chefbot.buildings.rectangle import Rectangle, cuts, random_cuts

Numbers = Mapping[str, float]
FloorPlan = Callable[[Numbers, Generator], list[Room]]
"""Makes the rooms of a building from its numbers; its lower left corner is at (0, 0)."""


def office(n: Numbers, rng: Generator) -> list[Room]:
    """Rows of rooms on both sides of corridors, which a cross corridor joins if there are several."""
    width, depth, corridor = n["width"], n["depth"], n["corridor"]
    spines = max(1, round(depth / (2 * n["room_depth"] + corridor)))
    bands = cuts(0.0, depth, [n["room_depth"], corridor, n["room_depth"]] * spines)
    at = round(float(rng.uniform(0.3, 0.7)) * (width - corridor), 2)
    cross = (at, round(at + corridor, 2)) if spines > 1 else (width, width)
    wanted = (0.7 * n["room_width"], 1.3 * n["room_width"])
    rooms: list[Room] = []
    for i, (low, high) in enumerate(bands):
        for left, right in ((0.0, cross[0]), (cross[1], width)):
            if right > left and i % 3 == 1:
                rooms.append(Room(Use.CORRIDOR, Rectangle(left, low, right, high)))
            elif right > left:
                rooms += _row_of_offices(Rectangle(left, low, right, high), wanted, rng)
        if spines > 1:
            rooms.append(Room(Use.CORRIDOR, Rectangle(cross[0], low, cross[1], high)))
    return _with_one(rooms, Use.KITCHEN, Use.OFFICE)


def _row_of_offices(row: Rectangle, widths: tuple[float, float], rng: Generator) -> list[Room]:
    parts = random_cuts(row.x0, row.x1, widths, rng)
    return [Room(_office_use(rng), Rectangle(a, row.y0, b, row.y1)) for a, b in parts]


def _office_use(rng: Generator) -> Use:
    return (Use.OFFICE, Use.OFFICE, Use.OFFICE, Use.MEETING, Use.STORE)[int(rng.integers(5))]


def corridors(n: Numbers, _: Generator) -> list[Room]:
    """Corridors around solid blocks: one loop or a grid of loops, with few features; a kitchen lies in a corner."""
    corridor, columns, rows = n["corridor"], int(n["blocks_x"]), int(n["blocks_y"])
    width = n["loop"] / 2 / (1.0 + n["aspect"])
    depth = n["loop"] / 2 - width
    x = _block_cuts(width, corridor, columns)
    y = _block_cuts(depth, corridor, rows)
    rooms = [
        Room(Use.SOLID if i % 2 and j % 2 else Use.CORRIDOR, Rectangle(a, c, b, d))
        for j, (c, d) in enumerate(y)
        for i, (a, b) in enumerate(x)
    ]
    right, top = x[-1][1], y[-1][1]
    kitchen = Rectangle(right, round(top - 3.5, 2), round(right + 3.0, 2), top)
    dining = Rectangle(-5.0, 0.0, 0.0, 4.0)
    return [*rooms, Room(Use.KITCHEN, kitchen), Room(Use.DINING, dining)]


def _block_cuts(extent: float, corridor: float, blocks: int) -> list[tuple[float, float]]:
    """Divide an extent into corridor, block, corridor ... corridor; blocks are at least as wide as 1 m."""
    block = max(extent - (blocks + 1) * corridor, blocks * 1.0) / blocks
    parts = [corridor, *[block, corridor] * blocks]
    return cuts(0.0, round(sum(parts), 2), parts)


def hall(n: Numbers, rng: Generator) -> list[Room]:
    """One large hall with columns, and a row of rooms along its upper side."""
    width, depth, split = n["width"], n["depth"], round(n["depth"] - n["side_room"], 2)
    parts = random_cuts(0.0, width, (4.0, 10.0), rng)
    uses = [Use.KITCHEN, *(_side_use(rng) for _ in parts[1:])]
    side = [Room(use, Rectangle(a, split, b, depth)) for use, (a, b) in zip(uses, parts, strict=True)]
    return [Room(Use.HALL, Rectangle(0.0, 0.0, width, split)), *side]


def _side_use(rng: Generator) -> Use:
    return (Use.STORE, Use.OFFICE, Use.MEETING)[int(rng.integers(3))]


def hotel(n: Numbers, rng: Generator) -> list[Room]:
    """Lobby, restaurant and kitchen on the left, guest rooms on both sides of a corridor on the right."""
    width, depth, corridor = n["width"], n["depth"], n["corridor"]
    lobby = round(width * n["lobby"], 2)
    low, high = (round(depth / 2 + sign * corridor / 2, 2) for sign in (-1, 1))
    kitchen = round(0.45 * lobby, 2)
    left = [
        Room(Use.HALL, Rectangle(0.0, 0.0, lobby, low)),
        Room(Use.CORRIDOR, Rectangle(0.0, low, lobby, high)),
        Room(Use.KITCHEN, Rectangle(0.0, high, kitchen, depth)),
        Room(Use.DINING, Rectangle(kitchen, high, lobby, depth)),
    ]
    wanted = (0.85 * n["room_width"], 1.15 * n["room_width"])
    guests = [
        Room(Use.BEDROOM, Rectangle(a, y0, b, y1))
        for y0, y1 in ((0.0, low), (high, depth))
        for a, b in random_cuts(lobby, width, wanted, rng)
    ]
    return [*left, Room(Use.CORRIDOR, Rectangle(lobby, low, width, high)), *guests]


def warehouse(n: Numbers, rng: Generator) -> list[Room]:
    """A hall of racks with a staging area and offices along its left side."""
    width, depth = n["width"], n["depth"]
    staging = round(float(rng.uniform(3.0, 5.0)), 2)
    office_depth = round(float(rng.uniform(3.5, 5.0)), 2)
    return [
        Room(Use.RACKS, Rectangle(staging, 0.0, width, depth)),
        Room(Use.OFFICE, Rectangle(0.0, 0.0, staging, office_depth)),
        Room(Use.DINING, Rectangle(0.0, office_depth, staging, round(2 * office_depth, 2))),
        Room(Use.KITCHEN, Rectangle(0.0, round(2 * office_depth, 2), staging, depth)),
    ]


def home(n: Numbers, rng: Generator) -> list[Room]:
    """A rectangle that is repeatedly cut in two, until the rooms are small."""
    whole = Rectangle(0.0, 0.0, n["width"], n["depth"])
    parts = sorted(_halved(whole, n["smallest_room"], rng), key=lambda part: -part.area)
    uses = [Use.LIVING, Use.DINING, Use.KITCHEN, *[Use.BEDROOM, Use.STORE, Use.OFFICE] * len(parts)]
    return [Room(use, part) for use, part in zip(uses, parts, strict=False)]


def _halved(part: Rectangle, smallest: float, rng: Generator) -> list[Rectangle]:
    along_x = part.width >= part.depth
    low, high = (part.x0, part.x1) if along_x else (part.y0, part.y1)
    cut = round(low + (high - low) * float(rng.uniform(0.35, 0.65)), 2)
    shorter = min(cut - low, high - cut)
    if part.area < 2.5 * smallest or shorter < 2.2:
        return [part]
    first = part._replace(x1=cut) if along_x else part._replace(y1=cut)
    second = part._replace(x0=cut) if along_x else part._replace(y0=cut)
    return [*_halved(first, smallest, rng), *_halved(second, smallest, rng)]


def twins(n: Numbers, _: Generator) -> list[Room]:
    """Wings of rooms that are all built alike and furnished alike; a corridor on the left joins the wings."""
    count, corridor = int(n["rooms"]), round(n["corridor"], 2)
    room_width, room_depth = round(n["room_width"], 2), round(n["room_depth"], 2)
    rooms: list[Room] = []
    pitch = round(room_depth + corridor, 2)
    right = round(corridor + count * room_width, 2)
    first = -1
    for wing in range(int(n["wings"])):
        y0 = round(wing * pitch, 2)
        y1, y2 = round(y0 + corridor, 2), round(y0 + pitch, 2)
        passages = ((0.0, y0, corridor, y1), (0.0, y1, corridor, y2), (corridor, y0, right, y1))
        rooms += [Room(Use.CORRIDOR, Rectangle(*corners)) for corners in passages]
        for i in range(count):
            x0, x1 = round(corridor + i * room_width, 2), round(corridor + (i + 1) * room_width, 2)
            first = len(rooms) if first < 0 else first
            rooms.append(Room(Use.OFFICE, Rectangle(x0, y1, x1, y2), first))
    kitchen = Room(Use.KITCHEN, Rectangle(-3.5, 0.0, 0.0, pitch))
    return [*rooms, kitchen]


def narrow(n: Numbers, rng: Generator) -> list[Room]:
    """Rooms on a grid whose doorways, and gates within, are little wider than the robot."""
    wanted = (0.8 * n["room_width"], 1.2 * n["room_width"])
    columns = random_cuts(0.0, n["width"], wanted, rng)
    rows = random_cuts(0.0, n["depth"], wanted, rng)
    uses = [Use.KITCHEN, Use.DINING, *[Use.GATES, Use.OFFICE, Use.STORE] * len(columns) * len(rows)]
    cells = [Rectangle(a, c, b, d) for c, d in rows for a, b in columns]
    return [Room(use, cell) for use, cell in zip(uses, cells, strict=False)]


def _with_one(rooms: list[Room], wanted: Use, instead: Use) -> list[Room]:
    """Return the rooms with the first one of use `instead` as the one of use `wanted`."""
    index = next((i for i, room in enumerate(rooms) if room.use is instead), 0)
    return [room._replace(use=wanted) if i == index else room for i, room in enumerate(rooms)]


FLOOR_PLANS: Mapping[str, FloorPlan] = {
    "office": office,
    "corridors": corridors,
    "hall": hall,
    "hotel": hotel,
    "warehouse": warehouse,
    "home": home,
    "twins": twins,
    "narrow": narrow,
}
"""Floor plan of each kind."""
