"""Hidden-line removal between parts: nearer parts cover those behind them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from chefbot.design.drawing.drawing import Item, Layer, Line, Point, loop_item
from chefbot.design.drawing.views import ViewShape
from chefbot.maths.outline import Corner, Loop, points

if TYPE_CHECKING:
    import shapely

DEVIATION = 0.01
"""Maximum deviation of a partly covered arc, mm; uncovered arcs are exact."""
GRID = 1e-4
"""Millimetres that corners are rounded to, so that edges which touch do not cross by a rounding error."""
SPECK = 0.2
"""Millimetres of line, or square millimetres of face, below which nothing is drawn."""


class VisibleLines(NamedTuple):
    """Visible lines of a shape, and a point of its visible face with the area of that face, mm^2."""

    items: list[Item]
    anchor: Point
    area: float


def visible(shapes: Sequence[ViewShape]) -> list[VisibleLines]:
    """Return the visible lines of each shape, in the given order.

    A shape covers every shape that is farther from the viewer: exact for parts that do not intersect in
    depth.
    """
    import shapely

    result: dict[int, VisibleLines] = {}
    covered: shapely.Geometry = shapely.Polygon()
    for index in sorted(range(len(shapes)), key=lambda i: -shapes[i].near):
        shape = shapes[index]
        holes = shapely.union_all([shapely.Polygon(points(hole, DEVIATION)) for hole in shape.holes])
        face = shapely.Polygon(points(shape.edge, DEVIATION)).difference(holes, grid_size=GRID)
        result[index] = _seen(shape, face, covered)
        covered = shapely.union(covered, face, grid_size=GRID)
    return [result[index] for index in range(len(shapes))]


def _seen(shape: ViewShape, face: shapely.Geometry, covered: shapely.Geometry) -> VisibleLines:
    items = _uncovered("OUTLINE", shape.edge, covered)
    for hole in shape.holes:
        items += _uncovered("HOLES", hole, covered)
    left = face.difference(covered, grid_size=GRID)
    spot = left.representative_point() if left.area > SPECK else None
    return VisibleLines(items, (spot.x, spot.y) if spot else (0.0, 0.0), left.area if spot else 0.0)


def _uncovered(layer: Layer, loop: Loop, covered: shapely.Geometry) -> list[Item]:
    import shapely

    ring = shapely.LinearRing(points(loop, DEVIATION))
    rest = ring.difference(covered)
    if rest.length > ring.length - 1e-6:
        return [loop_item(layer, loop)]
    joined = shapely.line_merge(rest)
    return [_open(layer, piece) for piece in shapely.get_parts(joined) if piece.length > SPECK]


def _open(layer: Layer, piece: shapely.LineString) -> Line:
    return Line(layer, tuple(Corner(x, y) for x, y in piece.coords), False)
