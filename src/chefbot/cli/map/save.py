"""`chefbot map save`: the map of a running robot and its named places as files."""

from __future__ import annotations

import base64
import uuid
from collections.abc import Mapping
from pathlib import Path

from rich.console import Console

from chefbot.cli import running_robot
from chefbot.cli.running_robot import LAYER_TIMEOUT, known_places
from chefbot.errors import UserError
from chefbot.mapping.map_format import decode_map
from chefbot.maths.se2 import SE2
from chefbot.plural import number_of
from chefbot.storage.map_bundle import BUNDLE_SUFFIX, decode_bundle
from chefbot.storage.map_files import map_files_of, map_yaml_path
from chefbot.storage.mapped_drives import BUNDLE
from chefbot.storage.new_map import check_usable, save_new_map
from chefbot.storage.places import places_path, save_places
from chefbot.ui.commands import MapSaved, SendMap
from chefbot.ui.remote.web_ui_client import WebUiClient

ADJUST_TIMEOUT = 60.0
"""Time in which the robot has to adjust its map and to send it, s."""
console = Console(highlight=False, soft_wrap=True, markup=False)


def save_running_map(file: Path, page: str) -> None:
    """Save the map that the robot shows, and its named places unless such a file exists already.

    A map that is being made has all its poses adjusted first, and its drive is saved beside it. Raises UserError if
    there is no map yet or the files cannot be written.
    """
    with WebUiClient(page) as robot:
        grid = robot.wait_for("map", running_robot.RESPONSE_TIMEOUT)
        if grid is None:
            raise UserError(
                f"the robot at {robot.url} has no map yet; start `chefbot launch gmapping_demo` and drive it around"
            )
        check_usable(grid)
        places = known_places(robot)
        bundle = _adjusted_bundle(robot)
        if bundle:
            grid = decode_map(*map_files_of(decode_bundle(bundle, Path(BUNDLE)), Path(BUNDLE)))
        beside = map_yaml_path(file).with_suffix(BUNDLE_SUFFIX)
        path = save_new_map(file, grid, [(beside, bundle)] if bundle else [])
        robot.send(MapSaved(path.name[-64:]))
    height, width = (cells * grid.resolution for cells in grid.cells.shape)
    console.print(f"saved {path}: {width:.1f} by {height:.1f} m, {grid.resolution:.3g} m per cell")
    if not bundle and beside.exists():
        console.print(f"kept {beside}, which exists already: it holds another map with its drive")
    if places:
        _save_places(places_path(path), places)


def _adjusted_bundle(robot: WebUiClient) -> bytes:
    """Return the bundle of the map that is being made, empty if none is or its drive is not kept."""
    launch = robot.wait_for("launch", LAYER_TIMEOUT)
    if not (launch and launch["mapping"]):
        return b""
    number = uuid.uuid4().hex
    console.print("adjusting all poses of the map ...")
    robot.send(SendMap(number))
    answered = lambda: (robot.latest.get("map_bundle") or {}).get("id") == number  # noqa: E731
    if not robot.wait_until(answered, ADJUST_TIMEOUT):
        raise UserError(
            f"the robot at {robot.url} did not send its map within {ADJUST_TIMEOUT:.0f} s; try again"
        )
    bundle = base64.b64decode(robot.latest["map_bundle"]["bundle"])
    if not bundle:
        console.print("Warning: the robot keeps no drive of this map; it is saved as it is shown.")
    return bundle


def _save_places(path: Path, places: Mapping[str, SE2]) -> None:
    if path.exists():  # a person may have edited it
        console.print(
            f"kept {path}, which exists already; it fits this map if the robot began where it did for the map before,"
            " else delete it"
        )
        return
    save_places(path, places)
    console.print(f"saved {path}: {number_of(len(places), 'place')}")
