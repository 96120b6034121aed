"""Pictures of a SLAM run: map with trajectory and closures, odometry, residuals, time and memory."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.cli.map.error_rows import worst_regions
from chefbot.cli.map.slam_costs import SlamCosts
from chefbot.maths.grid import Grid
from chefbot.slam.map_error import REGION, MapErrorEstimate, centimetres
from chefbot.slam.offline import SlamResult

QUALITY_PICTURE = "quality.png"
"""Name of the picture of the estimated error, beside the map."""
WIDTH, DPI = 9.0, 110
"""Width of the pictures in inches, and dots per inch."""
MAX_CELLS = 2_000
"""Longer side of the map as it is drawn, cells; larger maps are reduced, and walls stay."""
UNKNOWN_SHADE, FREE_SHADE = 0.85, 1.0
ERROR_LIMITS = (0.0, 0.05, 0.1, 0.2, 0.4, 5.0)
ERROR_COLOURS = ("#2c7bb6", "#abd9e9", "#ffffbf", "#fdae61", "#d7191c")
"""Of errors between two limits, m: from blue to red, which those who confuse red and green distinguish."""
TRAJECTORY, CLOSURE, ODOMETRY = "#2a78b5", "#c8432b", "#999999"


def map_picture(result: SlamResult) -> bytes:
    """Draw the map (PNG) with the trajectory and a line for each closure."""
    figure, axes = _figure(_height(result.grid))
    _draw_map(axes, result.grid)
    path = np.array([(pose.x, pose.y) for pose in result.poses])
    axes.plot(*path.T, color=TRAJECTORY, linewidth=0.7, label="trajectory")
    for k, closure in enumerate(result.closures):
        ends = path[[closure.of, closure.to]]
        axes.plot(
            *ends.T, ".-", color=CLOSURE, linewidth=0.8, markersize=3, label=None if k else "loop closures"
        )
    axes.plot(*path[0], "k^", markersize=6, label="begin")
    axes.plot(*path[-1], "ks", markersize=5, label="end")
    axes.legend(loc="best", fontsize=8)
    return _png(figure)


def error_picture(result: SlamResult, estimate: MapErrorEstimate, title: str = "") -> bytes:
    """Draw the map (PNG) with the trajectory, the estimated error of each region and the places that are listed."""
    figure, axes = _figure(_height(result.grid))
    _draw_map(axes, result.grid)
    axes.plot(*np.array([(pose.x, pose.y) for pose in result.poses]).T, color=ODOMETRY, linewidth=0.7)
    axes.set_title(title, fontsize=9, wrap=True)
    for region in worst_regions(estimate.regions):
        axes.annotate(centimetres(region.error), region.centre, ha="center", va="center", fontsize=8)
    squares = _error_squares(estimate)
    axes.add_collection(squares)
    figure.colorbar(squares, ax=axes, label="estimated error [m]", shrink=0.8)
    return _png(figure)


def _error_squares(estimate: MapErrorEstimate) -> Any:
    """Return the regions as squares that are coloured by their errors."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import BoundaryNorm, ListedColormap

    corners = np.array([(region.x, region.y) for region in estimate.regions])
    outlines: Any = corners[:, None] + REGION * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    return PolyCollection(
        outlines,
        array=[region.error for region in estimate.regions],
        cmap=ListedColormap(ERROR_COLOURS),
        norm=BoundaryNorm(ERROR_LIMITS, len(ERROR_COLOURS)),
        alpha=0.5,
    )


def odometry_picture(result: SlamResult) -> bytes:
    """Draw the trajectory (PNG) beside that of odometry alone."""
    figure, axes = _figure(0.6 * WIDTH)
    start = result.poses[0]
    odometry = np.array([(p.x, p.y) for p in (start @ motion for motion in result.odometry)])
    axes.plot(*odometry.T, color=ODOMETRY, linewidth=0.7, label="odometry")
    axes.plot(*np.array([(p.x, p.y) for p in result.poses]).T, color=TRAJECTORY, linewidth=0.8, label="SLAM")
    axes.set_aspect("equal", adjustable="datalim")
    _label(axes, "x [m]", "y [m]")
    axes.legend(loc="best", fontsize=8)
    return _png(figure)


def residuals_picture(result: SlamResult) -> bytes:
    """Draw the residual of each closure at the final poses (PNG)."""
    figure, (linear, angular) = _figure(3.2, columns=2)
    scans = [max(closure.of, closure.to) for closure in result.closures]
    linear.plot(scans, [1e2 * closure.linear for closure in result.closures], ".", color=CLOSURE)
    angular.plot(scans, np.degrees([closure.angular for closure in result.closures]), ".", color=CLOSURE)
    for axes, unit in ((linear, "cm"), (angular, "degrees")):
        axes.set_ylim(bottom=0.0)
        _label(axes, "scan", f"residual [{unit}]")
    return _png(figure)


def costs_picture(costs: SlamCosts) -> bytes:
    """Draw (PNG) wall time and memory over the scans."""
    figure, (time, memory) = _figure(3.2, columns=2)
    time.plot(1e3 * np.array(costs.seconds), ".", color=TRAJECTORY, markersize=2)
    time.set_yscale("log")
    _label(time, "scan", "time of one scan [ms]")
    memory.plot(*np.array(costs.memory).reshape(-1, 2).T, color=TRAJECTORY)
    memory.set_ylim(bottom=0.0)
    _label(memory, "scan", "memory of the process [MB]")
    return _png(figure)


def _figure(height: float, columns: int = 1) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    return figure, figure.subplots(1, columns)


def _label(axes: Any, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(visible=True, linewidth=0.3)


def _height(grid: Grid) -> float:
    return float(np.clip(WIDTH * grid.height / grid.width, 0.4 * WIDTH, 1.5 * WIDTH))


def _draw_map(axes: Any, grid: Grid) -> None:
    step = -(-max(grid.width, grid.height) // MAX_CELLS)
    cells = reduced(grid.cells, step)
    size = step * grid.resolution
    right, top = grid.origin_x + cells.shape[1] * size, grid.origin_y + cells.shape[0] * size
    shade = np.where(cells < 0, UNKNOWN_SHADE, FREE_SHADE - cells / 100.0)
    extent = (grid.origin_x, right, grid.origin_y, top)
    axes.imshow(shade, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", extent=extent)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def reduced(cells: NDArray[np.int8], step: int) -> NDArray[np.int8]:
    """Return cells of `step` times the size, each with the highest occupancy of those in it; -1 is unknown."""
    if step == 1:
        return cells
    height, width = (-(-side // step) for side in cells.shape)
    padded = np.full((height * step, width * step), -1, np.int8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    highest: NDArray[np.int8] = padded.reshape(height, step, width, step).max(axis=(1, 3))
    return highest


def _png(figure: Any) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()
