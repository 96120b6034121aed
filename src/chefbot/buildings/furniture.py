"""Pieces of furniture: their elements in a world file and the floor that they take."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import msgspec
from numpy.random import Generator

from chefbot.buildings.rectangle import Rectangle, around
from chefbot.buildings.world_file import BoxSpec, Chair, Cylinder, FloorHole, PosedElement, Table
from chefbot.maths.se2 import SE2

Furniture = Table | Chair | BoxSpec | Cylinder | FloorHole
CHAIR_SPACE = 0.35
"""How far chairs reach beyond the edge of their table, m."""
SIDES = tuple(round(quarter * math.pi / 2, 6) for quarter in (0, 1, 2, -1))


class FurniturePiece(NamedTuple):
    """Furniture that belongs together. size: footprint along x and y, m. elements: in a frame at its centre.

    The back of a piece faces -y: that side stands at a wall. served: whether a robot delivers to it.
    """

    size: tuple[float, float]
    elements: tuple[Furniture, ...]
    served: bool = False


class PlacedPiece(NamedTuple):
    """A piece at a pose whose yaw is a multiple of 90 degrees."""

    piece: FurniturePiece
    pose: SE2

    @property
    def rect(self) -> Rectangle:
        """The footprint in the building's frame."""
        width, depth = self.piece.size
        if round(self.pose.yaw / (math.pi / 2)) % 2:
            width, depth = depth, width
        return around(self.pose.x, self.pose.y, width, depth)

    def elements(self, number: Callable[[str], str]) -> list[Furniture]:
        """Return the elements in the building's frame; `number` makes a unique name of a common one."""
        return [_placed(one, self.pose, number) for one in self.piece.elements]


def _placed(one: Furniture, frame: SE2, number: Callable[[str], str]) -> Furniture:
    at = frame @ SE2(one.x, one.y, one.yaw if isinstance(one, PosedElement) else 0.0)
    moved = {"x": round(at.x, 3), "y": round(at.y, 3)}
    if isinstance(one, PosedElement):
        moved["yaw"] = round(at.yaw, 6)
    if isinstance(one, FloorHole) and round(frame.yaw / (math.pi / 2)) % 2:
        one = msgspec.structs.replace(one, size=one.size[::-1])
    if isinstance(one, Chair):
        return msgspec.structs.replace(one, **moved)
    return msgspec.structs.replace(one, name=number(one.name), **moved)


def cupboard(name: str, width: float, depth: float, height: float, colour: str = "#9a8f80") -> FurniturePiece:
    """Return a box that stands on the floor, such as a wardrobe, counter or bed."""
    return FurniturePiece(
        (width, depth), (BoxSpec(name=name, x=0.0, y=0.0, size=[width, depth, height], colour=colour),)
    )


def desk(rng: Generator) -> FurniturePiece:
    """Return a desk at a wall with its chair, pulled out by some decimetres."""
    width, depth = float(rng.uniform(1.2, 1.8)), float(rng.uniform(0.7, 0.9))
    chair_y = depth / 2 - 0.18 + float(rng.uniform(0.0, 0.2))
    table = Table(name="desk", x=0.0, y=-0.3, size=round(width, 2), depth=round(depth, 2))
    chair = Chair(x=0.0, y=round(chair_y, 2), yaw=-math.pi / 2 + float(rng.uniform(-0.5, 0.5)))
    return FurniturePiece((round(width, 2), round(depth + 0.6, 2)), (table, chair), served=True)


def dining_table(rng: Generator, size: float, chairs: int) -> FurniturePiece:
    """Return a square or round table with chairs on some of its sides."""
    bearings = [SIDES[i] for i in sorted(rng.permutation(4)[:chairs])]
    table = Table(name="dining_table", x=0.0, y=0.0, size=size, chairs=bearings)
    if rng.random() < 0.4:
        table = msgspec.structs.replace(table, shape="round")
    reach = size + 2 * CHAIR_SPACE
    return FurniturePiece((reach, reach), (table,), served=True)


