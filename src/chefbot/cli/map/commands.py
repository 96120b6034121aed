"""The commands of `chefbot map`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import PAGE, WEB_UI

map_app = new_group("Maps: save (map_saver), build from a log, compare; export zones.")


class Algorithm(StrEnum):
    """A mapping algorithm that `chefbot map slam` runs."""

    GMAPPING = "gmapping"
    GRAPH = "graph"


@map_app.command("save")
def save(
    file: Annotated[Path, typer.Option("-f", help="name of the map, without extension")] = Path("map"),
    page: Annotated[str, PAGE] = WEB_UI,
) -> None:
    """Save the map of a running robot as NAME.pgm and NAME.yaml, as map_saver of ROS does."""
    from chefbot.cli.map.save import save_running_map

    save_running_map(file, page)


@map_app.command("slam")
def slam(
    log: Annotated[Path, typer.Argument(help="a CARMEN log, .log or .log.gz")],
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/slam"),
    algorithm: Annotated[
        Algorithm, typer.Option(help="particle filter (gmapping) or pose graph (graph)")
    ] = Algorithm.GMAPPING,
    particles: Annotated[int, typer.Option(min=1, max=1000, help="number of particles of gmapping")] = 30,
    seed: Annotated[int, typer.Option(min=0, help="random seed of gmapping; same seed, same map")] = 1,
    max_range: Annotated[
        float, typer.Option(min=0.1, max=1000, help="longer ranges count as no return, m")
    ] = 80.0,
    report: Annotated[
        bool, typer.Option("--report", help="write report.html: closures, residuals, time, memory")
    ] = False,
) -> None:
    """Build a map from a recorded log: trajectory.tum, map.yaml, map.pgm and map.png."""
    from chefbot.cli.map.slam import run_slam

    run_slam(log, out, algorithm.value, particles, seed, max_range, report=report)


@map_app.command("compare")
def compare(
    file: Annotated[Path, typer.Argument(help="a map to judge, NAME.yaml")],
    truth: Annotated[Path, typer.Argument(help="the reference map, NAME.yaml")],
) -> None:
    """Compare a map with a reference map: precision and recall of the walls, explored part, offset."""
    from chefbot.cli.map.compare import compare_maps

    compare_maps(file, truth)


@map_app.command("zones")
def zones(
    file: Annotated[Path, typer.Argument(help="a map with NAME.zones.yaml beside it, NAME.yaml")],
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/zones"),
    robot: Annotated[str, typer.Option(help="serial number of the robot in the zone set")] = "chefbot",
) -> None:
    """Write the zones of a map as filter masks of Nav2 and as a zone set of VDA 5050."""
    from chefbot.cli.map.zones import export_zones

    export_zones(file, out, robot)
