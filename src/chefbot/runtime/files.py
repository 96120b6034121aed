"""Files that are whole at every moment: written beside, then renamed. Maps on disk."""

from __future__ import annotations

import hashlib
import io
import os
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
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

MAX_IMAGE_BYTES = 500_000_000
MAX_YAML_BYTES = 100_000


def write_atomic(path: Path, data: bytes) -> None:
    """After this, `path` holds `data`, also after a power cut; if it fails or is killed, what it held before.

    A symbolic link is followed. A device or a pipe is written to; a file in its place would be no device any more.
    UserError with the reason, e.g. a full disk.
    """
    with explained(path):
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        target = _real(path)
        _rename([(_write_beside(target, data), target)])


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """What the operating system says against writing `path`, as a UserError of one sentence."""
    try:
        yield
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror or error}") from error


def make_folder(folder: Path) -> None:
    """With those above it, unless it is there. UserError if it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"folder {folder} cannot be made: {error.strerror or error}") from None


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
        yaml = _real(yaml)
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
            renames.append((_write_beside(target, data, number), target))
    except BaseException:
        _remove(temporary for temporary, _ in renames)
        raise
    _rename(renames)
    _remove(_extra_pictures(pgm))


def _extra_pictures(pgm: Path) -> list[Path]:
    """Pictures that this save or one that was killed put beside `pgm`."""
    name = re.compile(re.escape(pgm.stem) + r"\.[0-9a-f]{16}\.pgm")
    return [path for path in pgm.parent.iterdir() if name.fullmatch(path.name)]


def _write_beside(target: Path, data: bytes, number: int = 0) -> Path:
    """A new file in the folder of `target`, on disk when this returns; gone if it fails."""
    writer = f"{os.getpid()}.{threading.get_ident()}.{number}"
    temporary = target.with_name(f".{target.name}.{writer}.tmp")
    temporary.unlink(missing_ok=True)  # of a dead process that had our number
    try:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(handle, rest) :]
            os.fsync(handle)
        finally:
            os.close(handle)
    except BaseException:
        _remove([temporary])
        raise
    return temporary


def _rename(renames: list[tuple[Path, Path]]) -> None:
    """Each temporary file to its target, in this order also on disk; what fails leaves no temporary file."""
    try:
        for temporary, target in renames:
            os.replace(temporary, target)  # noqa: PTH105 - tests make the system calls fail
            sync_folder(target.parent)
    except BaseException:
        _remove(temporary for temporary, _ in renames)
        raise


def sync_folder(folder: Path) -> None:
    """Names in it are on the disk when this returns. Windows opens no folder, and writes names by itself."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _remove(paths: Iterator[Path] | list[Path]) -> None:
    """Tidy up; a file that cannot go is only litter, and the reason to tell is another one."""
    for path in paths:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _real(path: Path) -> Path:
    """Where the links lead."""
    try:
        return path.resolve()
    except (ValueError, RuntimeError) as error:  # a null character; links in a circle
        raise UserError(f"{str(path)!r} cannot be written: {error}") from None
