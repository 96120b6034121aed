"""Maps on disk: a picture and its YAML file, whole at every moment."""

from __future__ import annotations

import hashlib
import io
import re
from pathlib import Path

import numpy as np
from PIL import Image

from chefbot.config import read_bytes
from chefbot.errors import UserError
from chefbot.mapping.map_format import (
    GREY,
    WHITE,
    Mode,
    decode_map,
    decode_map_yaml,
    encode_map_yaml,
    encode_pgm,
)
from chefbot.maths.grid import Grid
from chefbot.storage.atomic_files import explained, real_path, remove, rename_all, write_beside

MAX_IMAGE_BYTES = 500_000_000


MAX_YAML_BYTES = 100_000


def save_map(folder_or_stem: Path, grid: Grid, mode: Mode = "trinary") -> Path:
    """Write NAME.pgm and NAME.yaml, and give the path of the latter; a folder gets `map.pgm`, `map.yaml`.

    There is no window: at every moment, killed or not, NAME.yaml names a whole picture that belongs to it,
    for any reader. Two renames alone would leave the old YAML file beside the new picture for a moment. So
    the new picture is first put beside the old one as NAME.<checksum>.pgm; then a YAML file that names it
    replaces the old one, and the new map is valid; then the picture replaces NAME.pgm and a YAML file that
    names that one follows; then the extra picture goes. All four files are on disk before the first rename,
    so that a full disk leaves the old map. UserError with the reason if anything fails.
    """
    yaml = map_yaml_path(folder_or_stem)
    with explained(yaml):
        yaml = real_path(yaml)
        _save_pair(yaml, yaml.with_name(yaml.name[: -len(".yaml")] + ".pgm"), grid, mode)
    return yaml


def map_yaml_path(folder_or_stem: Path) -> Path:
    """The YAML file that `save_map` writes for a folder, a stem or the file's own name."""
    if folder_or_stem.is_dir():
        return folder_or_stem / "map.yaml"
    name = folder_or_stem.name
    return folder_or_stem if name.endswith(".yaml") else folder_or_stem.with_name(name + ".yaml")


def load_map(path: Path) -> Grid:
    """The map of a YAML file; a picture's name that is not absolute counts from the YAML file's folder.

    UserError with file and reason for anything that is no whole map.
    """
    about = decode_map_yaml(read_bytes(path, "map file", MAX_YAML_BYTES), f"map file {path}")
    image = path.parent / about.image
    if image.exists() and not image.is_file():  # a pipe would be waited for
        raise UserError(f"map picture {image} is not a file")
    return decode_map(about, read_bytes(image, "map picture", MAX_IMAGE_BYTES), f"map picture {image}")


def map_png(grid: Grid) -> bytes:
    """A picture to look at: the fuller a cell the darker, unknown grey; high y on top."""
    table = np.full(256, GREY, np.uint8)
    table[:101] = np.round(WHITE * (1.0 - np.arange(101) / 100.0))
    file = io.BytesIO()
    Image.fromarray(table[grid.cells[::-1].view(np.uint8)]).save(file, "PNG")
    return file.getvalue()


def _save_pair(yaml: Path, pgm: Path, grid: Grid, mode: Mode) -> None:
    image = encode_pgm(grid, mode)
    extra = pgm.with_name(f"{pgm.stem}.{hashlib.sha256(image).hexdigest()[:16]}.pgm")
    writes = [
        (extra, image),
        (yaml, encode_map_yaml(extra.name, grid, mode, image)),
        (pgm, image),
        (yaml, encode_map_yaml(pgm.name, grid, mode, image)),
    ]
    renames: list[tuple[Path, Path]] = []
    try:
        for number, (target, data) in enumerate(writes):
            renames.append((write_beside(target, data, number), target))
    except BaseException:
        remove(temporary for temporary, _ in renames)
        raise
    rename_all(renames)
    remove(_extra_pictures(pgm))


def _extra_pictures(pgm: Path) -> list[Path]:
    """Pictures that this save or one that was killed put beside `pgm`."""
    name = re.compile(re.escape(pgm.stem) + r"\.[0-9a-f]{16}\.pgm")
    return [path for path in pgm.parent.iterdir() if name.fullmatch(path.name)]
