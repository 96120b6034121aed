"""Places of a building: where the robot starts, fetches and serves, all of which it reaches."""

from __future__ import annotations

import math
from collections.abc import Iterator

from numpy.random import Generator

from chefbot.buildings.furniture import PlacedPiece
from chefbot.buildings.layout import Room, Use
from chefbot.buildings.reachable_floor import ReachableFloor
from chefbot.buildings.world_file import NamedPose
from chefbot.maths.se2 import SE2

HOME_USES = (Use.CORRIDOR, Use.HALL, Use.LIVING, Use.RACKS, Use.DINING, Use.OFFICE)
"""Uses of rooms where the robot may start, the best ones first."""
SERVING_DISTANCE = 0.2
"""Distance between the robot and the table that it serves, m."""
TRIES = 60
"""Points of a room that are tried for a place."""


def choose_places(
    rooms: list[Room],
    served: list[PlacedPiece],
    floor: ReachableFloor,
    radius: float,
    tables: int,
    rng: Generator,
) -> dict[str, NamedPose]:
    """Return `home`, `kitchen` and up to `tables` tables; those that the robot does not reach are missing."""
    home = _in_rooms(sorted(_of(rooms, *HOME_USES), key=lambda r: HOME_USES.index(r.use)), floor, rng)
    kitchen = _in_rooms(_of(rooms, Use.KITCHEN), floor, rng)
    serving = [pose for piece in served if (pose := _serving_pose(piece, floor, radius)) is not None]
    chosen = [serving[i] for i in sorted(rng.permutation(len(serving))[:tables])]
    named = {"home": home, "kitchen": kitchen, **{f"table_{i + 1}": pose for i, pose in enumerate(chosen)}}
    return {name: _named_pose(pose) for name, pose in named.items() if pose is not None}


def _of(rooms: list[Room], *uses: Use) -> list[Room]:
    return [room for room in rooms if room.use in uses]


def _in_rooms(rooms: list[Room], floor: ReachableFloor, rng: Generator) -> SE2 | None:
    """Return a random pose in the first of the rooms that the robot reaches."""
    for room in rooms:
        for _ in range(TRIES):
            x, y = (
                float(rng.uniform(room.rect.x0, room.rect.x1)),
                float(rng.uniform(room.rect.y0, room.rect.y1)),
            )
            if floor.holds(round(x, 2), round(y, 2)):
                return SE2(round(x, 2), round(y, 2), math.pi / 2 * int(rng.integers(-1, 3)))
    return None


def _serving_pose(placed: PlacedPiece, floor: ReachableFloor, radius: float) -> SE2 | None:
    """Return the first reachable pose at one of the piece's sides, facing it."""
    poses = (pose for pose in _beside(placed, radius) if floor.holds(pose.x, pose.y))
    return next(poses, None)


def _beside(placed: PlacedPiece, radius: float) -> Iterator[SE2]:
    (x, y), rect = placed.rect.centre, placed.rect
    distance = radius + SERVING_DISTANCE
    for yaw, reach in (
        (0.0, rect.width),
        (math.pi / 2, rect.depth),
        (math.pi, rect.width),
        (-math.pi / 2, rect.depth),
    ):
        away = reach / 2 + distance
        # from the side that lies behind, the robot looks along `yaw` at the piece
        yield SE2(round(x - away * math.cos(yaw), 2), round(y - away * math.sin(yaw), 2), yaw)


def _named_pose(pose: SE2) -> NamedPose:
    return NamedPose(x=pose.x, y=pose.y, yaw=round(pose.yaw, 6))
