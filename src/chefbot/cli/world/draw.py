"""`chefbot world draw`: a world from above."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from chefbot.cli.launch_arguments import hints_at_options, with_options
from chefbot.errors import UserError
from chefbot.plural import number_of
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.sim.world.load import load_any_world, unknown_cells, with_drawn_places
from chefbot.sim.world.map_world import WALL_COLOUR
from chefbot.sim.world.shapes import BOX, GLASS, MIRROR, SimulatedShape
from chefbot.sim.world.world import World
from chefbot.storage.atomic_files import make_folder, write_atomic

SIZE = 12.0
"""Longer side of the picture, inches."""
FLOOR, CARPET, HOLE = "#f7f4ee", "#e3c9c0", "#3a2f2f"
LOOKS: Mapping[int, dict[str, Any]] = {
    GLASS: {"facecolor": "#7fc4e8", "edgecolor": "#2f86b8"},
    MIRROR: {"facecolor": "#d05fd0", "edgecolor": "#803080"},
}
"""Colours of what is not solid."""
WALL_SHADE = 0.6
"""Darkening of a map's walls, which have no outline."""
console = Console(highlight=False)


def draw_world(
    name: str, robot_name: str, out: Path, start: str = "", unknown: str = "auto", seed: int | None = None
) -> None:
    """Write the picture of a world as PNG. Raises UserError for another extension.

    start: start pose as text. unknown: what unknown cells of a map are. seed: draws places where there are none.
    """
    if out.suffix != ".png":
        raise UserError(f"--out {out}: the picture is a PNG; give a name that ends in .png")
    robot = load_robot(robot_name)
    world = _load_world(name, robot, start, unknown, seed)
    make_folder(out.parent)
    write_atomic(out, picture(world, robot))
    solids, places = number_of(len(world.static), "solid"), number_of(len(world.places), "place")
    console.print(f"{world.name}: {solids}, {places}; picture in {out}")
    if world.start_note:
        x, y, yaw = world.start
        console.print(f"start [{x:.2f}, {y:.2f}, {yaw:.2f}], {with_options(world.start_note)}", markup=False)


def _load_world(name: str, robot: Robot, start: str, unknown: str, seed: int | None) -> World:
    with hints_at_options():
        world = load_any_world(name, robot, start, unknown_cells(unknown))
    return world if seed is None else with_drawn_places(world, robot, seed)


def picture(world: World, robot: Robot) -> bytes:
    """Return the world from above as PNG; what the robot passes under is drawn pale."""
    figure, axes = _empty_picture(world)
    _draw_floor(axes, world)
    clearance = overall_height(robot)
    if world.floor is not None:
        _draw_walls(axes, world)
    else:
        for shape in sorted(world.shapes_at_rest(), key=lambda s: s.top):
            if shape.name != "ceiling":
                _draw_shape(axes, shape, passable=shape.bottom >= clearance)
    _draw_places(axes, world, robot)
    _add_legend(axes, world)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _empty_picture(world: World) -> tuple[Any, Any]:
    """Return a figure with the proportions of the world, and its axes."""
    from matplotlib.figure import Figure

    x0, y0, x1, y1 = world.bounds
    scale = SIZE / max(x1 - x0, y1 - y0)
    figure = Figure(figsize=((x1 - x0) * scale + 1.0, (y1 - y0) * scale + 1.0), dpi=100, layout="constrained")
    axes = figure.add_subplot(
        facecolor=FLOOR, aspect="equal", xlim=(x0 - 0.5, x1 + 0.5), ylim=(y0 - 0.5, y1 + 0.5)
    )
    axes.set_title(f"{world.name}; {world.start_note}" if world.start_note else world.name)
    axes.ticklabel_format(useOffset=False)
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    return figure, axes


def _draw_walls(axes: Any, world: World) -> None:
    """Draw the walls of a map as one collection, since there may be 100 000 of them."""
    from matplotlib.collections import PolyCollection

    walls = [shape for shape in world.static if shape.name != "ceiling"]
    centres = np.array([(wall.x, wall.y) for wall in walls])[:, None]
    halves = np.array([wall.half[:2] for wall in walls])[:, None]
    corners = centres + halves * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    colour = np.array(WALL_COLOUR) / 255 * WALL_SHADE
    axes.add_collection(PolyCollection(list(corners), facecolor=colour, edgecolor="none", antialiased=False))


def _draw_floor(axes: Any, world: World) -> None:
    from matplotlib.patches import Rectangle

    for carpet in world.carpets:
        corner = -carpet.size[0] / 2, -carpet.size[1] / 2
        patch = Rectangle(corner, carpet.size[0], carpet.size[1], facecolor=CARPET)
        axes.add_patch(_moved(patch, axes, carpet.x, carpet.y, carpet.yaw))
    for hole in world.holes:
        corner = hole.x - hole.size[0] / 2, hole.y - hole.size[1] / 2
        axes.add_patch(
            Rectangle(corner, hole.size[0], hole.size[1], facecolor=HOLE, hatch="xx", edgecolor="white")
        )


def _draw_shape(axes: Any, shape: SimulatedShape, *, passable: bool) -> None:
    from matplotlib.patches import Circle, Rectangle

    colour = tuple(channel / 255 for channel in shape.colour)
    look: dict[str, Any] = {
        "facecolor": colour,
        "edgecolor": "#00000060",
        "linewidth": 0.4,
        **LOOKS.get(shape.material, {}),
    }
    look["alpha"] = 0.25 if passable else 1.0
    if shape.kind == BOX:
        patch = Rectangle((-shape.half[0], -shape.half[1]), 2 * shape.half[0], 2 * shape.half[1], **look)
        axes.add_patch(_moved(patch, axes, shape.x, shape.y, shape.yaw))
    else:
        axes.add_patch(Circle((shape.x, shape.y), shape.half[0], **look))


def _moved(patch: Any, axes: Any, x: float, y: float, yaw: float) -> Any:
    from matplotlib.transforms import Affine2D

    patch.set_transform(Affine2D().rotate(yaw).translate(x, y) + axes.transData)
    return patch


def _draw_places(axes: Any, world: World, robot: Robot) -> None:
    """Draw each place as the robot's outline with its heading and its name."""
    from matplotlib.patches import Circle

    for name, pose in world.places.items():
        radius = robot.circumscribed_radius
        axes.add_patch(Circle((pose.x, pose.y), radius, facecolor="none", edgecolor="#c02020", linewidth=1.2))
        ahead = pose.x + radius * math.cos(pose.yaw), pose.y + radius * math.sin(pose.yaw)
        axes.plot([pose.x, ahead[0]], [pose.y, ahead[1]], color="#c02020", linewidth=1.2)
        axes.annotate(name, (pose.x, pose.y), (4, 6), textcoords="offset points", color="#c02020", zorder=5)


def _add_legend(axes: Any, world: World) -> None:
    """Name the colours of what is not solid, as far as it occurs."""
    from matplotlib.patches import Patch

    materials = {shape.material for shape in world.static}
    entries = {
        name: LOOKS[number] for name, number in (("glass", GLASS), ("mirror", MIRROR)) if number in materials
    }
    entries |= {"carpet": {"facecolor": CARPET}} if world.carpets else {}
    entries |= {"hole": {"facecolor": HOLE}} if world.holes else {}
    if entries:
        axes.legend(handles=[Patch(label=name, **look) for name, look in entries.items()], loc="upper right")
