"""Map files: an image and its YAML file, consistent at every moment."""

from __future__ import annotations

import hashlib
import io
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from chefbot.config import read_bytes
from chefbot.file_kinds import MAP, check_no_picture
from chefbot.mapping.image_format import MapFormatError
from chefbot.mapping.map_format import (
    GREY,
    WHITE,
    MapDescription,
    Mode,
    decode_map,
    decode_map_yaml,
    encode_map_yaml,
    encode_pgm,
)
from chefbot.maths.grid import Grid
from chefbot.storage.atomic_files import (
    os_errors_as_storage_errors,
    remove,
    resolve_path,
    write_all,
)
from chefbot.storage.map_bundle import BUNDLE_SUFFIX, read_bundle

MAX_IMAGE_BYTES = 500_000_000


MAX_YAML_BYTES = 100_000


def save_map(
    folder_or_stem: Path,
    grid: Grid,
    mode: Mode = "trinary",
    companions: Sequence[tuple[Path, bytes]] = (),
) -> Path:
    """Write NAME.pgm and NAME.yaml and return the path of the latter; a folder gets `map.pgm`, `map.yaml`.

    At every moment, even if the process is killed, NAME.yaml names a complete image that belongs to it. Two
    renames alone would leave the old YAML file beside the new image for a moment. So

    1. the new image is put beside the old one as NAME.<checksum>.pgm;
    2. a YAML file that names it replaces the old one: the new map is valid;
    3. the image replaces NAME.pgm, and a YAML file that names that one follows;
    4. the extra image is removed.

    All four files are on disk before the first rename, so that a full disk leaves the old map intact, and so
    are `companions`: other files with their data that are written together with the map or not at all.
    StorageError with the reason if anything fails.
    """
    yaml = map_yaml_path(folder_or_stem)
    with os_errors_as_storage_errors(yaml):
        yaml = resolve_path(yaml)
        _save_pair(yaml, yaml.with_name(yaml.name[: -len(".yaml")] + ".pgm"), grid, mode, companions)
    return yaml


def map_yaml_path(folder_or_stem: Path) -> Path:
    """Return the YAML file that `save_map` writes for a folder, a stem or the file's own name."""
    if folder_or_stem.is_dir():
        return folder_or_stem / "map.yaml"
    name = folder_or_stem.name
    return folder_or_stem if name.endswith(".yaml") else folder_or_stem.with_name(name + ".yaml")


def map_in(path: Path) -> Path:
    """Return the map at a path, which may be the folder of a `map.yaml`."""
    return path / "map.yaml" if os.path.isdir(path) else path  # noqa: PTH112 - for names of any length


class MapFiles(NamedTuple):
    """What the two files of a map hold: the description, and the image, not yet decoded. where: names the image."""

    description: MapDescription
    image: bytes
    where: str


def load_map(path: Path) -> Grid:
    """Load the map of a YAML file; a relative image path is relative to the YAML file's folder.

    ConfigError with file and reason if the map is invalid or incomplete.
    """
    return decode_map(*read_map_files(path))


def read_map_files(path: Path) -> MapFiles:
    """Read a map's YAML file and image, or those of a bundle, without decoding the image, for `decode_map`."""
    where = f"map file {path}"
    if path.suffix == BUNDLE_SUFFIX:
        return map_files_of(read_bundle(path), path)
    check_no_picture(path, MAP, where, MapFormatError)
    about = decode_map_yaml(read_bytes(path, "map file", MAX_YAML_BYTES), where)
    image = path.parent / about.image
    exists = os.path.exists(image)  # noqa: PTH110 - Path's method raises for names that no file can have
    if exists and not image.is_file():
        raise MapFormatError(f"map picture {image} is not a file")
    beside = path.parent / image.name
    if not exists and os.path.isfile(beside):  # noqa: PTH113
        # an absolute path of the machine that the map was made on
        raise MapFormatError(
            f"map picture {image} does not exist; to use the one beside the YAML file, write image: {image.name}"
            f" in {path}"
        )
    if not exists:
        raise MapFormatError(f"{where}: image: {image} does not exist")
    return MapFiles(about, read_bytes(image, "map picture", MAX_IMAGE_BYTES), f"map picture {image}")


def map_files_of(bundle: Mapping[str, bytes], path: Path) -> MapFiles:
    """Return the map's files among those of a bundle. path: names it in errors. MapFormatError without them."""
    if not {"map.yaml", "map.pgm"} <= set(bundle):
        raise MapFormatError(f"{path} holds no map")
    about = decode_map_yaml(bundle["map.yaml"], f"map file {path}")
    return MapFiles(about, bundle["map.pgm"], f"map picture of {path}")


def map_png(grid: Grid) -> bytes:
    """Render a map as PNG: the higher the occupancy the darker, unknown cells grey, high y at the top."""
    shades = np.full(256, GREY, np.uint8)
    shades[:101] = np.round(WHITE * (1.0 - np.arange(101) / 100.0))
    file = io.BytesIO()
    Image.fromarray(shades[grid.cells[::-1].view(np.uint8)]).save(file, "PNG")
    return file.getvalue()


def _save_pair(
    yaml: Path, pgm: Path, grid: Grid, mode: Mode, companions: Sequence[tuple[Path, bytes]]
) -> None:
    image = encode_pgm(grid, mode)
    extra = pgm.with_name(f"{pgm.stem}.{hashlib.sha256(image).hexdigest()[:16]}.pgm")
    writes = [
        (extra, image),
        (yaml, encode_map_yaml(extra.name, grid, mode, image)),
        (pgm, image),
        (yaml, encode_map_yaml(pgm.name, grid, mode, image)),
    ]
    write_all([*writes, *companions])
    remove(_intermediate_images(pgm))


def _intermediate_images(pgm: Path) -> list[Path]:
    """Return the intermediate images left beside `pgm` by this save or by one that was killed."""
    name = re.compile(re.escape(pgm.stem) + r"\.[0-9a-f]{16}\.pgm")
    return [path for path in pgm.parent.iterdir() if name.fullmatch(path.name)]
