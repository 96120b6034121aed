"""Pictures of a proof: distributions of figures, and the path of a run."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from chefbot.proving.figures import FIGURES
from chefbot.proving.record import RunRecord

SUCCESS, FAILURE = "#2a78b5", "#c8432b"
MAX_HISTOGRAMS = 6
PREFERRED = (
    "time",
    "goals_reached",
    "min_clearance",
    "localization_error_max",
    "map_error_max",
    "explored",
    "relation_error",
    "odometry_drift",
)
"""Figures that are drawn, in this order, if they vary."""


def distributions(records: Sequence[RunRecord]) -> bytes | None:
    """Return histograms (SVG) of the figures of a scenario's runs, failed ones in red; None if nothing varies."""
    from matplotlib.figure import Figure

    varying = [
        name for name in PREFERRED if len({record.figures.get(name) for record in records} - {None}) > 1
    ]
    names = varying[:MAX_HISTOGRAMS]
    if not names:
        return None
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(3.2 * columns, 2.0 * rows), layout="constrained")
    cells = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes in cells[len(names) :]:
        axes.set_axis_off()
    for axes, name in zip(cells, names, strict=False):
        groups = [
            [
                record.figures[name]
                for record in records
                if record.success == success and name in record.figures
            ]
            for success in (True, False)
        ]
        bins = np.histogram_bin_edges([value for group in groups for value in group], bins=16)
        axes.hist(groups, bins=bins, stacked=True, color=[SUCCESS, FAILURE])
        unit = FIGURES[name].unit
        axes.set_xlabel(f"{name.replace('_', ' ')}{f', {unit}' if unit else ''}", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.locator_params(axis="x", nbins=5)
        axes.locator_params(axis="y", integer=True)
    return svg(figure)


def path_picture(record: RunRecord) -> bytes | None:
    """Return the path of a run (SVG) with its incidents; None if it did not drive."""
    from matplotlib.figure import Figure
    from PIL import Image

    if len(record.path) < 2:
        return None
    path = np.array(record.path)
    figure = Figure(figsize=(4.0, 3.4), layout="constrained")
    axes = figure.add_subplot(aspect="equal")
    if record.plan:
        with Image.open(io.BytesIO(record.plan)) as plan:
            axes.imshow(np.asarray(plan), cmap="gray", vmin=0, vmax=255, extent=record.plan_extent)
    axes.plot(path[:, 1], path[:, 2], color=SUCCESS, linewidth=0.9)
    axes.plot(*path[0, 1:], "o", color=SUCCESS, markersize=4)
    axes.plot(*path[-1, 1:], "s", color="black", markersize=4)
    for _, x, y, what in record.incidents:
        axes.plot(x, y, "x" if what.startswith("collision") else ".", color=FAILURE, markersize=6)
    axes.tick_params(labelsize=7)
    return svg(figure)


def svg(figure: Any) -> bytes:
    """Return a figure as SVG, the same bytes each time."""
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "chefbot", "svg.fonttype": "none"}):
        buffer = io.BytesIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue()
    return text[text.index(b"<svg") :]
