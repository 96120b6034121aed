"""What the pictures are drawn from and with: runs of the demo, and grids, costs and robots on axes."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from chefbot.control.dwa_kernel import roll_out
from chefbot.control.people_cost import NOBODY
from chefbot.localization.amcl import Amcl
from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.recorded_log import RecordedLog, read_log

GIVEN = Path(sys.argv[1]) if len(sys.argv) > 1 else None
"""The folder named on the command line, for runs and pictures; without one the repository's own pictures are made."""
PICTURES = GIVEN or Path(__file__).parent / "pictures"
RUNS = GIVEN or Path("runs/pictures")
SEED = 1
BLUE, ORANGE, GREEN, RED, GREY = "#1f6feb", "#e8710a", "#1a7f37", "#cf222e", "0.82"
LARGEST = 150_000
M = TypeVar("M")


# -- runs


@cache
def run(robot: str) -> Path:
    """The folder of a demo in the hotel with this robot."""
    folder = RUNS / robot
    if not (folder / "summary.json").exists():
        command = [sys.executable, "-m", "chefbot", "demo", "--headless", "--seed", str(SEED)]
        subprocess.run([*command, "--robot", robot, "--out", str(folder)], check=True)
    return folder


@cache
def log_of(robot: str) -> RecordedLog:
    """The log of that demo."""
    return read_log(run(robot) / "run.mcap")


def said(robot: str, topic: str, kind: type[M]) -> list[tuple[float, M]]:
    """(seconds, message) of everything on a topic."""
    decode: Callable[[bytes], M] = kind.from_cdr  # type: ignore[attr-defined]
    return [(m.time_ns / 1e9, decode(m.data)) for m in log_of(robot).messages if m.topic == topic]


def truth(robot: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (n,) and true poses (n, 3) in the map frame."""
    odometry = said(robot, "ground_truth", Odometry)
    return np.array([t for t, _ in odometry]), np.array([m.pose.pose.se2 for _, m in odometry])


def second_launch(robot: str) -> float:
    """When everything was forgotten, s."""
    launches = [m.time_ns / 1e9 for m in log_of(robot).messages if m.topic == "chefbot/launch"]
    return launches[1]


def scans_with_odometry(robot: str, begin: float, end: float) -> list[tuple[float, LaserScan, SE2]]:
    """Scans between two times with the odometry nearest to each."""
    odometry = [(m.header.stamp.ns / 1e9, m.pose.pose.se2) for _, m in said(robot, "odom", Odometry)]
    times = np.array([t for t, _ in odometry])
    found = []
    for _, scan in said(robot, "scan", LaserScan):
        stamp = scan.header.stamp.ns / 1e9
        if begin <= stamp < end:
            found.append((stamp, scan, odometry[int(np.argmin(np.abs(times - stamp)))][1]))
    return found


# -- drawing


def canvas(columns: int, width: float, height: float, rows: int = 1) -> tuple[Figure, Any]:
    """An empty figure and its axes."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns)


def write(figure: Figure, name: str, dpi: int = 100) -> None:
    """As PNG; a size above 150 kB is a fault."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    path = PICTURES / f"{name}.png"
    figure.set_dpi(dpi)
    FigureCanvasAgg(figure).print_png(path)
    size = path.stat().st_size
    sys.stdout.write(f"{path}: {size / 1000:.0f} kB\n")
    assert size < LARGEST, f"{path} is too large"


def copied(picture: Path) -> None:
    """A picture that a command has drawn."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    (PICTURES / picture.name).write_bytes(picture.read_bytes())
    sys.stdout.write(f"{PICTURES / picture.name}\n")


def draw_grid(axes: Any, grid: Grid, title: str = "") -> None:
    """Dark is occupied, white free, grey unknown; metres."""
    shade = np.where(grid.cells < 0, 0.82, 1.0 - 0.88 * grid.cells / 100.0)
    axes.imshow(
        shade, cmap="gray", vmin=0, vmax=1, origin="lower", extent=extent(grid), interpolation="nearest"
    )
    axes.set_facecolor(GREY)
    bare(axes, title)


def bare(axes: Any, title: str) -> None:
    """A title instead of numbers."""
    axes.set_title(title, fontsize=10)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])


