"""Versions of the files beside a map: each change keeps what was there before, so that it can be taken back."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Sequence
from pathlib import Path

from chefbot.storage.atomic_files import StorageError, os_errors_as_storage_errors, write_atomic

MAX_VERSIONS = 50
"""Number of versions that are kept, the newest."""
SEAL = "written.sha256"
"""File of a version with the hashes of what the change after it wrote."""
CHANGED_BY_HAND = (
    "The files of places and zones were changed by hand since the last change here, so it is not taken back"
)


class MapVersions:
    """Keeps copies of `files` in numbered folders of `folder`; a file that did not exist has no copy."""

    def __init__(self, folder: Path, files: Sequence[Path]) -> None:
        self._folder, self._files = folder, files

    def __len__(self) -> int:
        return len(self._numbers())

    def keep(self) -> None:
        """Copy the files before a change. Raises StorageError if that fails; the change should not happen then."""
        numbers = self._numbers()
        version = self._folder / f"{max(numbers, default=0) + 1:06d}"
        incomplete = self._folder / "incomplete"  # a version that lacks a file would delete it
        with os_errors_as_storage_errors(self._folder):
            if incomplete.exists():
                shutil.rmtree(incomplete)
            incomplete.mkdir(parents=True)
            for file in self._files:
                if file.is_file():
                    write_atomic(incomplete / file.name, file.read_bytes())
            incomplete.rename(version)
        for number in numbers[: len(numbers) + 1 - MAX_VERSIONS]:
            self._remove(number)

    def seal(self) -> None:
        """Note what the files are after the change, so that one by hand in the meantime is not overwritten."""
        write_atomic(self._newest() / SEAL, self._digest())

    def restore(self) -> bool:
        """Bring the newest version back and forget it; False if there is none.

        Raises StorageError if the files were changed by others since.
        """
        numbers = self._numbers()
        if not numbers:
            return False
        seal = self._newest() / SEAL
        if seal.is_file() and seal.read_bytes() != self._digest():
            raise StorageError(CHANGED_BY_HAND)
        version = self._folder / f"{numbers[-1]:06d}"
        for file in self._files:
            with os_errors_as_storage_errors(file):
                if (version / file.name).is_file():
                    write_atomic(file, (version / file.name).read_bytes())
                else:
                    file.unlink(missing_ok=True)
        self._remove(numbers[-1])
        return True

    def _newest(self) -> Path:
        return self._folder / f"{self._numbers()[-1]:06d}"

    def _digest(self) -> bytes:
        """Return a hash of the files as they are now."""
        contents = [file.read_bytes() if file.is_file() else b"" for file in self._files]
        return "".join(hashlib.sha256(content).hexdigest() for content in contents).encode()

    def _remove(self, number: int) -> None:
        version = self._folder / f"{number:06d}"
        with os_errors_as_storage_errors(version):
            shutil.rmtree(version)

    def _numbers(self) -> list[int]:
        if not self._folder.is_dir():
            return []
        return sorted(int(path.name) for path in self._folder.iterdir() if path.name.isdecimal())
