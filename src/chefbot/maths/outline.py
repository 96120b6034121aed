"""Planar shapes bounded by lines and arcs, with exact areas and moments.

A corner stores the bulge of the edge that leaves it: the tangent of a quarter of the arc's angle, positive
for an arc to the left, 0 for a straight line. DXF stores polylines in the same way, so a drawing keeps true
arcs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple


class Corner(NamedTuple):
    """A vertex of a loop, metres, and the bulge of the edge to the next vertex."""

    x: float
    y: float
    bulge: float = 0.0


Loop = tuple[Corner, ...]
"""A closed curve without self-intersections, counter-clockwise."""


class Moments(NamedTuple):
    """Integrals over a shape of 1, x, y, x^2, y^2 and x y."""

    area: float
    x: float
    y: float
    xx: float
    yy: float
    xy: float

    def plus(self, other: Moments, factor: float = 1.0) -> Moments:
        """Return the sum of these moments and `factor` times the other ones."""
        return Moments(*(a + factor * b for a, b in zip(self, other, strict=True)))


ZERO_MOMENTS = Moments(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Outline(NamedTuple):
    """A planar shape: its outer edge and its holes."""

    edge: Loop
    holes: tuple[Loop, ...] = ()

    def moments(self) -> Moments:
        """Return the exact moments about the origin."""
        total = loop_moments(self.edge)
        for hole in self.holes:
            total = total.plus(loop_moments(hole), -1.0)
        return total


def circle(radius: float, x: float = 0.0, y: float = 0.0) -> Loop:
    """Return a circle as a loop of two semicircles."""
    return (Corner(x + radius, y, 1.0), Corner(x - radius, y, 1.0))


def rectangle(width: float, height: float, x: float = 0.0, y: float = 0.0) -> Loop:
    """Return a rectangle centred at (x, y)."""
    a, b = width / 2, height / 2
    return tuple(Corner(x + sx * a, y + sy * b) for sx, sy in ((1, -1), (1, 1), (-1, 1), (-1, -1)))


def arc_bulge(angle: float) -> float:
    """Return the bulge of an arc that turns by `angle` (rad, |angle| < 2 pi)."""
    return math.tan(angle / 4.0)


def loop_moments(loop: Loop) -> Moments:
    """Return the moments of the polygon of the corners plus the circular segment of every arc."""
    total = ZERO_MOMENTS
    for a, b in edges(loop):
        total = total.plus(_triangle(a, b))
        if a.bulge != 0.0:
            total = total.plus(_segment(a, b), math.copysign(1.0, a.bulge))
    return total


def edges(loop: Loop) -> Iterator[tuple[Corner, Corner]]:
    """Iterate over the edges: each corner with the next one."""
    return zip(loop, loop[1:] + loop[:1], strict=True)


class Arc(NamedTuple):
    """A circular arc: centre, radius, angle of the first point, signed turning angle (left positive)."""

    x: float
    y: float
    radius: float
    start: float
    turn: float


def arc_between(a: Corner, b: Corner) -> Arc:
    """Return the arc from a to b with a's bulge (which is not 0)."""
    # r = chord (1 + b^2) / (4 |b|)
    chord = math.hypot(b.x - a.x, b.y - a.y)
    radius = chord * (1.0 + a.bulge**2) / (4.0 * abs(a.bulge))
    centre_offset = (
        chord * (1.0 - a.bulge**2) / (4.0 * a.bulge)
    )  # from the chord's middle to the centre, leftwards
    nx, ny = -(b.y - a.y) / chord, (b.x - a.x) / chord
    x, y = (a.x + b.x) / 2 + nx * centre_offset, (a.y + b.y) / 2 + ny * centre_offset
    return Arc(x, y, radius, math.atan2(a.y - y, a.x - x), 4.0 * math.atan(a.bulge))


def points(loop: Loop, deviation: float) -> list[tuple[float, float]]:
    """Return the loop as a polygon within `deviation` metres of each arc, at least 24 points per full turn."""
    polygon = []
    for a, b in edges(loop):
        polygon.append((a.x, a.y))
        if a.bulge != 0.0:
            polygon += _arc_points(arc_between(a, b), deviation)
    return polygon


def _arc_points(arc: Arc, deviation: float) -> list[tuple[float, float]]:
    """Return the intermediate points of an arc without its end points."""
    max_step = 2.0 * math.acos(max(1.0 - deviation / arc.radius, math.cos(math.pi / 24)))
    count = math.ceil(abs(arc.turn) / max_step - 1e-9)
    angles = [arc.start + arc.turn * i / count for i in range(1, count)]
    return [(arc.x + arc.radius * math.cos(t), arc.y + arc.radius * math.sin(t)) for t in angles]


def _triangle(a: Corner, b: Corner) -> Moments:
    """Return the signed moments of the triangle origin, a, b (Green's theorem for a polygon's edge)."""
    cross = a.x * b.y - b.x * a.y
    return Moments(
        cross / 2.0,
        cross * (a.x + b.x) / 6.0,
        cross * (a.y + b.y) / 6.0,
        cross * (a.x**2 + a.x * b.x + b.x**2) / 12.0,
        cross * (a.y**2 + a.y * b.y + b.y**2) / 12.0,
        cross * (a.x * b.y + 2.0 * a.x * a.y + 2.0 * b.x * b.y + b.x * a.y) / 24.0,
    )


def _segment(a: Corner, b: Corner) -> Moments:
    """Return the positive moments of the circular segment (Weisstein, MathWorld, "Circular Segment")."""
    arc = arc_between(a, b)
    r, turn = arc.radius, abs(arc.turn)
    theta_minus_sin = turn - math.sin(turn)
    # Area and centroid: r^2 (t - sin t) / 2 and 4 r sin^3(t / 2) / (3 (t - sin t)) from the centre
    area = r**2 * theta_minus_sin / 2.0
    centroid_distance = (
        4.0 * r * math.sin(turn / 2.0) ** 3 / (3.0 * theta_minus_sin)
    )  # from the circle's centre
    cubic = 2.0 * math.sin(turn) * math.sin(turn / 2.0) ** 2
    # Second moments along and across the bisector
    along, across = r**4 * (theta_minus_sin + cubic) / 8.0, r**4 * (3.0 * theta_minus_sin - cubic) / 24.0
    bisector = arc.start + arc.turn / 2.0
    c, s = math.cos(bisector), math.sin(bisector)
    # First moments about the arc's centre
    mx, my = area * centroid_distance * c, area * centroid_distance * s
    # Rotate to the axes of the frame
    xx, yy, xy = along * c * c + across * s * s, along * s * s + across * c * c, (along - across) * c * s
    return Moments(
        area,
        mx + area * arc.x,
        my + area * arc.y,
        xx + 2.0 * arc.x * mx + area * arc.x**2,
        yy + 2.0 * arc.y * my + area * arc.y**2,
        xy + arc.x * my + arc.y * mx + area * arc.x * arc.y,
    )
