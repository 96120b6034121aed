"""Furnishing of rooms: where pieces stand, so that aisles and doorways stay free."""

from __future__ import annotations

import math
from collections.abc import Iterable

from numpy.random import Generator

from chefbot.buildings.furniture import FurniturePiece, PlacedPiece
from chefbot.buildings.rectangle import Rectangle, around
from chefbot.maths.se2 import SE2

TRIES = 12
"""Places that are tried for a piece before it is left out."""
AT_WALL = {0: math.pi, 1: -math.pi / 2, 2: 0.0, 3: math.pi / 2}
"""Yaw of a piece that stands at the wall: 0 upper, 1 left, 2 lower, 3 right; its back faces that wall."""


class Furnishing:
    """The furniture of one room.

    floor: within its walls. keep_free: floor at doorways. aisle: distance between two pieces, m.
    """

    def __init__(self, floor: Rectangle, keep_free: Iterable[Rectangle], aisle: float) -> None:
        self.floor, self.aisle = floor, aisle
        self._keep_free = list(keep_free)
        self.pieces: list[PlacedPiece] = []

    def add(self, piece: FurniturePiece, pose: SE2, aisle: float | None = None) -> bool:
        """Put the piece there if it fits, and return whether it does.

        aisle: distance to other pieces, m, if it is not that of the room.
        """
        placed = PlacedPiece(piece, pose)
        rect, aisle = placed.rect, self.aisle if aisle is None else aisle
        fits = (
            self.floor.expanded(1e-6).contains(rect)
            and not any(rect.overlaps(zone) for zone in self._keep_free)
            and not any(rect.expanded(aisle).overlaps(other.rect) for other in self.pieces)
        )
        if fits:
            self.pieces.append(placed)
        return fits

    def at_wall(self, piece: FurniturePiece, rng: Generator) -> bool:
        """Put the piece with its back to a random wall; return whether it fits somewhere."""
        return any(self._at_random_wall(piece, rng) for _ in range(TRIES))

    def _at_random_wall(self, piece: FurniturePiece, rng: Generator) -> bool:
        wall, along = int(rng.integers(4)), float(rng.random())
        width, depth = piece.size
        f, half = self.floor, depth / 2
        if wall in (0, 2):
            x = f.x0 + width / 2 + along * (f.width - width)
            y = f.y1 - half if wall == 0 else f.y0 + half
        else:
            x = f.x0 + half if wall == 1 else f.x1 - half
            y = f.y0 + width / 2 + along * (f.depth - width)
        return self.add(piece, SE2(round(x, 3), round(y, 3), AT_WALL[wall]))

    def inside(self, piece: FurniturePiece, rng: Generator) -> bool:
        """Put the piece somewhere with an aisle to every wall; return whether it fits somewhere."""
        return any(self._at_random_point(piece, rng) for _ in range(TRIES))

    def _at_random_point(self, piece: FurniturePiece, rng: Generator) -> bool:
        yaw = math.pi / 2 * int(rng.integers(4))
        reach = PlacedPiece(piece, SE2(0.0, 0.0, yaw)).rect
        room = self.floor.expanded(-self.aisle)
        free = Rectangle(room.x0 - reach.x0, room.y0 - reach.y0, room.x1 - reach.x1, room.y1 - reach.y1)
        if free.width <= 0.0 or free.depth <= 0.0:
            return False
        x, y = float(rng.uniform(free.x0, free.x1)), float(rng.uniform(free.y0, free.y1))
        return self.add(piece, SE2(round(x, 3), round(y, 3), yaw))

    def in_rows(self, piece: FurniturePiece, spacing: tuple[float, float]) -> None:
        """Put copies of the piece on a grid with this spacing along x and y, m, where they fit."""
        room = self.floor.expanded(-self.aisle)
        columns = int((room.width - piece.size[0]) // spacing[0]) + 1 if room.width >= piece.size[0] else 0
        rows = int((room.depth - piece.size[1]) // spacing[1]) + 1 if room.depth >= piece.size[1] else 0
        x0 = self.floor.centre[0] - (columns - 1) * spacing[0] / 2
        y0 = self.floor.centre[1] - (rows - 1) * spacing[1] / 2
        for row in range(rows):
            for column in range(columns):
                self.add(piece, SE2(round(x0 + column * spacing[0], 3), round(y0 + row * spacing[1], 3), 0.0))


def before_doorway(x: float, y: float, vertical: bool, width: float, aisle: float) -> Rectangle:
    """Return the floor on both sides of a doorway that stays free, as deep as an aisle."""
    return around(x, y, *((2 * aisle, width) if vertical else (width, 2 * aisle)))
