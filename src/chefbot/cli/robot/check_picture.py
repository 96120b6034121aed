"""Picture of the robot from above, one view for each plate, with overlaps in red."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from chefbot.design.checks.overlaps import overlapping
from chefbot.design.checks.part_bodies import PartBody, bodies
from chefbot.errors import UserError
from chefbot.robot.geometry import layout
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import make_folder, write_atomic

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

OVERLAP = (0.85, 0.1, 0.1, 0.9)
MILLI = 1e-3


def write_picture(robot: Robot, path: Path) -> None:
    """Write a PNG. Raises UserError for another extension or a folder that cannot be created."""
    if path.suffix != ".png":
        raise UserError(f"--out {path}: the picture is a PNG; give a name that ends in .png")
    make_folder(path.parent)
    write_atomic(path, picture(robot))


def picture(robot: Robot) -> bytes:
    """Return the picture as PNG, from the axle up: the parts between two plates share a view."""
    from matplotlib.figure import Figure

    floors = [0.0, *layout.plate_undersides(robot)]
    figure = Figure(figsize=(5.0 * len(floors), 5.4), dpi=100, layout="constrained")
    tops = [*floors[1:], float("inf")]
    shared = [(pair.one.surface ^ pair.other.surface) for pair in overlapping(robot)]
    for i, (low, high) in enumerate(zip(floors, tops, strict=True)):
        axes = figure.add_subplot(1, len(floors), i + 1)
        axes.set_title("below the base plate" if i == 0 else f"on plate {i}")
        _draw_between(axes, robot, shared, low, high)
        _frame(axes, robot)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _draw_between(axes: Any, robot: Robot, shared: list[Manifold], low: float, high: float) -> None:
    """Draw the bodies and the shared solids whose undersides are between two heights."""
    for body in sorted(bodies(robot), key=lambda body: float(body.high[2])):
        if low - 1e-9 <= body.low[2] < high - 1e-9:
            _fill(axes, body.surface.project(), body.part.colour)
            _label(axes, body)
    for solid in shared:
        if low - 1e-9 <= solid.bounding_box()[2] < high - 1e-9:
            _fill(axes, solid.project(), OVERLAP)


def _fill(axes: Any, section: CrossSection, colour: tuple[float, ...]) -> None:
    """Fill a section with its holes: all its loops form one path."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Line

    loops = [np.asarray(loop) / MILLI for loop in section.to_polygons()]
    if not loops:
        return
    lines = [Line(np.vstack([loop, loop[:1]]), closed=True) for loop in loops]
    axes.add_patch(PathPatch(Line.make_compound_path(*lines), facecolor=colour, edgecolor="0.25", lw=0.5))


def _label(axes: Any, body: PartBody) -> None:
    """Write the names of boxes and sensors; plates, poles and tubes need none."""
    if body.part.material in ("equipment", "sensor", "motor"):
        x, y = (body.low[:2] + body.high[:2]) / 2.0 / MILLI
        box = {"facecolor": "white", "alpha": 0.7, "lw": 0, "pad": 1}
        axes.text(x, y, body.name, ha="center", va="center", fontsize=7, bbox=box)


def _frame(axes: Any, robot: Robot) -> None:
    """Set equal axes in millimetres, x (forward) to the right."""
    reach = 1.1 * robot.circumscribed_radius / MILLI
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="x, mm", ylabel="y, mm")
