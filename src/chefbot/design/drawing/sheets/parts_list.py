"""The parts list of an assembly and the balloons that refer to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from chefbot.design.drawing.drawing import TEXT, Circle, Item, Point, Text, segment
from chefbot.design.drawing.paper import mass_text
from chefbot.robot.geometry.solids import RobotPart, solids

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

LINE = 5.5
"""Height of a line, mm on paper."""
COLUMNS = (0.0, 10.0, 44.0, 58.0, 124.0, 150.0)
"""Edges of number, name, pieces, material and mass, mm on paper."""
HEADS = ("No.", "Part", "Pieces", "Material", "Mass of one")
MAX_LETTERS = 30
"""Letters of a material that fit into its column."""
BALLOON, STEP = 3.2, 8.0
"""Radius of a numbered circle and distance of two, mm on paper."""


class Entry(NamedTuple):
    """An entry of the parts list: a number of equal parts."""

    number: int
    kind: str
    parts: tuple[RobotPart, ...]


class Mark(NamedTuple):
    """A number of the parts list and the point it refers to."""

    number: int
    anchor: Point


def entries(robot: Robot) -> list[Entry]:
    """Return the kinds of parts in assembly order; rods of different length are one kind."""
    kinds: dict[str, list[RobotPart]] = {}
    for part in solids(robot):
        kinds.setdefault(part.kind, []).append(part)
    return [Entry(i, kind, tuple(parts)) for i, (kind, parts) in enumerate(kinds.items(), start=1)]


def table(robot: Robot, left: float, high: float, factor: float) -> list[Item]:
    """Return the list with its upper left corner at a point."""
    rows = [HEADS, *(_cells(robot, entry) for entry in entries(robot))]
    items: list[Item] = []
    for i, cells in enumerate(rows):
        y = high - (i + 0.5) * LINE * factor
        for x, cell in zip(COLUMNS, cells, strict=False):
            items.append(Text("TITLE", left + (x + 1.5) * factor, y, cell))
    low, right = high - len(rows) * LINE * factor, left + COLUMNS[-1] * factor
    lines = [high - i * LINE * factor for i in range(len(rows) + 1)]
    items += [segment("TITLE", (left, y), (right, y)) for y in lines]
    edges = [left + x * factor for x in COLUMNS]
    return items + [segment("TITLE", (x, low), (x, high)) for x in edges]


def balloons(marks: list[Mark], x: float, middle: float, factor: float) -> list[Item]:
    """Return numbered circles one above the other at `x`, in the order of their points."""
    ordered = sorted(marks, key=lambda mark: mark.anchor[1])
    items: list[Item] = []
    for i, mark in enumerate(ordered):
        y = middle + (i - (len(ordered) - 1) / 2) * STEP * factor
        edge = x - BALLOON * factor if mark.anchor[0] < x else x + BALLOON * factor
        items += [
            segment("DIMENSION", mark.anchor, (edge, y)),
            Circle("DIMENSION", *mark.anchor, 0.5 * factor),
            Circle("DIMENSION", x, y, BALLOON * factor),
            Text("TITLE", x, y, str(mark.number), TEXT, "middle"),
        ]
    return items


def _cells(robot: Robot, entry: Entry) -> tuple[str, ...]:
    name = entry.kind.replace("_", " ")
    masses = [part.mass for part in entry.parts]
    mass = mass_text(masses[0]) if max(masses) - min(masses) < 1e-9 else "various"
    return str(entry.number), name, str(len(entry.parts)), _material(robot, entry), mass


def _material(robot: Robot, entry: Entry) -> str:
    """The material; for a bought part its name."""
    bought = {"motor": robot.motor.title, "driver": robot.driver.title, "battery": robot.battery.title}
    text = bought.get(entry.kind, entry.parts[0].material)
    return text if len(text) <= MAX_LETTERS else text[: MAX_LETTERS - 3] + "..."
