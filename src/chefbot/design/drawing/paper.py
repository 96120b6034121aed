"""The sheet: paper and scale that fit a plan, frame and title block (ISO 216, 5455, 5457, 7200)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from chefbot.design.drawing.drawing import (
    BoundingBox,
    Circle,
    Item,
    Line,
    Plan,
    Text,
    Title,
    around,
    item_box,
    moved,
    rectangle,
    scaled,
    segment,
)
from chefbot.maths.outline import Corner

A4, A3 = (297.0, 210.0), (420.0, 297.0)
BINDING, MARGIN = 20.0, 10.0
"""Margins left of the frame and on the other sides, mm on paper."""
BLOCK = (180.0, 32.0)
"""Size of the title block, mm on paper."""
ROWS, COLUMNS = (10.0, 20.0), (45.0, 90.0, 135.0)
"""Heights of the lines between rows, and places of those between columns, mm from the corner of the title block."""
AIR = 5.0
"""Distance between frame and drawing, mm on paper."""
NAMES = {A4: "A4", A3: "A3"}


class Scale(NamedTuple):
    """The scale as written, and the millimetres of the part for one millimetre on paper."""

    text: str
    factor: float


CHOICES = tuple(
    (paper, Scale(f"{a}:{b}", b / a))
    for paper, a, b in (
        *((A4, 2, 1), (A4, 1, 1), (A3, 1, 1), (A4, 1, 2), (A3, 1, 2)),
        *((A4, 1, 5), (A3, 1, 5), (A3, 1, 10), (A3, 1, 20)),
    )
)
"""Scales of ISO 5455, the largest first."""


class Drawing(NamedTuple):
    """A complete sheet in millimetres of the part; the origin is the paper's lower left corner."""

    name: str
    title: Title
    items: tuple[Item, ...]
    paper: tuple[float, float]
    scale: Scale

    @property
    def size(self) -> tuple[float, float]:
        """Return the size of the paper in millimetres of the drawing."""
        return self.paper[0] * self.scale.factor, self.paper[1] * self.scale.factor


def compose(name: str, plan: Callable[[float], Plan]) -> Drawing:
    """Return the sheet with frame and title block at the largest scale that fits, else at the last scale."""
    for paper, scale in CHOICES:
        drawn = plan(scale.factor)
        box = around(item_box(item, scale.factor) for item in drawn.items)
        room = _room(paper, scale.factor)
        if box.width <= room.width and box.height <= room.height:
            break
    (x, y), (bx, by) = room.middle, box.middle
    items = tuple(moved(item, x - bx, y - by) for item in drawn.items)
    return Drawing(name, drawn.title, items + _frame(drawn.title, paper, scale), paper, scale)


def _room(paper: tuple[float, float], factor: float) -> BoundingBox:
    """The area of the drawing: inside the frame, above the title block."""
    left, low = BINDING + AIR, MARGIN + BLOCK[1] + AIR
    right, high = paper[0] - MARGIN - AIR, paper[1] - MARGIN - AIR
    return BoundingBox(left * factor, low * factor, right * factor, high * factor)


def _frame(title: Title, paper: tuple[float, float], scale: Scale) -> tuple[Item, ...]:
    """The frame at paper size, scaled to the sheet."""
    width, height = paper
    items: list[Item] = [rectangle("TITLE", BoundingBox(BINDING, MARGIN, width - MARGIN, height - MARGIN))]
    items += [moved(item, width - MARGIN - BLOCK[0], MARGIN) for item in _block(title, paper, scale)]
    return tuple(_grown(item, scale.factor) for item in items)


def _block(title: Title, paper: tuple[float, float], scale: Scale) -> list[Item]:
    """Four columns in two rows, and the name of part and robot above."""
    width, height = BLOCK
    items: list[Item] = [rectangle("TITLE", BoundingBox(0.0, 0.0, width, height))]
    items += [segment("TITLE", (0.0, y), (width, y)) for y in ROWS]
    items += [segment("TITLE", (x, 0.0), (x, ROWS[-1])) for x in COLUMNS]
    items.append(segment("TITLE", (COLUMNS[-1], ROWS[-1]), (COLUMNS[-1], height)))
    items += _field(0.0, ROWS[-1] + 1.8, "Part", title.part, 5.0)
    items += _field(COLUMNS[-1], ROWS[-1] + 1.8, "Robot", title.robot, 3.5)
    for (x, y), (label, value) in _fields(title, paper, scale).items():
        items += _field(x, y, label, value, 3.5 if len(value) < 14 else 2.5)
    return items + _projection_symbol(width - 8.0, 4.0)


def _fields(
    title: Title, paper: tuple[float, float], scale: Scale
) -> dict[tuple[float, float], tuple[str, str]]:
    """Return label and value of each field by its lower left corner."""
    return {
        (0.0, ROWS[0]): ("Material", title.material),
        (COLUMNS[0], ROWS[0]): ("Size", title.size),
        (COLUMNS[1], ROWS[0]): ("Pieces", str(title.pieces)),
        (COLUMNS[2], ROWS[0]): ("Mass of one", mass_text(title.mass)),
        (0.0, 0.0): ("Scale", scale.text),
        (COLUMNS[0], 0.0): ("Sheet", NAMES[paper]),
        (COLUMNS[1], 0.0): ("Dimensions", "mm"),
        (COLUMNS[2], 0.0): ("Projection", "first angle"),
    }


def mass_text(mass: float) -> str:
    """Return a mass with three digits, in grams below a kilogram."""
    return f"{mass:.3g} kg" if mass >= 1.0 else f"{mass * 1000:.3g} g"


def _field(x: float, y: float, label: str, value: str, height: float) -> list[Item]:
    return [
        Text("TITLE", x + 1.5, y + 8.2, label, 1.8),
        Text("TITLE", x + 1.5, y + 3.5, value, height),
    ]


def _projection_symbol(x: float, y: float) -> list[Item]:
    """A cone's frustum and its left view, right of it: first angle (ISO 5456-2)."""
    corners = ((-8.0, -1.0), (-3.0, -2.0), (-3.0, 2.0), (-8.0, 1.0))
    cone = tuple(Corner(x + dx, y + dy) for dx, dy in corners)
    return [Line("TITLE", cone), Circle("TITLE", x + 1.5, y, 2.0), Circle("TITLE", x + 1.5, y, 1.0)]


def _grown(item: Item, factor: float) -> Item:
    """A paper item in the drawing's millimetres; letters keep their height on paper."""
    match item:
        case Line():
            return item._replace(corners=scaled(item.corners, factor))
        case Circle():
            return item._replace(x=item.x * factor, y=item.y * factor, radius=item.radius * factor)
        case Text():
            return item._replace(x=item.x * factor, y=item.y * factor)
        case _:
            raise TypeError(f"no frame has a {type(item).__name__}")