def meeting_table(rng: Generator) -> FurniturePiece:
    """Return a long table with chairs on all four sides."""
    length, depth = round(float(rng.uniform(1.8, 2.6)), 2), round(float(rng.uniform(0.9, 1.2)), 2)
    table = Table(name="meeting_table", x=0.0, y=0.0, size=length, depth=depth, chairs=list(SIDES))
    return FurniturePiece((length + 2 * CHAIR_SPACE, depth + 2 * CHAIR_SPACE), (table,), served=True)


def column(rng: Generator, height: float) -> FurniturePiece:
    """Return a round column up to the ceiling at `height` metres."""
    radius = round(float(rng.uniform(0.16, 0.35)), 2)
    item = Cylinder(name="column", x=0.0, y=0.0, radius=radius, height=height, colour="#cfc9be")
    return FurniturePiece((2 * radius, 2 * radius), (item,))


def rack(length: float, depth: float, clear: float) -> FurniturePiece:
    """Return a rack on posts whose lowest shelf leaves `clear` metres of height below it."""
    posts = tuple(
        Cylinder(
            name="rack_post", x=sx * (length / 2 - 0.04), y=sy * (depth / 2 - 0.04), radius=0.04, height=2.2
        )
        for sx in (-1, 1)
        for sy in (-1, 1)
    )
    shelf = BoxSpec(
        name="rack_shelf", x=0.0, y=0.0, size=[length, depth, 1.6], bottom=round(clear, 2), colour="#b0763a"
    )
    return FurniturePiece((length, depth), (shelf, *posts))


def clutter(rng: Generator) -> FurniturePiece:
    """Return a thing that somebody left: a carton, a bin, a plant or a chair."""
    kind = int(rng.integers(4))
    if kind == 0:
        width, depth, height = (round(float(x), 2) for x in rng.uniform(0.2, 0.6, 3))
        return cupboard("carton", width, depth, height, "#b3966b")
    if kind == 1:
        return FurniturePiece(
            (0.3, 0.3), (Cylinder(name="bin", x=0.0, y=0.0, radius=0.14, height=0.35, colour="#4c4f54"),)
        )
    if kind == 2:
        radius = round(float(rng.uniform(0.12, 0.25)), 2)
        return FurniturePiece(
            (2 * radius, 2 * radius), (Cylinder(name="plant", x=0.0, y=0.0, radius=radius, height=1.1),)
        )
    return moved_chair(rng)


def moved_chair(rng: Generator) -> FurniturePiece:
    """Return a chair that somebody has left away from a table, at any yaw."""
    return FurniturePiece((0.6, 0.6), (Chair(x=0.0, y=0.0, yaw=round(float(rng.uniform(-3.1, 3.1)), 2)),))


def hanging_board(rng: Generator) -> FurniturePiece:
    """Return a board whose lower edge hangs between the heights of a laser's plane and of a robot's top."""
    width, bottom = round(float(rng.uniform(0.6, 1.6)), 2), round(float(rng.uniform(0.22, 0.45)), 2)
    board = BoxSpec(name="board", x=0.0, y=0.0, size=[width, 0.05, 0.6], bottom=bottom, colour="#f0e6c8")
    return FurniturePiece((width, 0.05), (board,))


def step(rng: Generator) -> FurniturePiece:
    """Return a platform that is 3 to 15 cm high, below the plane of a laser."""
    width, depth = (round(float(x), 2) for x in rng.uniform(1.0, 2.0, 2))
    return cupboard("step", width, depth, round(float(rng.uniform(0.03, 0.15)), 2), "#8d8d86")


def hole(rng: Generator) -> FurniturePiece:
    """Return a hole in the floor, such as a stairwell or an open hatch."""
    width, depth, deep = (round(float(x), 2) for x in rng.uniform((0.5, 0.5, 0.1), (1.5, 1.5, 1.0)))
    return FurniturePiece(
        (width, depth), (FloorHole(name="hole", x=0.0, y=0.0, size=[width, depth], depth=deep),)
    )


def mirror(rng: Generator) -> FurniturePiece:
    """Return a mirror that leans flat at a wall."""
    width = round(float(rng.uniform(0.5, 1.5)), 2)
    item = BoxSpec(
        name="mirror", x=0.0, y=0.0, size=[width, 0.03, 1.9], bottom=0.05, colour="#dfe7ea", material="mirror"
    )
    return FurniturePiece((width, 0.03), (item,))
