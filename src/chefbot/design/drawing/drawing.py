"""The items of a technical drawing, independent of a file format: lines, texts and dimensions.

Lengths are true millimetres in the plane of the sheet, x to the right and y up. Sizes on paper (text heights,
gaps) are in millimetres of paper and multiplied by the sheet's factor: a sheet of 1:2 has the factor 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal, NamedTuple

from chefbot.maths.outline import Corner, Loop, arc_between, circle, edges

Layer = Literal["OUTLINE", "HOLES", "CENTRE", "DIMENSION", "REFERENCE", "TITLE"]
Align = Literal["left", "middle", "right"]
Point = tuple[float, float]

MM = 1000.0
"""Millimetres in a metre."""
TEXT = 2.5
"""Height of letters on paper, mm (ISO 3098 series: 2.5, 3.5, 5)."""
LETTER = 0.85
"""Ratio of a letter's width to its height, an upper estimate."""
ROW = 7.0
"""Distance of two rows of dimensions, mm on paper."""
FIRST_ROW = 9.0
"""Distance from the view to the first row, mm on paper."""


class Line(NamedTuple):
    """Corners joined by lines and arcs; a hidden line is dashed."""

    layer: Layer
    corners: Loop
    closed: bool = True
    hidden: bool = False


class Circle(NamedTuple):
    """A full circle by centre and radius."""

    layer: Layer
    x: float
    y: float
    radius: float
    hidden: bool = False


class Text(NamedTuple):
    """A line of text; `height` in mm on paper, y at the middle of the letters."""

    layer: Layer
    x: float
    y: float
    text: str
    height: float = TEXT
    align: Align = "left"


class Linear(NamedTuple):
    """A dimension along x or y; its line is at `at` on the other axis, and <> stands for the measurement.

    The text is above the middle, `shift` (mm on paper) along the line from it; beyond the end if it is too
    narrow.
    """

    a: Point
    b: Point
    along: Literal["x", "y"]
    at: float
    text: str = "<>"
    shift: float = 0.0

    def text_shift(self, factor: float) -> float:
        """Return the offset of the text along the line, mm of the drawing."""
        axis = 0 if self.along == "x" else 1
        span, letters = abs(self.a[axis] - self.b[axis]), self._letters() * factor
        narrow = letters + 0.4 * TEXT * factor > span
        return span / 2 + letters / 2 + 0.8 * TEXT * factor if narrow else self.shift * factor

    def _letters(self) -> float:
        axis = 0 if self.along == "x" else 1
        value = number(abs(self.a[axis] - self.b[axis]))
        return LETTER * TEXT * len(self.text.replace("<>", value))


class Radial(NamedTuple):
    """A radius or diameter that touches its circle at `angle` (degrees); <> stands for the measurement with its sign.

    The text is `reach` (mm on paper) from the circle, outwards if positive.
    """

    kind: Literal["radius", "diameter"]
    x: float
    y: float
    radius: float
    angle: float
    reach: float
    text: str = "<>"

    @property
    def label(self) -> str:
        """Return the text with sign and measurement filled in, because programs differ in writing the sign."""
        size = f"R{number(self.radius)}" if self.kind == "radius" else f"Ø{number(2.0 * self.radius)}"
        return self.text.replace("<>", size)


class Hatch(NamedTuple):
    """A hatched section of material inside loops."""

    loops: tuple[Loop, ...]


Item = Line | Circle | Text | Linear | Radial | Hatch


class Title(NamedTuple):
    """The contents of the title block of a part."""

    robot: str
    part: str
    material: str
    size: str
    pieces: int
    mass: float
    """Mass of one piece, kg."""


class Plan(NamedTuple):
    """A part drawn for one scale: the sheet without frame and title block."""

    title: Title
    items: tuple[Item, ...]


class BoundingBox(NamedTuple):
    """A rectangle around items on the sheet, mm."""

    left: float
    low: float
    right: float
    high: float

    @property
    def width(self) -> float:
        """Return the extent along x, mm."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Return the extent along y, mm."""
        return self.high - self.low

    @property
    def middle(self) -> Point:
        """Return the centre of the box, mm."""
        return (self.left + self.right) / 2, (self.low + self.high) / 2


