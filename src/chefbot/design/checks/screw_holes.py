"""Screw holes: inside the material, with clearance to edges and to each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.design.checks.finding import Bound, Finding, Severity, below, mm_up
from chefbot.maths.outline import Outline, arc_between, points
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.outlines import (
    base_plate_outline,
    clamp_face_outline,
    clamp_holes,
    flange_outline,
    middle_plate_outline,
    pole_holes,
)
from chefbot.robot.spec import Robot

CHORD_DEVIATION = 1e-5
"""Metres between an arc and the chords that distances are measured to."""
EDGE_DISTANCE = 1.2
"""Hole's middle to the edge, in diameters (EN 1993-1-8, table 3.3: e1, e2); for thin plates a rule of thumb."""
SPACING = 2.2
"""Between the middles of two holes, in diameters (EN 1993-1-8, table 3.3: p1)."""


class Hole(NamedTuple):
    """A screw hole in a part: its centre, and the key that moves it."""

    part: str
    name: str
    at: tuple[float, float]
    key: str


def holes(robot: Robot) -> Iterator[Finding]:
    """Return all findings about screw holes and about the hole for the shaft."""
    diameter = robot.plates.screw_hole
    base = [
        *_named("base_plate", "pole screw", pole_holes(robot), "poles.reach"),
        *_named("base_plate", "caster screw", layout.caster_screws(robot), "casters.offset"),
        *_named("base_plate", "clamp screw", clamp_holes(robot), "motor_clamp.length"),
    ]
    yield from _in_outline(base_plate_outline(robot), base, diameter)
    upper = _named("plates above", "pole screw", pole_holes(robot), "poles.reach")
    if robot.plates.count > 1:
        yield from _in_outline(middle_plate_outline(robot), upper, diameter)
    flange = _named("motor_clamp", "clamp screw", layout.clamp_screws(robot), "motor_clamp.width")
    yield from _in_outline(flange_outline(robot), flange, diameter)
    yield from _shaft_hole(robot)


def _named(part: str, name: str, places: list[tuple[float, float]], key: str) -> list[Hole]:
    return [Hole(part, name, at, key) for at in places]


def _in_outline(outline: Outline, found: list[Hole], diameter: float) -> Iterator[Finding]:
    """The worst hole of each kind, against the edges and all other screws."""
    loops = [np.array(points(outline.edge, CHORD_DEVIATION))]
    for loop in outline.holes:
        arc = arc_between(loop[0], loop[1])
        if all(np.hypot(arc.x - hole.at[0], arc.y - hole.at[1]) > CHORD_DEVIATION for hole in found):
            loops.append(np.array(points(loop, CHORD_DEVIATION)))
    for name in dict.fromkeys(hole.name for hole in found):
        same = [hole for hole in found if hole.name == name]
        margin, worst = min((_margin(hole.at, loops), hole) for hole in same)
        yield from _edge(worst, margin, diameter)
        yield from _neighbours(same, found, diameter)


def _edge(hole: Hole, margin: float, diameter: float) -> Iterator[Finding]:
    """A hole that is open, or too close to the edge."""
    severity: Severity = "error" if margin <= diameter / 2.0 else "warning"
    x, y = 1000.0 * hole.at[0], 1000.0 * hole.at[1]
    sentence = (
        f"a {hole.name}'s hole at ({x:.4g}, {y:.4g}) mm of {hole.part} is {1000 * margin:.3g} mm from an edge"
    )
    yield from below(
        "hole", hole.part, sentence, Bound(margin, EDGE_DISTANCE * diameter, "m"), hole.key, "", severity
    )


def _neighbours(same: list[Hole], found: list[Hole], diameter: float) -> Iterator[Finding]:
    distances = [
        (float(np.hypot(one.at[0] - other.at[0], one.at[1] - other.at[1])), one, other)
        for i, one in enumerate(same)
        for other in (*same[i + 1 :], *(hole for hole in found if hole.name > one.name))
    ]
    if not distances:
        return
    distance, one, other = min(distances)
    severity: Severity = "error" if distance <= diameter else "warning"
    sentence = f"holes of a {one.name} and of a {other.name} in {one.part} are {1000 * distance:.3g} mm apart"
    yield from below(
        "hole", one.part, sentence, Bound(distance, SPACING * diameter, "m"), one.key, "", severity
    )


def _margin(at: tuple[float, float], loops: list[NDArray[np.float64]]) -> float:
    """Metres to the nearest edge; negative outside of the first loop or inside of another."""
    point = np.array(at)
    wrong = [_inside(point, loop) != (i == 0) for i, loop in enumerate(loops)]
    nearest = min(_distance(point, loop) for loop in loops)
    return -nearest if any(wrong) else nearest


def _distance(point: NDArray[np.float64], loop: NDArray[np.float64]) -> float:
    side = np.roll(loop, -1, axis=0) - loop
    along = ((point - loop) * side).sum(axis=1) / (side**2).sum(axis=1)
    nearest = loop + np.clip(along, 0.0, 1.0)[:, None] * side
    return float(np.hypot(*(point - nearest).T).min())


def _inside(point: NDArray[np.float64], loop: NDArray[np.float64]) -> bool:
    """Whether a point is inside, by the number of edges to its right."""
    next_corners = np.roll(loop, -1, axis=0)
    crosses = (loop[:, 1] > point[1]) != (next_corners[:, 1] > point[1])
    a, b = loop[crosses], next_corners[crosses]
    x = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(x > point[0]) % 2)


def _shaft_hole(robot: Robot) -> Iterator[Finding]:
    """The material of the clamp's face around the hole of the shaft."""
    outline = clamp_face_outline(robot, layout.plate_undersides(robot)[0] - robot.motor_clamp.thickness)
    arc = arc_between(*outline.holes[0][:2])
    margin = _margin((arc.x, arc.y), [np.array(points(outline.edge, CHORD_DEVIATION))])
    wanted = arc.radius + robot.motor_clamp.thickness
    yield from below(
        "hole", "motor_clamp", "the clamp's face has too little material round the shaft's hole",
        Bound(margin, wanted, "m"), "motor_clamp.width", mm_up(2.0 * wanted),
    )  # fmt: skip
