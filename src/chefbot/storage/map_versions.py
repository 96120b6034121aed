"""Versions of the files beside a map: each change keeps what was there before, so that it can be taken back."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import msgspec

from chefbot.errors import ChefbotError
from chefbot.storage.atomic_files import StorageError, os_errors_as_storage_errors, write_atomic
from chefbot.storage.map_bundle import BUNDLE_SUFFIX
from chefbot.storage.places import places_path

MAX_VERSIONS = 50
"""Number of versions that are kept, the newest."""
SEAL = "written.sha256"
"""File of a version with the hashes of what the change after it wrote."""
ABSENT = "absent.txt"
"""File of a version with the names of the files that did not exist, which a restoration removes."""
NOTE = "change.json"
"""File of a version that describes the change after it."""
CHANGED_BY_HAND = (
    "The files of the map were edited by hand since the last change here, so it cannot be undone"
)


class ChangeNote(msgspec.Struct, frozen=True):
    """What a change was: its id, a sentence, who made it, and by how much it has turned the map, rad."""

    id: str = ""
    description: str = ""
    edited_by: str = ""
    rotation: float = 0.0


NO_CHANGE = ChangeNote("none")
"""Stands for the last change of a map that has never been changed."""


class RestoredVersion(NamedTuple):
    """The files that a version concerned, none without a version, and the change that was undone."""

    files: list[Path]
    note: ChangeNote = ChangeNote()


class MapVersions:
    """Keeps copies of some of `files`, which have different names, in numbered folders of `folder`."""

    def __init__(self, folder: Path, files: Sequence[Path]) -> None:
        self._folder, self._files = folder, files

    def __len__(self) -> int:
        return len(self._numbers())

    def last_change(self) -> ChangeNote:
        """Return the change that `restore` would undo, NO_CHANGE without any. Raises StorageError."""
        return self._note(self._newest()) if len(self) else NO_CHANGE

    def keep(self, changing: Collection[Path], note: ChangeNote) -> None:
        """Copy the files that a change concerns, before it.

        Raises StorageError if that fails; the change should not happen then.
        """
        numbers = self._numbers()
        version = self._folder / f"{max(numbers, default=0) + 1:06d}"
        incomplete = self._folder / "incomplete"  # a version that lacks a file would delete it
        with os_errors_as_storage_errors(self._folder):
            if incomplete.exists():
                shutil.rmtree(incomplete)
            incomplete.mkdir(parents=True)
            for file in changing:
                if file.is_file():
                    write_atomic(incomplete / file.name, file.read_bytes())
            absent = "".join(f"{file.name}\n" for file in changing if not file.is_file())
            write_atomic(incomplete / ABSENT, absent.encode())
            write_atomic(incomplete / NOTE, msgspec.json.encode(note))
            incomplete.rename(version)
        for number in numbers[: len(numbers) + 1 - MAX_VERSIONS]:
            self._remove(number)

    @contextmanager
    def change(self, changing: Collection[Path], note: ChangeNote) -> Iterator[None]:
        """Keep the files that a change concerns, and bring them back if it fails with a ChefbotError."""
        self.keep(changing, note)
        try:
            yield
        except ChefbotError:
            self.restore()
            raise
        self.seal()

    def seal(self) -> None:
        """Note what the files are after the change, so that one by hand in the meantime is not overwritten."""
        version = self._newest()
        write_atomic(version / SEAL, self._digest(self._concerned(version)))

    def restore(self) -> RestoredVersion:
        """Bring the newest version back, if there is one, and forget it.

        Raises StorageError if the files were changed by others since.
        """
        numbers = self._numbers()
        if not numbers:
            return RestoredVersion([])
        version = self._newest()
        concerned, seal, note = self._concerned(version), version / SEAL, self._note(version)
        if seal.is_file() and seal.read_bytes() != self._digest(concerned):
            raise StorageError(CHANGED_BY_HAND)
        for file in concerned:
            with os_errors_as_storage_errors(file):
                if (version / file.name).is_file():
                    write_atomic(file, (version / file.name).read_bytes())
                else:
                    file.unlink(missing_ok=True)
        self._remove(numbers[-1])
        return RestoredVersion(concerned, note)

    def _concerned(self, version: Path) -> list[Path]:
        """Return the files of which a version has a copy, or the note that they did not exist."""
        with os_errors_as_storage_errors(version):
            absent = (version / ABSENT).read_text().splitlines()
        return [file for file in self._files if (version / file.name).is_file() or file.name in absent]

    def _note(self, version: Path) -> ChangeNote:
        with os_errors_as_storage_errors(version):
            content = (version / NOTE).read_bytes()
        try:
            return msgspec.json.decode(content, type=ChangeNote)
        except msgspec.DecodeError as error:
            raise StorageError(f"{version / NOTE} is damaged ({error}); move its folder away") from None

    def _newest(self) -> Path:
        return self._folder / f"{self._numbers()[-1]:06d}"

    def _digest(self, files: Collection[Path]) -> bytes:
        """Return a hash of the files as they are now."""
        contents = [file.read_bytes() if file.is_file() else b"" for file in files]
        return "".join(hashlib.sha256(content).hexdigest() for content in contents).encode()

    def _remove(self, number: int) -> None:
        version = self._folder / f"{number:06d}"
        with os_errors_as_storage_errors(version):
            shutil.rmtree(version)

    def _numbers(self) -> list[int]:
        if not self._folder.is_dir():
            return []
        return sorted(int(path.name) for path in self._folder.iterdir() if path.name.isdecimal())


def versions_of(map_path: Path, zones_path: Path) -> MapVersions:
    """Return the versions of a map, NAME.yaml, of its bundle, and of the places and zones on it."""
    names = (map_path, map_path.with_suffix(".pgm"), map_path.with_suffix(BUNDLE_SUFFIX))
    return MapVersions(map_path.with_suffix(".versions"), (places_path(map_path), zones_path, *names))
