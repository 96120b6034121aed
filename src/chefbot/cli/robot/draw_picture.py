"""A DXF document as a picture on white paper of its true size."""

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
    """Fills letters by the direction of their outlines, as fonts mean it; by nesting, as ezdxf does, the two
    holes of a diameter sign become one."""

    def draw_filled_paths(self, paths: Iterable[BkPath2d], properties: BackendProperties) -> None:
        """Letters and arrow heads."""
        outline = to_matplotlib_path(paths, detect_holes=False)
        self.ax.add_patch(PathPatch(outline, color=properties.color, linewidth=0, zorder=self._get_z()))


@contextmanager
def _same_chance() -> Iterator[None]:
    """ezdxf moves hatch lines a little, by Python's own generator: the same drawing is to give the same bytes."""
    before = random.getstate()
    random.seed(0)
    try:
        yield
    finally:
        random.setstate(before)


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
        lineweight_scaling=POINT_PER_MM,
    )
    backend = Backend(axes, adjust_figure=False)
    with _same_chance():
        Frontend(RenderContext(document), backend, config=settings).draw_layout(document.modelspace())
    axes.set_xlim(0.0, drawing.size[0])
    axes.set_ylim(0.0, drawing.size[1])
    file = io.BytesIO()
    metadata = {"CreationDate": None} if kind == "pdf" else None
    figure.savefig(file, format=kind, metadata=metadata)
    return file.getvalue()
