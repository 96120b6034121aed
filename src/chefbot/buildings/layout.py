"""Layouts: rooms that tile a floor, the sides that they share, and the doorways between them."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from typing import NamedTuple

from numpy.random import Generator

from chefbot.buildings.rectangle import Rectangle


class Use(StrEnum):
    """What a room is used for; decides its furniture and where its doors lead."""

    CORRIDOR = "corridor"
    OFFICE = "office"
    MEETING = "meeting"
    KITCHEN = "kitchen"
    DINING = "dining"
    BEDROOM = "bedroom"
    LIVING = "living"
    STORE = "store"
    HALL = "hall"
    RACKS = "racks"
    GATES = "gates"
    SOLID = "solid"


class Room(NamedTuple):
    """A rectangular room; corridors that touch each other have no wall between them, a solid one has no inside.

    alike: number of the first of the rooms that are built alike, each with one doorway, in its lower side; else -1.
    """

    use: Use
    rect: Rectangle
    alike: int = -1


class Side(NamedTuple):
    """A straight piece of boundary: along y at x = at if vertical, else along x at y = at, from low to high, m.

    a: number of the room on the lower side. b: number of the room on the other side, -1 for the outside. For an
    outer side, a is the only room.
    """

    a: int
    b: int
    vertical: bool
    at: float
    low: float
    high: float

    @property
    def length(self) -> float:
        """The length of the side, m."""
        return self.high - self.low


class Doorway(NamedTuple):
    """An opening in a side: its centre along the side and its width, m.

    leaf: open fraction of its door, -1 for none.
    """

    side: Side
    centre: float
    width: float
    leaf: float = -1.0


CORNER = 0.15
"""Distance of a doorway from the end of its side, m."""


def shared_sides(rooms: list[Room]) -> list[Side]:
    """Return the sides that two rooms share."""
    sides: list[Side] = []
    for a, first in enumerate(rooms):
        for b, second in enumerate(rooms):
            p, q = first.rect, second.rect
            if p.x1 == q.x0:
                sides += _side(a, b, True, p.x1, (p.y0, p.y1), (q.y0, q.y1))
            if p.y1 == q.y0:
                sides += _side(a, b, False, p.y1, (p.x0, p.x1), (q.x0, q.x1))
    return sides


def _side(
    a: int, b: int, vertical: bool, at: float, p: tuple[float, float], q: tuple[float, float]
) -> list[Side]:
    low, high = max(p[0], q[0]), min(p[1], q[1])
    return [Side(a, b, vertical, at, low, high)] if low < high else []


def outer_sides(rooms: list[Room], shared: list[Side]) -> Iterator[Side]:
    """Yield the parts of the rooms' boundaries that no other room shares."""
    for number, room in enumerate(rooms):
        for vertical, at, low, high in _edges(room.rect):
            taken = sorted(
                (s.low, s.high)
                for s in shared
                if number in (s.a, s.b) and s.vertical == vertical and s.at == at
            )
            for start, end in taken:
                if low < start:
                    yield Side(number, -1, vertical, at, low, start)
                low = max(low, end)
            if low < high:
                yield Side(number, -1, vertical, at, low, high)


def _edges(r: Rectangle) -> Iterator[tuple[bool, float, float, float]]:
    """Yield the four edges: whether it is vertical, where it is, and its ends."""
    yield True, r.x0, r.y0, r.y1
    yield True, r.x1, r.y0, r.y1
    yield False, r.y0, r.x0, r.x1
    yield False, r.y1, r.x0, r.x1


def is_open(side: Side, rooms: list[Room]) -> bool:
    """Return whether no wall stands on the side: between two corridors, and within a solid block."""
    uses = {rooms[side.a].use, rooms[side.b].use}
    return uses in ({Use.CORRIDOR}, {Use.SOLID})


def connecting_sides(
    rooms: list[Room], sides: list[Side], width: float, extra: float, rng: Generator
) -> list[Side]:
    """Choose the sides that get a doorway of `width` metres, so that every room is connected.

    A spanning tree (Kruskal 1956) in which doors to corridors come first; of the other sides a share `extra` gets a
    doorway, too, so that there are loops.
    """
    group = list(range(len(rooms)))

    def root(number: int) -> int:
        while group[number] != number:
            number = group[number]
        return number

    inside = [s for s in sides if Use.SOLID not in (rooms[s.a].use, rooms[s.b].use) and _may_open(s, rooms)]
    for side in (s for s in inside if is_open(s, rooms)):
        group[root(side.a)] = root(side.b)
    # corridors first, in random order otherwise
    candidates = [s for s in inside if not is_open(s, rooms) and s.length >= width + 2 * CORNER]
    order = rng.random(len(candidates))
    ranked = sorted(
        zip(candidates, order, strict=True),
        key=lambda pair: (Use.CORRIDOR not in (rooms[pair[0].a].use, rooms[pair[0].b].use), pair[1]),
    )
    chosen: list[Side] = []
    for side, _ in ranked:
        a, b = root(side.a), root(side.b)
        if a != b or rng.random() < extra:
            chosen.append(side)
            group[a] = b
    return chosen


def _may_open(side: Side, rooms: list[Room]) -> bool:
    """Return whether a doorway may be there: rooms that are built alike have one in their lower side only."""
    return rooms[side.a].alike < 0 and (rooms[side.b].alike < 0 or not side.vertical)


def doorway(side: Side, width: float, leaf: float, rng: Generator) -> Doorway:
    """Return a doorway at a random place of the side."""
    reach = side.length / 2 - width / 2 - CORNER
    centre = (side.low + side.high) / 2 + float(rng.uniform(-reach, reach))
    return Doorway(side, round(centre, 2), width, leaf)
