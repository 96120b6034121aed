"""`chefbot map quality`: how good a map is, and where it is not, without the true floor plan."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, TaskID

from chefbot.cli.map.slam_pictures import error_picture
from chefbot.errors import ChefbotError, UserError
from chefbot.slam.map_error import MapErrorEstimate, MapRegion, centimetres, estimate_map_error, verdict
from chefbot.slam.offline import OfflineMapper, SlamResult
from chefbot.storage.atomic_files import StorageError, folder_for_results, write_atomic
from chefbot.storage.mapped_drives import bundle_path, load_drives

WORST = 5
"""Number of regions that are listed."""
PICTURE = "quality.png"

console = Console(highlight=False)


def print_quality(bundle: Path, picture: Path | None) -> None:
    """Print the estimated error of a map, and write a picture of it, by default beside the bundle.

    Raises UserError if the bundle cannot be read, or nothing can be estimated from its drives.
    """
    path = bundle_path(bundle)
    picture = picture or path.parent / PICTURE
    if picture.suffix != ".png" or picture.name == "map.png":
        raise UserError(
            f"--out {picture}: the picture is a .png file with a name of its own, such as {PICTURE}"
        )
    result = _map_again(path)
    try:
        estimate = estimate_map_error(result.sessions, result.poses, result.range_offset)
        with folder_for_results(picture.parent):
            write_atomic(picture, error_picture(result.grid, estimate))
    except StorageError:
        raise
    except ChefbotError as error:
        raise UserError(f"{path}: {error}") from None
    console.print(verdict(estimate))
    for name, text in rows(estimate).items():
        console.print(f"  {name:26}{text}")
    console.print(str(picture), markup=False, soft_wrap=True)


def _map_again(path: Path) -> SlamResult:
    """Build the map of a bundle again from its drives, with a progress display."""
    drives = load_drives(path)
    mapper = OfflineMapper.beginning_with(drives.params, drives.sessions[0])
    with Progress(console=console, transient=True) as progress:
        for number, session in enumerate(drives.sessions, 1):
            task = progress.add_task(f"drive {number}", total=len(session.stamps))
            mapper.repeat(session, partial(_show, progress, task))
    return mapper.result(None)


def _show(progress: Progress, task: TaskID, done: int, _: int) -> None:
    progress.update(task, completed=done)


def rows(estimate: MapErrorEstimate) -> dict[str, str]:
    """Return the figures of an estimate as text, by name, and its worst regions."""
    figures = {
        "possible drift": centimetres(estimate.drift),
        "contradictions": centimetres(estimate.contradiction),
        "walls seen on two passes": f"{estimate.compared:.0%}",
    }
    worst = sorted(estimate.regions, key=lambda region: -region.error)[:WORST]
    return figures | {f"around ({x:g}, {y:g})": text for x, y, text in map(_region, worst)}


def _region(region: MapRegion) -> tuple[float, float, str]:
    """Return the centre of a region, m, and its error with the cause."""
    x, y = region.centre
    return x, y, f"{centimetres(region.error)}: {region.cause}"
