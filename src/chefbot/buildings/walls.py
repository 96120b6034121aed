"""Walls and doors of a layout, as elements of a world file."""

from __future__ import annotations

import math
from collections.abc import Mapping

from numpy.random import Generator

from chefbot.buildings.layout import Doorway, Room, Side, is_open, outer_sides
from chefbot.buildings.world_file import Door, Material, Opening, Wall

THICKNESS = 0.12
"""Thickness of a wall, m."""
MIN_PANE = 0.6
"""Shortest wall of glass, m; a shorter piece of wall is of the material of the one before."""
DOOR_HEIGHT = 2.1
"""Height of a doorway, m."""


def walls_of(
    rooms: list[Room], sides: list[Side], doorways: list[Doorway], height: float, glass: float, rng: Generator
) -> list[Wall]:
    """Return the walls of all sides; of those between two rooms a share `glass` is of glass."""
    standing = [*(s for s in sides if not is_open(s, rooms)), *outer_sides(rooms, sides)]
    material: dict[Side, Material] = {
        s: "glass" if s.b >= 0 and s.length > MIN_PANE and float(rng.random()) < glass else "solid"
        for s in standing
    }
    return [_wall(run, material[run[0]], doorways, height) for run in _runs(standing, material)]


def _runs(sides: list[Side], material: Mapping[Side, Material]) -> list[list[Side]]:
    """Return the sides in runs that are one straight wall of one material."""
    runs: list[list[Side]] = []
    for side in sorted(sides, key=lambda s: (s.vertical, s.at, s.low)):
        last = runs[-1][-1] if runs else None
        if (
            last is not None
            and (last.vertical, last.at, last.high) == (side.vertical, side.at, side.low)
            and (material[last] == material[side] or side.length <= MIN_PANE)
        ):
            runs[-1].append(side)
        else:
            runs.append([side])
    return runs


def _wall(run: list[Side], material: Material, doorways: list[Doorway], height: float) -> Wall:
    low = run[0].low
    openings = [
        Opening(at=round(d.centre - low, 2), width=d.width, height=DOOR_HEIGHT)
        for d in doorways
        if d.side in run
    ]
    start, end = _point(run[0], low), _point(run[0], run[-1].high)
    colour = "#bcd4dc" if material == "glass" else "#d8d2c4"
    return Wall(
        start=[*start],
        end=[*end],
        thickness=THICKNESS,
        height=height,
        openings=openings,
        material=material,
        colour=colour,
    )


def doors_of(doorways: list[Doorway]) -> list[Door]:
    """Return the leaves of the doorways that have one, hinged at their lower end."""
    leaves = []
    for number, one in enumerate(d for d in doorways if d.leaf >= 0.0):
        x, y = _point(one.side, one.centre - one.width / 2)
        yaw = round(math.pi / 2, 6) if one.side.vertical else 0.0
        leaves.append(
            Door(name=f"door_{number + 1}", x=x, y=y, yaw=yaw, width=one.width, open=round(one.leaf, 2))
        )
    return leaves


def _point(side: Side, along: float) -> tuple[float, float]:
    along = round(along, 3)
    return (side.at, along) if side.vertical else (along, side.at)
