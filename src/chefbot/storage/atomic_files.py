"""Files that are whole at every moment: written beside, then renamed. Maps on disk."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from chefbot.errors import UserError


def write_atomic(path: Path, data: bytes) -> None:
    """After this, `path` holds `data`, also after a power cut; if it fails or is killed, what it held before.

    A symbolic link is followed. A device or a pipe is written to; a file in its place would be no device any more.
    UserError with the reason, e.g. a full disk.
    """
    with explained(path):
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        target = real_path(path)
        rename_all([(write_beside(target, data), target)])


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


def write_beside(target: Path, data: bytes, number: int = 0) -> Path:
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
        remove([temporary])
        raise
    return temporary


def rename_all(renames: list[tuple[Path, Path]]) -> None:
    """Each temporary file to its target, in this order also on disk; what fails leaves no temporary file."""
    try:
        for temporary, target in renames:
            os.replace(temporary, target)  # noqa: PTH105 - tests make the system calls fail
            sync_folder(target.parent)
    except BaseException:
        remove(temporary for temporary, _ in renames)
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


def remove(paths: Iterator[Path] | list[Path]) -> None:
    """Tidy up; a file that cannot go is only litter, and the reason to tell is another one."""
    for path in paths:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def real_path(path: Path) -> Path:
    """Where the links lead."""
    try:
        return path.resolve()
    except (ValueError, RuntimeError) as error:  # a null character; links in a circle
        raise UserError(f"{str(path)!r} cannot be written: {error}") from None


def write_into_folder(path: Path, data: bytes) -> None:
    """The file, whole or not at all, in a folder that is made if need be. UserError with the reason."""
    make_folder(path.parent)
    write_atomic(path, data)
