"""A new map in place of another one that people may have changed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from chefbot.config import ConfigError, parse_yaml, read_bytes
from chefbot.errors import UserError
from chefbot.file_kinds import MAP, is_kind
from chefbot.mapping.map_format import FREE_THRESH
from chefbot.maths.grid import FREE, Grid
from chefbot.storage.atomic_files import os_errors_as_storage_errors, write_atomic
from chefbot.storage.map_bundle import BUNDLE_SUFFIX
from chefbot.storage.map_files import MAX_YAML_BYTES, map_yaml_path, save_map
from chefbot.storage.map_versions import ChangeNote, versions_of
from chefbot.storage.places import places_path
from chefbot.storage.zones import zones_path

NEW_MAP = ChangeNote("new map", "The map was replaced by a new one")
NO_MAP = "There is no map yet; drive the robot around, or let it explore."


def save_new_map(folder_or_stem: Path, grid: Grid, companions: Sequence[tuple[Path, bytes]] = ()) -> Path:
    """Write a map as `save_map` does; a map that people have changed is kept as a version, so that it can be undone.

    Raises UserError where a file of another kind has the name, and StorageError if anything else fails. What was
    there before is still there then.
    """
    path = map_yaml_path(folder_or_stem)
    _check_replaced(path)
    versions = versions_of(path, zones_path(path))
    if not len(versions):
        return save_map(path, grid, companions=companions)
    with versions.change(_map_files(path), NEW_MAP):
        return save_map(path, grid, companions=companions)


def save_map_in_frame(
    path: Path, grid: Grid, companions: Sequence[tuple[Path, bytes]], frame_of: Path | None
) -> bool:
    """Write a map with the places and zones of the map that has the same frame, None if none has.

    Returns whether other places or zones were beside the map before: a version keeps them, with that map. Raises as
    `check_usable` and `save_new_map`.
    """
    check_usable(grid)
    beside = places_path(path), zones_path(path)
    sources = (None, None) if frame_of is None else (places_path(frame_of), zones_path(frame_of))
    foreign = any(file.is_file() for file in beside)
    is_same = frame_of is not None and frame_of.resolve() == path.resolve()
    if is_same or not (foreign or any(source and source.is_file() for source in sources)):
        save_new_map(path, grid, companions)
        return False
    _check_replaced(path)
    with versions_of(path, zones_path(path)).change([*_map_files(path), *beside], NEW_MAP):
        save_map(path, grid, companions=companions)
        for file, source in zip(beside, sources, strict=True):
            with os_errors_as_storage_errors(file):
                if source is not None and source.is_file():
                    write_atomic(file, source.read_bytes())
                else:
                    file.unlink(missing_ok=True)
    return foreign


def _map_files(path: Path) -> list[Path]:
    return [path.with_suffix(suffix) for suffix in (".yaml", ".pgm", BUNDLE_SUFFIX)]


def check_usable(grid: Grid) -> None:
    """Raise UserError for a map without free floor, on which no robot can be localized."""
    if not np.any((grid.cells >= FREE) & (grid.cells < 100.0 * FREE_THRESH)):
        raise UserError(NO_MAP)


def _check_replaced(path: Path) -> None:
    if path.is_file() and path.stat().st_size and not _is_map(path):
        raise UserError(f"{path} is there already and is not a map; choose another name")


def _is_map(path: Path) -> bool:
    try:
        return is_kind(parse_yaml(read_bytes(path, "map file", MAX_YAML_BYTES), str(path)), MAP)
    except ConfigError:
        return False
