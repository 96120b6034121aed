"""A DXF document as a picture on white paper of its true size."""

from __future__ import annotations

import io
from typing import Literal

from ezdxf.addons.drawing import Frontend, RenderContext
from ezdxf.addons.drawing.config import BackgroundPolicy, Configuration, LinePolicy
from ezdxf.addons.drawing.matplotlib import MatplotlibBackend
from ezdxf.document import Drawing as Document
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from chefbot.design.drawing_paper import Drawing

INCH = 25.4
DOTS_PER_INCH = 150


def picture(document: Document, drawing: Drawing, kind: Literal["png", "pdf"]) -> bytes:
    """PNG of 150 dots per inch, or PDF; printed on its paper the scale is true."""
    width, height = drawing.paper
    figure = Figure(figsize=(width / INCH, height / INCH), dpi=DOTS_PER_INCH)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    settings = Configuration(
        background_policy=BackgroundPolicy.WHITE,
        line_policy=LinePolicy.ACCURATE,
        max_flattening_distance=0.01 * drawing.scale.factor,
    )
    backend = MatplotlibBackend(axes, adjust_figure=False)
    Frontend(RenderContext(document), backend, config=settings).draw_layout(document.modelspace())
    axes.set_xlim(0.0, drawing.size[0])
    axes.set_ylim(0.0, drawing.size[1])
    file = io.BytesIO()
    metadata = {"CreationDate": None} if kind == "pdf" else None
    figure.savefig(file, format=kind, metadata=metadata)
    return file.getvalue()
