"""The places of causes on the map: where the robot was, and the obstacle that it names."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from chefbot.causes.history import CauseSpan
from chefbot.cli.why.run_log import RunCauses
from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.storage.atomic_files import make_folder, write_atomic

SIZE = 10.0
"""Longer side of the picture, inches."""
COLOURS = {"slow": "#e0a800", "stop": "#d62728", "detour": "#1f77b4", "failure": "#6a0dad"}
MARGIN = 1.0
"""Margin around what is drawn, m."""
UNKNOWN_SHADE = 0.85


def write_picture(out: Path, run: RunCauses, spans: list[CauseSpan]) -> None:
    """Write the places of causes as PNG. Raises UserError for another extension, and if no cause has a place."""
    if out.suffix != ".png":
        raise UserError(f"--picture {out}: the picture is a PNG; give a name that ends in .png")
    placed = [span for span in spans if span.cause.header.frame_id == "map"]
    if not placed:
        raise UserError(f"log {run.path} has no causes with a place on a map: there is nothing to draw")
    buffer = io.BytesIO()
    _figure(run, placed).savefig(buffer, format="png", dpi=110)
    make_folder(out.parent)
    write_atomic(out, buffer.getvalue())


def _figure(run: RunCauses, placed: list[CauseSpan]) -> Any:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(SIZE, SIZE * 0.75), layout="constrained")
    axes = figure.subplots()
    if run.grid is not None:
        _draw_map(axes, run.grid)
    for span in placed:
        _draw(axes, span)
    _frame(axes, run.grid, placed)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    for kind, colour in COLOURS.items():
        axes.plot([], [], "o", color=colour, label=kind)
    axes.plot([], [], "kx", label="obstacle named")
    axes.legend(loc="upper right", fontsize=8)
    return figure


def _draw(axes: Any, span: CauseSpan) -> None:
    cause, colour = span.cause, COLOURS.get(span.cause.kind, "black")
    x, y = cause.robot.position.x, cause.robot.position.y
    axes.plot(x, y, "o", color=colour, markersize=6)
    axes.annotate(str(cause.id), (x, y), textcoords="offset points", xytext=(5, 4), fontsize=8, color=colour)
    if cause.located:
        axes.plot([x, cause.point.x], [y, cause.point.y], "-", color=colour, linewidth=0.8)
        axes.plot(cause.point.x, cause.point.y, "x", color="black", markersize=6)


def _draw_map(axes: Any, grid: Grid) -> None:
    """Draw a grid: dark is occupied, white free, grey unknown."""
    shade = np.where(grid.cells < 0, UNKNOWN_SHADE, 1.0 - 0.8 * grid.cells / 100.0)
    right = grid.origin_x + grid.width * grid.resolution
    top = grid.origin_y + grid.height * grid.resolution
    extent = (grid.origin_x, right, grid.origin_y, top)
    axes.imshow(shade, origin="lower", extent=extent, cmap="gray", vmin=0.0, vmax=1.0)


def _frame(axes: Any, grid: Grid | None, spans: list[CauseSpan]) -> None:
    """Limit the picture to the known part of the map, or to the places if there is no map."""
    points = [(s.cause.robot.position.x, s.cause.robot.position.y) for s in spans]
    points += [(s.cause.point.x, s.cause.point.y) for s in spans if s.cause.located]
    if grid is not None and (grid.cells >= 0).any():
        rows, columns = np.nonzero(grid.cells >= 0)
        for row, column in ((rows.min(), columns.min()), (rows.max() + 1, columns.max() + 1)):
            points.append((grid.origin_x + column * grid.resolution, grid.origin_y + row * grid.resolution))
    low, high = np.min(points, axis=0) - MARGIN, np.max(points, axis=0) + MARGIN
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
