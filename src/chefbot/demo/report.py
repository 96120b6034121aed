"""HTML report of a demo with its plots."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chefbot.demo.score import Scorer, Track
from chefbot.demo.summary import DemoResult, ground_truth_map
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot
from chefbot.sim.world.world import World
from chefbot.storage.atomic_files import write_atomic

INK, PAPER, UNKNOWN_TINT = 0.12, 1.0, 0.8
"""Grey levels of occupied, free and unknown cells, from 0 (black) to 1 (white)."""


def write_report(out: Path, result: DemoResult, scorer: Scorer, world: World, robot: Robot) -> None:
    """Write `report.html`, and the map beside the ground-truth plan as `map_and_plan.png`."""
    plan = ground_truth_map(world, robot)
    pictures = {"Ground-truth map and map made by the robot": _maps(plan, scorer.saved_map, scorer.places)}
    for title, track in (("While mapping", scorer.mapping), ("While delivering", scorer.delivering)):
        if track.times:
            pictures[f"{title}: ground truth and estimate"] = _trajectory(plan, track)
            pictures[f"{title}: error over time"] = _errors(track)
    write_atomic(out / "map_and_plan.png", next(iter(pictures.values())))
    write_atomic(out / "report.html", _page(result, pictures).encode())


def _maps(plan: Grid, grid: Grid | None, places: Mapping[str, SE2]) -> bytes:
    figure, (left, right) = _figure(1, 2, 11.0, 4.8)
    _draw_grid(left, plan)
    left.set_title("true plan at the sensor's height")
    if grid is not None:
        _draw_grid(right, grid)
        right.set_xlim(left.get_xlim())
        right.set_ylim(left.get_ylim())
    right.set_title("mapped by the robot")
    for axes in (left, right):
        _draw_places(axes, places)
    return _png(figure)


def _draw_places(axes: Any, places: Mapping[str, SE2]) -> None:
    for name, place in places.items():
        axes.plot(place.x, place.y, "o", color="tab:blue", markersize=3.0)
        axes.annotate(
            name, (place.x, place.y), (3, 3), textcoords="offset points", color="tab:blue", fontsize=6
        )


def _trajectory(plan: Grid, track: Track) -> bytes:
    figure, axes = _figure(1, 1, 8.0, 6.0)
    _draw_grid(axes, plan)
    for poses, colour, label in (
        (track.truth, "tab:blue", "truth"),
        (track.estimate, "tab:orange", "estimate"),
    ):
        points = np.array([(pose.x, pose.y) for pose in poses])
        axes.plot(points[:, 0], points[:, 1], color=colour, linewidth=1.0, label=label)
    axes.legend(loc="upper right")
    return _png(figure)


def _errors(track: Track) -> bytes:
    figure, axes = _figure(1, 1, 8.0, 2.6)
    axes.plot(track.times, track.errors(), color="tab:red", linewidth=0.8)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("position error [m]")
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    return _png(figure)


def _figure(rows: int, columns: int, width: float, height: float) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns)


def _draw_grid(axes: Any, grid: Grid) -> None:
    """Draw a grid: dark is occupied, white free, grey unknown."""
    shade = np.where(grid.cells < 0, UNKNOWN_TINT, PAPER - (PAPER - INK) * grid.cells / 100.0)
    right = grid.origin_x + grid.width * grid.resolution
    top = grid.origin_y + grid.height * grid.resolution
    extent = (grid.origin_x, right, grid.origin_y, top)
    axes.imshow(
        shade, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", extent=extent, interpolation="nearest"
    )
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _png(figure: Any) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    buffer = io.BytesIO()
    FigureCanvasAgg(figure).print_png(buffer)
    return buffer.getvalue()


def _page(result: DemoResult, pictures: dict[str, bytes]) -> str:
    rows = "".join(f"<tr><th>{html.escape(k)}</th><td>{html.escape(v)}</td></tr>" for k, v in result.table())
    verdict = "Success" if result.success else f"Failed: {html.escape(result.failure)}"
    figures = "".join(
        f"<h2>{html.escape(title)}</h2><img alt='{html.escape(title)}' "
        f"src='data:image/png;base64,{base64.b64encode(png).decode()}'>"
        for title, png in pictures.items()
    )
    unexplored = "".join(f"<li>{html.escape(line)}</li>" for line in by_reason(result.left_unexplored))
    title = f"{html.escape(result.robot)} in {html.escape(result.world)}, seed {result.seed}"
    return (
        "<!doctype html><html lang='en'><meta charset='utf-8'>"
        f"<title>{title}</title><style>{_STYLE}</style><h1>{title}</h1><p class='verdict'>{verdict}</p>"
        f"<table>{rows}</table>{figures}<h2>Left unexplored, and why</h2><ul>{unexplored}</ul></html>\n"
    )


def by_reason(regions: Sequence[str]) -> list[str]:
    """Return one line for each reason with all its regions; a region is "(x, y) length: reason"."""
    places: dict[str, list[str]] = {}
    for region in regions:
        place, _, reason = region.partition(": ")
        places.setdefault(reason, []).append(place)
    return [f"{reason}: {'; '.join(found)}" for reason, found in places.items()]


_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}"
    "img{max-width:100%}th{text-align:left;padding-right:2rem;font-weight:600}.verdict{font-size:1.3rem}"
)
