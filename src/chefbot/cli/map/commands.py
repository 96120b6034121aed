"""The commands of `chefbot map`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import PAGE, WEB_UI

map_app = new_group("Maps: save (map_saver), build from logs, continue, compare, crop.")


class Algorithm(StrEnum):
    """A mapping algorithm that `chefbot map slam` runs."""

    GMAPPING = "gmapping"
    GRAPH = "graph"


_MAP = typer.Argument(help="a map, NAME.yaml, or the folder of its map.yaml")
_LOG = "a CARMEN log, .log or .log.gz, or a bag: an .mcap or .bag file, or a folder of rosbag2"
_OTHER_LOG = f"log of another drive: {_LOG}"
_SCAN_TOPIC = typer.Option(help="topic of the laser scans in a bag that has several")
_ODOMETRY_TOPIC = typer.Option(help="topic of the odometry in a bag that has several")
_LASER = typer.Option(
    help="pose of the laser on the robot's base, x and y, m, and yaw, rad, instead of the transforms in a bag"
)
_ALGORITHM = typer.Option(help="algorithm: gmapping, a particle filter, or graph, a pose graph")
_MAX_RANGE = typer.Option(min=0.1, max=1000, help="range above which a beam counts as no return, m")
_REPORT = "write report.html: closures, residuals, time, memory"
_BUNDLE = typer.Argument(help="map bundle, map.bundle, or the folder that it is in")
_COORDINATE = typer.Option(help="coordinate of an edge in the map frame, m; default: the edge of the map")


@map_app.command("save")
def save(
    file: Annotated[Path, typer.Option("-f", help="name of the map to write, without extension")] = Path(
        "map"
    ),
    page: Annotated[str, PAGE] = WEB_UI,
) -> None:
    """Save the map of a running robot as NAME.pgm and NAME.yaml, as map_saver of ROS does."""
    from chefbot.cli.map.save import save_running_map

    save_running_map(file, page)


@map_app.command("slam")
def slam(
    log: Annotated[Path, typer.Argument(help=_LOG)],
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/slam"),
    algorithm: Annotated[Algorithm, _ALGORITHM] = Algorithm.GMAPPING,
    particles: Annotated[int, typer.Option(min=1, max=1000, help="number of particles of gmapping")] = 30,
    seed: Annotated[int, typer.Option(min=0, help="random seed of gmapping; same seed, same map")] = 1,
    max_range: Annotated[float, _MAX_RANGE] = 80.0,
    report: Annotated[bool, typer.Option("--report", help=_REPORT)] = False,
    scan_topic: Annotated[str, _SCAN_TOPIC] = "",
    odometry_topic: Annotated[str, _ODOMETRY_TOPIC] = "",
    laser: Annotated[tuple[float, float, float] | None, _LASER] = None,
) -> None:
    """Build a map from a recorded drive: map.yaml, map.pgm, map.png, map.bundle and trajectory.tum."""
    from chefbot.cli.map.bag_drive import BagChoice
    from chefbot.cli.map.slam import run_slam

    choice = BagChoice.of(scan_topic, odometry_topic, laser)
    run_slam(log, out, algorithm.value, particles, seed, max_range, report=report, choice=choice)


@map_app.command("continue")
def continue_(
    bundle: Annotated[Path, _BUNDLE],
    log: Annotated[Path, typer.Option(help=_OTHER_LOG)],
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/continued"),
    start: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            help="pose in the map at the first scan: x and y, m, and yaw, rad; default: found by localization"
        ),
    ] = None,
    report: Annotated[bool, typer.Option("--report", help=_REPORT)] = False,
    scan_topic: Annotated[str, _SCAN_TOPIC] = "",
    odometry_topic: Annotated[str, _ODOMETRY_TOPIC] = "",
    laser: Annotated[tuple[float, float, float] | None, _LASER] = None,
) -> None:
    """Continue a map of `chefbot map slam` with another recorded drive, wherever it begins."""
    from chefbot.cli.map.bag_drive import BagChoice
    from chefbot.cli.map.continued import continue_map

    continue_map(bundle, log, out, start, report, BagChoice.of(scan_topic, odometry_topic, laser))


@map_app.command("merge")
def merge(
    bundle: Annotated[Path, _BUNDLE],
    other: Annotated[Path, _BUNDLE],
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/merged"),
    report: Annotated[bool, typer.Option("--report", help=_REPORT)] = False,
) -> None:
    """Merge two maps of one building into one."""
    from chefbot.cli.map.continued import merge_maps

    merge_maps(bundle, other, out, report)


@map_app.command("quality")
def quality(
    bundle: Annotated[Path, _BUNDLE],
    out: Annotated[
        Path | None, typer.Option(help="picture of the errors; default: quality.png beside the bundle")
    ] = None,
) -> None:
    """Estimate the error of a map from its own scans, of the whole and by region; no floor plan is needed."""
    from chefbot.cli.map.quality import print_quality

    print_quality(bundle, out)


@map_app.command("compare")
def compare(
    file: Annotated[Path, typer.Argument(help="a map to judge, NAME.yaml, or the folder of its map.yaml")],
    truth: Annotated[
        Path, typer.Argument(help="the reference map, NAME.yaml, or the folder of its map.yaml")
    ],
) -> None:
    """Compare a map with a reference map: precision and recall of the walls, explored part, offset."""
    from chefbot.cli.map.compare import compare_maps

    compare_maps(file, truth)


@map_app.command("info")
def info(
    file: Annotated[Path, typer.Argument(help="a map, NAME.yaml, or map.bundle, or the folder of both")],
) -> None:
    """Show size, area, places and zones of a map, or the sessions that a bundle's map was built from."""
    from chefbot.cli.map.edit import print_info

    print_info(file)


@map_app.command("crop")
def crop(
    file: Annotated[Path, _MAP],
    x_min: Annotated[float | None, _COORDINATE] = None,
    x_max: Annotated[float | None, _COORDINATE] = None,
    y_min: Annotated[float | None, _COORDINATE] = None,
    y_max: Annotated[float | None, _COORDINATE] = None,
) -> None:
    """Keep a part of a map; all its places must lie in it. The map before is kept, too."""
    from chefbot.cli.map.edit import crop_map

    crop_map(file, x_min, x_max, y_min, y_max)


@map_app.command("rotate")
def rotate(
    file: Annotated[Path, _MAP],
    degrees: Annotated[
        float,
        typer.Option(min=-360, max=360, help="angle by which to turn the map counterclockwise, degrees"),
    ],
) -> None:
    """Turn a map with its places and zones about the origin of its frame. The map before is kept, too."""
    from chefbot.cli.map.edit import rotate_map

    rotate_map(file, degrees)


@map_app.command("undo")
def undo(file: Annotated[Path, _MAP]) -> None:
    """Take back the last change of a map, its places or zones."""
    from chefbot.cli.map.edit import undo_change

    undo_change(file)


@map_app.command("zones")
def zones(
    file: Annotated[
        Path, typer.Argument(help="a map, NAME.yaml, with NAME.zones.yaml beside it, or their folder")
    ],
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/zones"),
    robot: Annotated[str, typer.Option(help="serial number of the robot in the zone set")] = "chefbot",
) -> None:
    """Write the zones of a map as filter masks of Nav2 and as a zone set of VDA 5050."""
    from chefbot.cli.map.zones import export_zones

    export_zones(file, out, robot)
