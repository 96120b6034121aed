"""The files that a robot description of a stranger may read while it is expanded."""

from __future__ import annotations

import glob
import itertools
import os
import re
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

from chefbot.cli.robot.packages import home_package, package_folder
from chefbot.config import read_bytes
from chefbot.errors import UserError

FileKind = Literal["robot description", "YAML file"]
MAX_BYTES, MAX_FILES, MAX_ALL_BYTES = 10_000_000, 500, 50_000_000
"""Limits of one file, of the number of reads, and of their sum."""
YAML_SUFFIXES = (".yaml", ".yml")
_PATTERN = re.compile(r"[*?\[]")


class GivenFile(NamedTuple):
    """The content of a file, and its path without symbolic links."""

    path: str
    data: bytes


class Files(Protocol):
    """What an expansion may request. Every method raises UserError, and `read` FileNotFoundError."""

    def read(self, name: str, kind: FileKind) -> GivenFile:
        """Read a file of the description's packages."""

    def find(self, package: str) -> str:
        """Return the folder of a package, whose files may be read from then on."""

    def match(self, pattern: str) -> list[str]:
        """Return the files of a pattern such as `parts/*.xacro`, in order."""


class PackageFiles:
    """The files of a description's own package, and of the packages that it finds by name."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._roots = {home_package(path)}
        self._number = self._bytes = 0

    def read(self, name: str, kind: FileKind) -> GivenFile:
        """Read a file. Raises UserError for one elsewhere, or too many, FileNotFoundError for none."""
        file = self._in_packages(name)
        if kind == "YAML file" and file.suffix not in YAML_SUFFIXES:
            raise UserError(f"load_yaml of {name}: only .yaml and .yml files are read")
        if not os.path.exists(file):  # noqa: PTH110 - Path's method raises for names that no file can have
            raise FileNotFoundError(f"No such file or directory: {name}")
        data = read_bytes(file, kind, MAX_BYTES)
        self._number, self._bytes = self._number + 1, self._bytes + len(data)
        if self._number > MAX_FILES or self._bytes > MAX_ALL_BYTES:
            raise UserError(
                f"it reads more than {MAX_FILES} files, or {MAX_ALL_BYTES} bytes; that is not a robot"
            )
        return GivenFile(str(file), data)

    def find(self, package: str) -> str:
        """Return a package's folder. Raises UserError if it is not found."""
        folder = package_folder(package, self._path, f"$(find {package})")
        if folder.joinpath("package.xml").is_file():
            self._roots.add(folder.resolve())
        return str(folder)

    def match(self, pattern: str) -> list[str]:
        """Return the files of a pattern. Raises UserError for one that begins elsewhere."""
        fixed = itertools.takewhile(lambda part: not _PATTERN.search(part), Path(pattern).parts)
        self._in_packages(str(Path(*fixed)), pattern)
        return sorted(itertools.islice(glob.iglob(pattern), MAX_FILES + 1))  # noqa: PTH207 - as xacro does it

    def _in_packages(self, name: str, shown: str = "") -> Path:
        try:
            file = Path(name).resolve()
        except (OSError, ValueError, RuntimeError) as error:  # a null character; links in a circle
            raise UserError(f"{name!r:.80} cannot be read: {error}") from None
        if not any(file.is_relative_to(root) for root in self._roots):
            places = ", ".join(sorted(map(str, self._roots)))
            raise UserError(
                f"{shown or name} lies outside {places}; a check reads only the description's own package:"
                " put the file there, or a package.xml above both"
            )
        return file
