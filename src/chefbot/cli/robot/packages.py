"""Lookup of ROS packages on this disk for a robot description."""

from __future__ import annotations

import os
import re
from pathlib import Path

from chefbot.config import read_bytes
from chefbot.design.export.urdf_xml import parse_urdf_xml
from chefbot.errors import UserError

_NAME = re.compile(r"[A-Za-z0-9_-]+")
"""A package's name (REP 144); with dots or slashes it would lead to another folder."""


def package_folder(name: str, path: Path, where: str) -> Path:
    """Return the folder of a ROS package above the file at `path`, or in AMENT_PREFIX_PATH.

    Raises UserError if there is none; `where` begins its sentence.
    """
    if not _NAME.fullmatch(name):
        raise UserError(f"{where}: {name!r} is not a package name")
    above = [folder for folder in path.resolve().parents if _is_package(folder, name)]
    installed = [Path(p) / "share" / name for p in os.environ.get("AMENT_PREFIX_PATH", "").split(":") if p]
    found = [*above, *(folder for folder in installed if folder.is_dir())]
    if not found:
        raise UserError(f"{where}: package {name} is not found; put the file into that package's folder")
    return found[0]


def home_package(path: Path) -> Path:
    """Return the nearest folder above the file with a package.xml, else the file's own folder."""
    above = path.resolve().parents
    return next((folder for folder in above if (folder / "package.xml").is_file()), above[0])


def _is_package(folder: Path, name: str) -> bool:
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return folder.name == name
    where = f"package manifest {manifest}"
    return (
        parse_urdf_xml(read_bytes(manifest, "package manifest"), where).findtext("name", "").strip() == name
    )
