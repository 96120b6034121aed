"""`chefbot map quality`: how good a map is, and where it is not, without the true floor plan."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from chefbot.cli.map.continued import MapContinuation
from chefbot.cli.map.error_rows import rows
from chefbot.cli.map.slam_pictures import QUALITY_PICTURE, error_picture
from chefbot.errors import ChefbotError, UserError
from chefbot.slam.map_error import estimate_map_error, verdict
from chefbot.storage.atomic_files import StorageError, folder_for_results, write_atomic
from chefbot.storage.mapped_drives import bundle_path, load_drives

console = Console(highlight=False)


def print_quality(bundle: Path, picture: Path | None) -> None:
    """Print the estimated error of a map, and write a picture of it, by default beside the bundle.

    Raises UserError if the bundle cannot be read, or nothing can be estimated from its drives.
    """
    path = bundle_path(bundle)
    picture = picture or path.parent / QUALITY_PICTURE
    if picture.suffix != ".png" or picture.name == "map.png":
        raise UserError(
            f"--out {picture}: the picture is a .png file with a name of its own, such as {QUALITY_PICTURE}"
        )
    with Progress(console=console, transient=True) as progress:
        result = MapContinuation(load_drives(path), progress).result()
    try:
        estimate = estimate_map_error(result.sessions, result.poses, result.range_offset)
        with folder_for_results(picture.parent):
            write_atomic(picture, error_picture(result, estimate, verdict(estimate)))
    except StorageError:
        raise
    except ChefbotError as error:
        raise UserError(f"{path}: {error}") from None
    console.print(verdict(estimate))
    for name, text in rows(estimate).items():
        console.print(f"  {name:26}{text}")
    console.print(str(picture), markup=False, soft_wrap=True)