def number(value: float) -> str:
    """Return a length in millimetres without trailing zeros."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def around(boxes: Iterable[BoundingBox]) -> BoundingBox:
    """Return the smallest box that contains all boxes."""
    lefts, lows, rights, highs = zip(*boxes, strict=True)
    return BoundingBox(min(lefts), min(lows), max(rights), max(highs))


def scaled(loop: Loop, factor: float, x: float = 0.0, y: float = 0.0) -> Loop:
    """Return the loop scaled by `factor`, then shifted."""
    return tuple(Corner(factor * c.x + x, factor * c.y + y, c.bulge) for c in loop)


def loop_item(layer: Layer, loop: Loop, hidden: bool = False) -> Line | Circle:
    """Return a circle if the loop is one, else a closed line."""
    if len(loop) == 2 and all(abs(corner.bulge) == 1.0 for corner in loop):
        a, b = loop
        radius = ((a.x - b.x) ** 2 + (a.y - b.y) ** 2) ** 0.5 / 2
        return Circle(layer, (a.x + b.x) / 2, (a.y + b.y) / 2, radius, hidden)
    return Line(layer, loop, True, hidden)


def segment(layer: Layer, a: Point, b: Point) -> Line:
    """Return a straight line between two points."""
    return Line(layer, (Corner(*a), Corner(*b)), False)


def rectangle(layer: Layer, box: BoundingBox) -> Line:
    """Return the outline of a box."""
    left, low, right, high = box
    corners = ((right, low), (right, high), (left, high), (left, low))
    return Line(layer, tuple(Corner(*corner) for corner in corners))


def loop_box(loop: Loop) -> BoundingBox:
    """Return the exact bounding box of a loop, extreme points of arcs included."""
    points = [(corner.x, corner.y) for corner in loop]
    for a, b in edges(loop):
        if a.bulge:
            points += _extremes(a, b)
    xs, ys = zip(*points, strict=True)
    return BoundingBox(min(xs), min(ys), max(xs), max(ys))


def item_box(item: Item, factor: float) -> BoundingBox:
    """Return the bounding box of an item with its text, at the scale factor of a sheet."""
    match item:
        case Line():
            return loop_box(item.corners) if item.closed else around(_dot(c.x, c.y) for c in item.corners)
        case Circle():
            return loop_box(circle(item.radius, item.x, item.y))
        case Hatch():
            return around(loop_box(loop) for loop in item.loops)
        case Text():
            return _text_box(item, factor)
        case Linear():
            return _linear_box(item, factor)
        case Radial():
            return _radial_box(item, factor)


def moved(item: Item, dx: float, dy: float) -> Item:
    """Return the item shifted by an offset."""
    match item:
        case Line():
            return item._replace(corners=scaled(item.corners, 1.0, dx, dy))
        case Hatch():
            return Hatch(tuple(scaled(loop, 1.0, dx, dy) for loop in item.loops))
        case Linear():
            (ax, ay), (bx, by) = item.a, item.b
            at = item.at + (dy if item.along == "x" else dx)
            return item._replace(a=(ax + dx, ay + dy), b=(bx + dx, by + dy), at=at)
        case _:
            return item._replace(x=item.x + dx, y=item.y + dy)


def _extremes(a: Corner, b: Corner) -> list[Point]:
    arc = arc_between(a, b)
    low, high = sorted((arc.start, arc.start + arc.turn))
    first = math.ceil(low / (math.pi / 2) - 1e-9)
    quarters = []
    while first * math.pi / 2 <= high + 1e-9:
        angle = first * math.pi / 2
        quarters.append((arc.x + arc.radius * math.cos(angle), arc.y + arc.radius * math.sin(angle)))
        first += 1
    return quarters


def _dot(x: float, y: float) -> BoundingBox:
    return BoundingBox(x, y, x, y)


def _text_box(item: Text, factor: float) -> BoundingBox:
    height = item.height * factor
    width = LETTER * height * len(item.text)
    left = item.x - {"left": 0.0, "middle": width / 2, "right": width}[item.align]
    return BoundingBox(left, item.y - height / 2, left + width, item.y + height / 2)


def _linear_box(item: Linear, factor: float) -> BoundingBox:
    margin = 2.0 * TEXT * factor
    ends = around((_dot(*item.a), _dot(*item.b)))
    (x, y), beyond = ends.middle, item.text_shift(factor) + LETTER * TEXT * len(item.text) * factor
    if item.along == "x":
        line = BoundingBox(ends.left, item.at - margin / 2, max(ends.right, x + beyond), item.at + margin)
    else:
        line = BoundingBox(item.at - margin, ends.low, item.at + margin / 2, max(ends.high, y + beyond))
    return around((ends, line))


def _radial_box(item: Radial, factor: float) -> BoundingBox:
    angle, reach = math.radians(item.angle), item.radius + item.reach * factor
    text = Text("DIMENSION", item.x + reach * math.cos(angle), item.y + reach * math.sin(angle), item.label)
    align: Align = "left" if math.cos(angle) >= 0 else "right"
    return around((_dot(item.x, item.y), _text_box(text._replace(align=align), factor)))
