"""A Drawing as DXF R2010: layers, true arcs and circles, real dimensions; the same drawing gives the same bytes.

Importing this module imports ezdxf, so that only the verb and its tests do it.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import ezdxf
import matplotlib
from ezdxf.document import Drawing as Document
from ezdxf.enums import TextEntityAlignment
from ezdxf.fonts import fonts
from ezdxf.layouts import Modelspace

from chefbot.design.drawing.drawing import TEXT, Circle, Hatch, Item, Line, Linear, Radial, Text
from chefbot.design.drawing.paper import Drawing

STYLE, FONT = "CHEFBOT", "DejaVuSans.ttf"
DIMENSIONS = "CHEFBOT"
MILLIMETRES, METRIC = 4, 1


class LayerStyle(NamedTuple):
    """AutoCAD colour index (readable on white and on black), line type, line width in hundredths of a millimetre."""

    colour: int
    linetype: str
    width: int


LAYERS = {
    "OUTLINE": LayerStyle(7, "CONTINUOUS", 50),
    "HOLES": LayerStyle(150, "CONTINUOUS", 35),
    "CENTRE": LayerStyle(12, "CENTER", 18),
    "DIMENSION": LayerStyle(94, "CONTINUOUS", 18),
    "REFERENCE": LayerStyle(8, "DIVIDE", 25),
    "TITLE": LayerStyle(7, "CONTINUOUS", 35),
}
LINETYPES = {
    "CENTER": ("Centre line", [12.0, 8.0, -1.5, 1.0, -1.5]),
    "DASHED": ("Hidden line", [4.0, 3.0, -1.0]),
    "DIVIDE": ("Neighbouring part", [9.0, 5.0, -1.0, 0.5, -1.0, 0.5, -1.0]),
}
"""Line types with LibreCAD's names; lengths on paper, mm (ISO 128-2)."""
ALIGNMENT = {
    "left": TextEntityAlignment.MIDDLE_LEFT,
    "middle": TextEntityAlignment.MIDDLE_CENTER,
    "right": TextEntityAlignment.MIDDLE_RIGHT,
}


def dxf_document(drawing: Drawing) -> Document:
    """Return the drawing as an ezdxf document."""
    _use_one_font()
    with _fixed_meta_data():
        document = ezdxf.new("R2010", units=MILLIMETRES)
    document.header["$MEASUREMENT"] = METRIC
    document.header["$LWDISPLAY"] = 1
    factor = drawing.scale.factor
    _set_up(document, factor)
    space = document.modelspace()
    for item in drawing.items:
        _add(space, item, factor)
    _set_paper(document, drawing)
    width, height = drawing.size
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (0.0, 0.0, 0.0), (width, height, 0.0)
    document.set_modelspace_vport(height * 1.05, (width / 2, height / 2))
    return document


def dxf_bytes(document: Document) -> bytes:
    """Return the contents of a DXF file; they depend on the drawing only, not on date or random identifiers."""
    for name in sorted(document.entitydb.dxf_types_in_use()):  # ezdxf would take them in a set's order
        document.classes.add_class(name)
    text = io.StringIO()
    with _fixed_meta_data():
        document.write(text)
    return text.getvalue().encode("utf-8")


@contextmanager
def _fixed_meta_data() -> Iterator[None]:
    """ezdxf writes the date and a random identifier unless this global option is set."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def _use_one_font() -> None:
    """Texts are measured with matplotlib's font on every computer."""
    if not fonts.font_manager.has_font(FONT):
        fonts.font_manager.build(
            [str(Path(matplotlib.get_data_path()) / "fonts" / "ttf")], support_dirs=False
        )


def _set_up(document: Document, factor: float) -> None:
    document.styles.add(STYLE, font=FONT)
    for name, (description, pattern) in LINETYPES.items():
        document.linetypes.add(name, [factor * length for length in pattern], description=description)
    for name, look in LAYERS.items():
        document.layers.add(name, color=look.colour, linetype=look.linetype, lineweight=look.width)
    style = document.dimstyles.add(DIMENSIONS)
    for key, value in _dimension_style(factor).items():
        style.dxf.set(key, value)


