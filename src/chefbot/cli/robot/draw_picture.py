"""Rendering of a DXF document to PNG or PDF, true to scale on its paper."""

from __future__ import annotations

import io
import random
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Literal

from ezdxf.addons.drawing import Frontend, RenderContext
from ezdxf.addons.drawing.backend import BkPath2d
from ezdxf.addons.drawing.config import BackgroundPolicy, Configuration, LinePolicy
from ezdxf.addons.drawing.matplotlib import MatplotlibBackend
from ezdxf.addons.drawing.properties import BackendProperties
from ezdxf.document import Drawing as Document
from ezdxf.npshapes import to_matplotlib_path
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from chefbot.design.drawing.paper import Drawing

INCH = 25.4
DOTS_PER_INCH = 150
POINT_PER_MM = 72.0 / INCH
"""ezdxf gives line widths in millimetres, matplotlib takes points."""


class Backend(MatplotlibBackend):
    """Matplotlib backend that fills glyphs by the direction of their outlines, as fonts define it.

    ezdxf fills by nesting, which merges the two holes of a diameter sign.
    """

    def draw_filled_paths(self, paths: Iterable[BkPath2d], properties: BackendProperties) -> None:
        """Fill the outlines of letters and arrow heads."""
        outline = to_matplotlib_path(paths, detect_holes=False)
        self.ax.add_patch(PathPatch(outline, color=properties.color, linewidth=0, zorder=self._get_z()))


@contextmanager
def _fixed_random_seed() -> Iterator[None]:
    """Seed Python's random generator, by which ezdxf shifts hatch lines: equal drawings give equal bytes."""
    before = random.getstate()
    random.seed(0)
    try:
        yield
    finally:
        random.setstate(before)


def picture(document: Document, drawing: Drawing, kind: Literal["png", "pdf"]) -> bytes:
    """Return a PNG with 150 dots per inch, or a PDF; printed on its paper size it is true to scale."""
    width, height = drawing.paper
    figure = Figure(figsize=(width / INCH, height / INCH), dpi=DOTS_PER_INCH)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    backend, settings = Backend(axes, adjust_figure=False), _settings(drawing)
    with _fixed_random_seed():
        Frontend(RenderContext(document), backend, config=settings).draw_layout(document.modelspace())
    axes.set_xlim(0.0, drawing.size[0])
    axes.set_ylim(0.0, drawing.size[1])
    file = io.BytesIO()
    metadata = {"CreationDate": None} if kind == "pdf" else None
    figure.savefig(file, format=kind, metadata=metadata)
    return file.getvalue()


def _settings(drawing: Drawing) -> Configuration:
    return Configuration(
        background_policy=BackgroundPolicy.WHITE,
        line_policy=LinePolicy.ACCURATE,
        max_flattening_distance=0.01 * drawing.scale.factor,
        lineweight_scaling=POINT_PER_MM,
    )
