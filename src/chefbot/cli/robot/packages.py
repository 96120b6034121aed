"""ROS packages on this disk, as far as a robot description needs them."""

from __future__ import annotations

import os
from pathlib import Path

from chefbot.config import read_bytes
from chefbot.design.export.urdf_check import parse_xml
from chefbot.errors import UserError


def package_folder(name: str, path: Path, where: str) -> Path:
    """The folder of a ROS package: one above the file at `path`, or one that ROS's variables name."""
    above = [folder for folder in path.resolve().parents if _is_package(folder, name)]
    installed = [Path(p) / "share" / name for p in os.environ.get("AMENT_PREFIX_PATH", "").split(":") if p]
    found = [*above, *(folder for folder in installed if folder.is_dir())]
    if not found:
        raise UserError(f"{where}: package {name} is not found; put the file into that package's folder")
    return found[0]


def home_package(path: Path) -> Path:
    """The nearest folder above the file with a package.xml; the file's own folder where there is none."""
    above = path.resolve().parents
    return next((folder for folder in above if (folder / "package.xml").is_file()), above[0])


def _is_package(folder: Path, name: str) -> bool:
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return folder.name == name
    where = f"package manifest {manifest}"
    return parse_xml(read_bytes(manifest, "package manifest"), where).findtext("name", "").strip() == name