def _dimension_style(factor: float) -> dict[str, Any]:
    """ISO 129-1: text above the line, filled arrows, millimetres without trailing zeros."""
    return {
        "dimtxsty": STYLE,
        "dimtxt": TEXT * factor,
        "dimasz": TEXT * factor,
        "dimexo": 0.8 * factor,
        "dimexe": 1.5 * factor,
        "dimgap": 0.8 * factor,
        "dimscale": 1.0,
        "dimlfac": 1.0,
        "dimtad": 1,
        "dimdec": 2,
        "dimzin": 8,
        "dimdsep": ord("."),
        "dimlunit": 2,
        "dimtih": 0,
        "dimtoh": 0,
        "dimtix": 0,
        "dimtmove": 1,
        "dimatfit": 3,
        "dimclrd": LAYERS["DIMENSION"].colour,
        "dimclre": LAYERS["DIMENSION"].colour,
        "dimclrt": LAYERS["DIMENSION"].colour,
    }


def _set_paper(document: Document, drawing: Drawing) -> None:
    """LibreCAD takes the look of dimensions, paper and scale of a print from the header, not from the style."""
    for key, value in _dimension_style(drawing.scale.factor).items():
        document.header[f"${key.upper()}"] = value
    document.layout("Layout1").dxf.limmax = drawing.paper  # which ezdxf writes as $PLIMMAX
    document.header["$PSVPSCALE"] = 1.0 / drawing.scale.factor


def _add(space: Modelspace, item: Item, factor: float) -> None:
    match item:
        case Line():
            corners = [(c.x, c.y, c.bulge) for c in item.corners]
            space.add_lwpolyline(corners, "xyb", close=item.closed, dxfattribs=_attributes(item))
        case Circle():
            space.add_circle((item.x, item.y), item.radius, dxfattribs=_attributes(item))
        case Text():
            attributes = {"layer": item.layer, "style": STYLE}
            text = space.add_text(item.text, height=item.height * factor, dxfattribs=attributes)
            text.set_placement((item.x, item.y), align=ALIGNMENT[item.align])
        case Hatch():
            _add_hatch(space, item, factor)
        case Linear():
            _add_linear(space, item, factor)
        case Radial():
            _add_radial(space, item, factor)


def _attributes(item: Line | Circle) -> dict[str, Any]:
    return {"layer": item.layer, **({"linetype": "DASHED"} if item.hidden else {})}


def _add_hatch(space: Modelspace, item: Hatch, factor: float) -> None:
    hatch = space.add_hatch(dxfattribs={"layer": "DIMENSION", "color": 256})
    hatch.set_pattern_fill("ANSI31", color=256, scale=0.6 * factor)
    for loop in item.loops:
        hatch.paths.add_polyline_path([(c.x, c.y, c.bulge) for c in loop], is_closed=True)


def _add_linear(space: Modelspace, item: Linear, factor: float) -> None:
    along_x, shift, above = item.along == "x", item.text_shift(factor), (TEXT / 2 + 0.8) * factor
    (ax, ay), (bx, by) = item.a, item.b
    spot = ((ax + bx) / 2 + shift, item.at + above) if along_x else (item.at - above, (ay + by) / 2 + shift)
    space.add_linear_dim(
        base=(item.a[0], item.at) if along_x else (item.at, item.a[1]),
        p1=item.a,
        p2=item.b,
        angle=0 if along_x else 90,
        location=spot if shift else None,
        text=item.text,
        dimstyle=DIMENSIONS,
        override={"dimtmove": 2},
        dxfattribs={"layer": "DIMENSION"},
    ).render()


def _add_radial(space: Modelspace, item: Radial, factor: float) -> None:
    angle, reach = math.radians(item.angle), item.radius + item.reach * factor
    add = space.add_radius_dim if item.kind == "radius" else space.add_diameter_dim
    add(
        center=(item.x, item.y),
        radius=item.radius,
        angle=item.angle,
        location=(item.x + reach * math.cos(angle), item.y + reach * math.sin(angle)),
        text=item.label,
        dimstyle=DIMENSIONS,
        override={"dimtoh": 1},
        dxfattribs={"layer": "DIMENSION"},
    ).render()
