"""`chefbot map info`, `crop`, `rotate` and `undo`: a map with its places and zones, outside of a running robot."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from chefbot.devices.maps.map_editor import MapEditor
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.msgs.chefbot_msgs.maps import MapEdit
from chefbot.msgs.geometry_msgs import Point
from chefbot.plural import number_of
from chefbot.slam.params import GmappingParams
from chefbot.storage.map_bundle import BUNDLE_SUFFIX
from chefbot.storage.map_files import load_map, map_in
from chefbot.storage.mapped_drives import BUNDLE, load_drives
from chefbot.storage.zones import zones_path

console = Console(highlight=False, soft_wrap=True, markup=False)


def print_info(file: Path) -> None:
    """Print size, area, places and zones of a map, or the sessions of a bundle. UserError for an unreadable one."""
    if file.suffix == BUNDLE_SUFFIX:
        _print_sessions(file)
        return
    bundle = file / BUNDLE
    if file.is_dir() and not map_in(file).exists() and bundle.exists():
        _print_sessions(bundle)
        return
    editor = _editor(file)
    content, grid = editor.content(), editor.grid
    rows, columns = grid.cells.shape
    corner = f"{grid.origin_x:.2f}, {grid.origin_y:.2f}"
    table = Table(show_header=False, box=None)
    table.add_row(
        "size", f"{columns} x {rows} cells of {grid.resolution:g} m, {_extent(grid)} from ({corner})"
    )
    free, walls = _area(grid, grid.cells == 0), _area(grid, grid.cells >= OCCUPIED_THRESHOLD)
    table.add_row(
        "area", f"{free:.1f} m2 free, {walls:.1f} m2 of walls, {_area(grid, grid.cells < 0):.1f} m2 unknown"
    )
    table.add_row(
        "places", ", ".join(entry.label or name for name, entry in content.places.items()) or "none"
    )
    table.add_row("zones", ", ".join(zone.title for zone in content.zones) or "none")
    table.add_row("versions", f"{number_of(len(editor.versions), 'change')} can be undone")
    console.print(table)
    if file.is_dir() and bundle.exists():
        _print_sessions(bundle)


def _print_sessions(bundle: Path) -> None:
    """Print the sessions from which the map of a bundle was built."""
    drives = load_drives(bundle)
    algorithm = "particle filter" if isinstance(drives.params, GmappingParams) else "pose graph"
    table = Table("session", "scans", "scans in the map", "duration", "begins at", box=None)
    for number, session in enumerate(drives.sessions, 1):
        minutes = float(session.stamps.max() - session.stamps.min()) / 60.0
        start = "the origin" if number == 1 else "({:.2f}, {:.2f}), {:.2f} rad".format(*session.start)
        scans = (str(len(session.stamps)), str(int(session.used.sum())))
        table.add_row(str(number), *scans, f"{minutes:.1f} min", start)
    console.print(f"{bundle}: {number_of(len(drives.sessions), 'session')}, {algorithm}")
    console.print(table)


def crop_map(
    file: Path, x_min: float | None, x_max: float | None, y_min: float | None, y_max: float | None
) -> None:
    """Keep the part of a map between coordinates, m; None is the edge of the map."""
    editor = _editor(file)
    grid = editor.grid
    rows, columns = grid.cells.shape
    low = (grid.origin_x, grid.origin_y)
    high = (low[0] + columns * grid.resolution, low[1] + rows * grid.resolution)
    first = (_given(x_min, low[0]), _given(y_min, low[1]))
    second = (_given(x_max, high[0]), _given(y_max, high[1]))
    if not (first[0] < second[0] and first[1] < second[1]):
        extent = f"the map reaches from ({low[0]:.2f}, {low[1]:.2f}) to ({high[0]:.2f}, {high[1]:.2f})"
        raise UserError(f"--x-min and --y-min must be below --x-max and --y-max; {extent}")
    _apply(editor, file, MapEdit(crop=(Point(*first, 0.0), Point(*second, 0.0))))


def rotate_map(file: Path, degrees: float) -> None:
    """Turn a map with its places and zones about the origin of its frame, counterclockwise."""
    _apply(_editor(file), file, MapEdit(rotation=math.radians(math.remainder(degrees, 360.0))))


def undo_change(file: Path) -> None:
    """Take back the last change of a map. Raises UserError without one."""
    editor = _editor(file)
    editor.undo()
    console.print(f"{file}: the last change is undone; {_extent(editor.grid)}.")


def _editor(file: Path) -> MapEditor:
    path = map_in(file)
    return MapEditor(path, zones_path(path), load_map(path), {})


def _apply(editor: MapEditor, file: Path, edit: MapEdit) -> None:
    before = _extent(editor.grid)
    try:
        changed = editor.apply(edit)
    except ChefbotError as error:
        raise UserError(f"{file}: {error}") from None
    if not changed:
        console.print(f"{file} is unchanged: it already has this extent ({before}).")
        return
    console.print(
        f"{file}: {before} before, {_extent(editor.grid)} now; `chefbot map undo {file}` takes it back."
    )


def _given(value: float | None, default: float) -> float:
    return default if value is None else value


def _extent(grid: Grid) -> str:
    rows, columns = grid.cells.shape
    return f"{columns * grid.resolution:.2f} x {rows * grid.resolution:.2f} m"


def _area(grid: Grid, cells: np.ndarray) -> float:
    return float(cells.sum()) * grid.resolution**2
