"""Projections of solids: a prism is its outline when seen along its axis, and a rectangle from the side."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.design.drawing.drawing import MM, loop_box
from chefbot.maths.outline import Corner, Loop, Outline, arc_between, circle, edges, points
from chefbot.robot.geometry.shapes import AXES, Ball, Prism, Solid, rotation
from chefbot.robot.geometry.solids import RobotPart

DEVIATION = 1e-5
"""Maximum deviation of the silhouette of a rotated part from its arcs, m."""


class View(NamedTuple):
    """A projection: the directions that point right and up on paper; the third one points at the viewer."""

    right: tuple[float, float, float]
    up: tuple[float, float, float]

    @property
    def towards(self) -> NDArray[np.float64]:
        """Return the unit vector from the part to the viewer."""
        return np.cross(self.right, self.up)


PLAN = View((0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
"""From above, forward up: the robot's left is left."""
FRONT = View((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Onto the robot's face: its left is right."""
SIDE = View((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""Onto the robot's right side, forward right: right of FRONT in first-angle projection."""
TOP = View((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
"""From above, forward down: below FRONT in first-angle projection."""


class ViewShape(NamedTuple):
    """A projected solid, mm: silhouette, open holes and hidden bores; `near` is its extent towards the viewer."""

    edge: Loop
    holes: tuple[Loop, ...] = ()
    hidden: tuple[Loop, ...] = ()
    near: float = 0.0


def seen(solid: Solid, view: View) -> ViewShape:
    """Return the projection of a solid in its own frame."""
    axes = np.array([view.right, view.up, view.towards])
    at = axes @ np.array(solid.at) * MM
    if isinstance(solid, Ball):
        return ViewShape(circle(solid.radius * MM, at[0], at[1]), near=at[2] + solid.radius * MM)
    return _seen_prism(solid, axes @ AXES[solid.axis], at)


def part_seen(part: RobotPart, origin: tuple[float, float, float], view: View) -> list[ViewShape]:
    """Return the projections of a part's solids in base_link; the origin of its link is at `origin`."""
    at = np.array(part.at) + np.array(origin)
    if part.pitch or part.yaw:
        return [_turned(solid, rotation(part.pitch, part.yaw), at, view) for solid in part.solids]
    return [seen(solid._replace(at=tuple((np.array(solid.at) + at).tolist())), view) for solid in part.solids]


def cut(outline: Outline) -> list[tuple[float, float]]:
    """Return the intervals of u, in the unit of the outline, in which the line v = 0 is inside the material."""
    loops = (outline.edge, *outline.holes)
    found = sorted({round(u, 12) for loop in loops for a, b in edges(loop) for u in _crossings(a, b)})
    return [(low, high) for low, high in itertools.pairwise(found) if _inside(outline, low, high)]


def _seen_prism(prism: Prism, turn: NDArray[np.float64], at: NDArray[np.float64]) -> ViewShape:
    near = at[2] + float(np.max(_corners(prism.outline.edge, prism.length) @ turn[2])) * MM
    if abs(turn[2, 2]) > 0.5:
        edge, *holes = (_mapped(loop, turn, at) for loop in (prism.outline.edge, *prism.outline.holes))
        return ViewShape(edge, tuple(holes), near=near)
    edge = _from_side(prism.outline.edge, prism.length, turn, at)
    return ViewShape(
        edge, hidden=tuple(_from_side(h, prism.length, turn, at) for h in prism.outline.holes), near=near
    )


def _mapped(loop: Loop, turn: NDArray[np.float64], at: NDArray[np.float64]) -> Loop:
    """Turned, or mirrored (and then run through backwards, which keeps it counter-clockwise)."""
    corners = loop
    if np.linalg.det(turn[:2, :2]) < 0:
        ends = loop[-1:] + loop[:-1]
        corners = tuple(c._replace(bulge=e.bulge) for c, e in zip(loop, ends, strict=True))[::-1]
    placed = [(turn[:2, :2] @ (c.x, c.y) * MM + at[:2]).tolist() for c in corners]
    return tuple(Corner(x, y, c.bulge) for (x, y), c in zip(placed, corners, strict=True))


def _from_side(loop: Loop, length: float, turn: NDArray[np.float64], at: NDArray[np.float64]) -> Loop:
    ends = _corners(loop, length) @ turn[:2].T * MM + at[:2]
    (x0, y0), (x1, y1) = np.min(ends, axis=0).tolist(), np.max(ends, axis=0).tolist()
    return (Corner(x1, y0), Corner(x1, y1), Corner(x0, y1), Corner(x0, y0))


def _corners(loop: Loop, length: float) -> NDArray[np.float64]:
    """(8, 3): the corners of the box round an extruded loop, in its own axes."""
    left, low, right, high = loop_box(loop)
    return np.array(list(itertools.product((left, right), (low, high), (-length / 2, length / 2))))


def _turned(solid: Solid, turn: NDArray[np.float64], at: NDArray[np.float64], view: View) -> ViewShape:
    """Silhouette of a tilted solid: the hull of its points, exact for convex solids."""
    if isinstance(solid, Ball):
        return seen(solid._replace(at=tuple((turn @ np.array(solid.at) + at).tolist())), view)
    flat = np.array(points(solid.outline.edge, DEVIATION))
    ends = [np.column_stack([flat, np.full(len(flat), w)]) for w in (-solid.length / 2, solid.length / 2)]
    placed = (np.vstack(ends) @ AXES[solid.axis].T + np.array(solid.at)) @ turn.T + at
    page = placed @ np.array([view.right, view.up, view.towards]).T * MM
    return ViewShape(_hull(page[:, :2]), near=float(page[:, 2].max()))


def _hull(page: NDArray[np.float64]) -> Loop:
    """Convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted({(round(x, 9), round(y, 9)) for x, y in page.tolist()})

    def chain(sequence: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for p in sequence:
            while len(kept) > 1 and _left_turn(kept[-2], kept[-1], p) <= 0:
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return tuple(Corner(x, y) for x, y in chain(ordered) + chain(ordered[::-1]))


def _left_turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _crossings(a: Corner, b: Corner) -> list[float]:
    """u where the edge from a to b meets v = 0."""
    if not a.bulge:
        return [a.x + (b.x - a.x) * a.y / (a.y - b.y)] if a.y * b.y <= 0 and a.y != b.y else []
    arc = arc_between(a, b)
    if abs(arc.y) > arc.radius:
        return []
    half = (arc.radius**2 - arc.y**2) ** 0.5
    return [u for u in (arc.x - half, arc.x + half) if _on_arc(arc.start, arc.turn, u - arc.x, -arc.y)]


def _on_arc(start: float, turn: float, dx: float, dy: float) -> bool:
    along = (np.arctan2(dy, dx) - start) * np.sign(turn)
    return bool((along + 1e-9) % (2 * np.pi) <= abs(turn) + 2e-9)


def _inside(outline: Outline, low: float, high: float) -> bool:
    """Whether the middle of the interval is material: it lies in the edge and in no hole (even and odd)."""
    u, hits = (low + high) / 2, 0
    for loop in (outline.edge, *outline.holes):
        crossings = {round(c, 12) for a, b in edges(loop) for c in _crossings(a, b)}
        hits += sum(c > u for c in crossings)
    return hits % 2 == 1
