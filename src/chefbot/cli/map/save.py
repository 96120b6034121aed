"""`chefbot map save`: the map of a running robot and its named places as files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console

from chefbot.cli import running_robot
from chefbot.cli.running_robot import known_places
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.plural import number_of
from chefbot.storage.new_map import check_usable, save_new_map
from chefbot.storage.places import places_path, save_places
from chefbot.ui.commands import MapSaved
from chefbot.ui.remote.web_ui_client import WebUiClient

console = Console(highlight=False, soft_wrap=True, markup=False)


def save_running_map(file: Path, page: str) -> None:
    """Save the map that the robot shows, and its named places unless such a file exists already.

    Raises UserError if there is no map yet or the files cannot be written.
    """
    with WebUiClient(page) as robot:
        grid = robot.wait_for("map", running_robot.RESPONSE_TIMEOUT)
        if grid is None:
            raise UserError(
                f"the robot at {robot.url} has no map yet; start `chefbot launch gmapping_demo` and drive it around"
            )
        check_usable(grid)
        places = known_places(robot)
        path = save_new_map(file, grid)
        robot.send(MapSaved(path.name[-64:]))
    height, width = (cells * grid.resolution for cells in grid.cells.shape)
    console.print(f"saved {path}: {width:.1f} by {height:.1f} m, {grid.resolution:.3g} m per cell")
    if places:
        _save_places(places_path(path), places)


def _save_places(path: Path, places: Mapping[str, SE2]) -> None:
    if path.exists():  # a person may have edited it
        console.print(
            f"kept {path}, which exists already; it fits this map if the robot began where it did for the map before,"
            " else delete it"
        )
        return
    save_places(path, places)
    console.print(f"saved {path}: {number_of(len(places), 'place')}")
