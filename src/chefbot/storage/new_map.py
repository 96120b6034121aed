"""A new map in place of another one that people may have changed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from chefbot.maths.grid import Grid
from chefbot.storage.map_bundle import BUNDLE_SUFFIX
from chefbot.storage.map_files import map_yaml_path, save_map
from chefbot.storage.map_versions import versions_of
from chefbot.storage.zones import zones_path

NO_ROTATION = "0.0"
"""Note of a version before a change that does not turn the map."""


def save_new_map(folder_or_stem: Path, grid: Grid, companions: Sequence[tuple[Path, bytes]] = ()) -> Path:
    """Write a map as `save_map` does; a map that people have changed is kept as a version, so that it can be undone.

    Raises StorageError if anything fails; the map before is still there then.
    """
    path = map_yaml_path(folder_or_stem)
    versions = versions_of(path, zones_path(path))
    if not len(versions):
        return save_map(path, grid, companions=companions)
    replaced = [path.with_suffix(suffix) for suffix in (".yaml", ".pgm", BUNDLE_SUFFIX)]
    with versions.change(replaced, NO_ROTATION):
        return save_map(path, grid, companions=companions)
