"""Atomic file writes: the data goes to a temporary file in the same folder, which is then renamed."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from chefbot.errors import ChefbotError

ANYONE, OWNER_ONLY = 0o666, 0o600
"""Permissions of a file: who may read and write it."""


class StorageError(ChefbotError):
    """A file or folder that cannot be written; the message holds the path and the system's reason."""


def write_atomic(path: Path, data: bytes, mode: int = ANYONE) -> None:
    """Write `data` to `path` atomically and durably; after a failure the old content is still there.

    mode: permissions of the file, less those that the umask takes.

    A symbolic link is followed. A device or a pipe is written to directly, as a rename would replace it by a
    file. StorageError with the reason, e.g. a full disk.
    """
    with os_errors_as_storage_errors(path):
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        target = resolve_path(path)
        rename_all([(write_temporary(target, data, mode=mode), target)])


@contextmanager
def os_errors_as_storage_errors(path: Path) -> Iterator[None]:
    """Convert an OSError while writing `path` to a StorageError of one sentence."""
    try:
        yield
    except OSError as error:
        raise StorageError(f"{path} cannot be written: {error.strerror or error}") from error


def make_folder(folder: Path) -> None:
    """Create a folder and its parents if they do not exist; StorageError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise StorageError(
            f"folder {folder} cannot be made: a file has its name, or that of a parent"
        ) from None
    except OSError as error:
        raise StorageError(f"folder {folder} cannot be made: {error.strerror or error}") from None


@contextmanager
def folder_for_results(folder: Path) -> Iterator[None]:
    """Create a folder and its parents first; after an exception, remove those created here that are empty."""
    with os_errors_as_storage_errors(folder):
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
    make_folder(folder)
    try:
        yield
    except BaseException:
        with suppress(OSError):
            for path in missing:
                path.rmdir()
        raise


def write_temporary(target: Path, data: bytes, number: int = 0, mode: int = ANYONE) -> Path:
    """Write a temporary file in the folder of `target` and sync it to disk; it is removed on failure."""
    writer = f"{os.getpid()}.{threading.get_ident()}.{number}"
    temporary = target.with_name(f".{target.name}.{writer}.tmp")
    temporary.unlink(missing_ok=True)  # left by a dead process with the same PID
    try:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        try:
            remaining = memoryview(data)
            while remaining:
                remaining = remaining[os.write(handle, remaining) :]
            os.fsync(handle)
        finally:
            os.close(handle)
    except BaseException:
        remove([temporary])
        raise
    return temporary


def write_all(writes: Sequence[tuple[Path, bytes]]) -> None:
    """Write several files: all data is on disk before the first file gets its name.

    So a full disk leaves all old files as they were. OSError if anything fails.
    """
    renames: list[tuple[Path, Path]] = []
    try:
        for number, (target, data) in enumerate(writes):
            renames.append((write_temporary(target, data, number), target))
    except BaseException:
        remove(temporary for temporary, _ in renames)
        raise
    rename_all(renames)


def rename_all(renames: list[tuple[Path, Path]]) -> None:
    """Rename each temporary file to its target, durably and in order.

    On failure remove the temporary files.
    """
    try:
        for temporary, target in renames:
            os.replace(temporary, target)  # noqa: PTH105 - tests make the system calls fail
            sync_folder(target.parent)
    except BaseException:
        remove(temporary for temporary, _ in renames)
        raise


def sync_folder(folder: Path) -> None:
    """Sync a folder's entries to disk.

    Windows cannot open folders, and writes their entries by itself.
    """
    if not hasattr(os, "O_DIRECTORY"):
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def remove(paths: Iterator[Path] | list[Path]) -> None:
    """Remove files; errors are ignored, as the caller has a more important one to report."""
    for path in paths:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def resolve_path(path: Path) -> Path:
    """Resolve all symbolic links of a path."""
    try:
        return path.resolve()
    except (ValueError, RuntimeError) as error:  # a null character; links in a circle
        raise StorageError(f"{str(path)!r} cannot be written: {error}") from None


def write_into_folder(path: Path, data: bytes) -> None:
    """Write a file atomically, creating its folder if necessary; StorageError with the reason."""
    make_folder(path.parent)
    write_atomic(path, data)


def rename_existing(path: Path) -> Path | None:
    """Rename an existing file NAME.END to the first free NAME.1.END, NAME.2.END, ...; return the new path.

    None if there is no such file. Raises StorageError if it cannot be renamed.
    """
    if not path.is_file():
        return None
    numbered = (path.with_name(f"{path.stem}.{number}{path.suffix}") for number in count(1))
    kept = next(one for one in numbered if not one.exists())
    try:
        path.rename(kept)
    except OSError as error:
        raise StorageError(f"{path} exists and cannot be renamed: {error.strerror}") from None
    return kept
