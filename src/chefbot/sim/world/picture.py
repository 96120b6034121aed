"""Plan view of a world as an image, for documentation."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from chefbot.maths.se2 import SE2
from chefbot.sim.world.shapes import BOX, SimulatedShape
from chefbot.sim.world.world import World

CUT_HEIGHT = 2.2  # m; objects entirely above it are omitted


def plan_picture(world: World, path: Path, places: bool = True, dpi: int = 120) -> None:
    """Write an image (format by suffix) of the world from above: solids, doors, routes and places."""
    from matplotlib.figure import Figure

    x0, y0, x1, y1 = world.bounds
    figure = Figure(figsize=((x1 - x0) * 0.8 + 0.5, (y1 - y0) * 0.8 + 0.5), layout="constrained")
    axes = figure.add_subplot(aspect="equal", facecolor="#f4efe4")
    axes.set(xlim=(x0 - 0.2, x1 + 0.2), ylim=(y0 - 0.2, y1 + 0.2), xlabel="x [m]", ylabel="y [m]")
    for shape in sorted(world.shapes_at_rest(), key=lambda s: s.top):
        if shape.bottom < CUT_HEIGHT:
            axes.add_patch(_patch(shape))
    for route in world.routes:
        axes.plot(*zip(*route.points, strict=True), ":", color="#3b7dd8", lw=1.2)
    if places:
        for name, place in world.places.items():
            _draw_place(axes, name, place)
    figure.savefig(path, dpi=dpi)


def _patch(shape: SimulatedShape) -> Any:
    from matplotlib.patches import Circle, Rectangle

    style: dict[str, Any] = {
        "facecolor": [c / 255 for c in shape.colour],
        "edgecolor": "#40352b",
        "linewidth": 0.5,
    }
    if shape.kind != BOX:
        return Circle((shape.x, shape.y), shape.half[0], **style)
    corner = SE2(shape.x, shape.y, shape.yaw) @ SE2(-shape.half[0], -shape.half[1], 0.0)
    size = 2 * shape.half[0], 2 * shape.half[1]
    return Rectangle((corner.x, corner.y), *size, angle=math.degrees(shape.yaw), **style)


def _draw_place(axes: Any, name: str, place: SE2) -> None:
    tip = place @ SE2(0.3, 0.0, 0.0)
    axes.plot([place.x, tip.x], [place.y, tip.y], "-", color="#c8102e", lw=1.5)
    axes.plot(place.x, place.y, "o", color="#c8102e", ms=5)
    axes.annotate(name, (place.x, place.y), (4, 4), textcoords="offset points", fontsize=8, color="#7a0a1c")