def draw_costs(axes: Any, costs: Costmap, title: str = "") -> None:
    """The dearer the redder; black cannot be driven on, grey is unknown."""
    colours = np.ones((*costs.cells.shape, 3))
    share = costs.cells / 252.0
    near = (costs.cells > 0) & (costs.cells < INSCRIBED)
    colours[near] = np.stack([np.ones_like(share), 1 - 0.75 * share, 1 - 0.9 * share], axis=-1)[near]
    colours[costs.cells == INSCRIBED] = (0.55, 0.1, 0.1)
    colours[costs.cells == 254] = (0.1, 0.1, 0.1)
    colours[costs.cells == 255] = (0.82, 0.82, 0.82)
    axes.imshow(colours, origin="lower", extent=extent(costs), interpolation="nearest")
    bare(axes, title)


def extent(grid: Grid | Costmap) -> tuple[float, float, float, float]:
    """Left, right, bottom, top in metres."""
    x, y = grid.origin_x, grid.origin_y
    return x, x + grid.width * grid.resolution, y, y + grid.height * grid.resolution


def draw_robot(axes: Any, pose: SE2, radius: float, colour: str = BLUE) -> None:
    """A disc that shows where it looks."""
    axes.add_patch(
        Circle((pose.x, pose.y), radius, facecolor=(1, 1, 1, 0.6), edgecolor=colour, lw=1.5, zorder=5)
    )
    tip = pose.apply(np.array([[radius, 0.0]]))[0]
    axes.plot([pose.x, tip[0]], [pose.y, tip[1]], color=colour, lw=1.5, zorder=6)


def window(axes: Any, like: Grid) -> None:
    """Show what `like` covers."""
    left, right, bottom, top = extent(like)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def snapshot(axes: Any, grid: Grid, filter_: Amcl, title: str, here: SE2 | None) -> None:
    """Particles as dots, the truth as a circle."""
    draw_grid(axes, grid, title + f", {len(filter_.particles)} particles")
    step = max(1, len(filter_.particles) // 1500)
    axes.plot(*filter_.particles[::step, :2].T, ".", color=BLUE, ms=1.5)
    if here is not None:
        axes.add_patch(Circle((here.x, here.y), 0.5, fill=False, edgecolor=RED, lw=1.5))
    axes.title.set_fontsize(8)
    window(axes, grid)


def trajectory(
    axes: Any,
    costmap: Costmap,
    now: tuple[float, float],
    twist: tuple[float, float],
    limits: Limits,
    *,
    chosen: bool = False,
) -> None:
    """Where a twist leads in 1.5 s, with the ramp to it; red if it would touch something."""
    cell = costmap.resolution
    ramp = max(
        abs(twist[0] - now[0]) / limits.acceleration, abs(twist[1] - now[1]) / limits.angular_acceleration
    )
    points, blocked = [], False
    for seconds in np.linspace(0.075, 1.5, 20):
        end = roll_out(
            costmap.cells, -costmap.origin_x / cell, -costmap.origin_y / cell, 0.0,
            (now[0] / cell, now[1]), (twist[0] / cell, twist[1]), ramp, float(seconds), math.inf, INSCRIBED,
            np.zeros((0, 2)), 0, NOBODY.states, (1.0, 1.0),
        )  # fmt: skip
        points.append((end.x * cell + costmap.origin_x, end.y * cell + costmap.origin_y))
        blocked = end.blocked
    colour = GREEN if chosen else RED if blocked else "0.55"
    axes.plot(*np.array(points).T, color=colour, lw=3.0 if chosen else 0.7, zorder=4)
