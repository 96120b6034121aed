"""Check of an untrusted URDF or xacro file: it is parsed, expanded, and its meshes are looked up."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import unquote, urlsplit

from chefbot.cli.robot.foreign.xacro_files import MAX_BYTES
from chefbot.cli.robot.foreign.xacro_process import expand
from chefbot.cli.robot.packages import package_folder
from chefbot.config import read_bytes
from chefbot.design.export.urdf_check import Branch, check_urdf, mesh_names
from chefbot.design.export.urdf_xacro import XACRO
from chefbot.design.export.urdf_xml import parse_urdf_xml
from chefbot.errors import UserError


def check_given(path: Path) -> list[Branch]:
    """Return the tree of links of a URDF or xacro file. Raises UserError with its first fault."""
    root = expanded(path)
    where = f"robot description {path}"
    tree = check_urdf(root, where)
    for name in mesh_names(root):
        _check_mesh(name, path, where)
    return tree


def expanded(path: Path) -> ET.Element:
    """Return the URDF in the file, expanded by xacro if necessary."""
    root = _read(path)
    if path.suffix != ".xacro" and not any(_in_xacro(element) for element in root.iter()):
        return root
    return parse_urdf_xml(expand(path), f"robot description {path}, expanded by xacro")


def _read(path: Path) -> ET.Element:
    return parse_urdf_xml(read_bytes(path, "robot description", MAX_BYTES), f"robot description {path}")


def _in_xacro(element: ET.Element) -> bool:
    return isinstance(element.tag, str) and element.tag.startswith(f"{{{XACRO}}}")


def _check_mesh(name: str, path: Path, where: str) -> None:
    """Raise UserError unless the mesh is a readable file that is not empty."""
    file = _mesh_file(name, path, where)
    try:
        if file.exists() and (not file.is_file() or file.stat().st_size == 0):  # opening a pipe would block
            raise UserError(f"{where}: mesh {name} is not a file, or is empty")
        file.open("rb").close()
    except FileNotFoundError:
        raise UserError(f"{where}: mesh {name} does not exist (looked for {file})") from None
    except (OSError, ValueError) as error:  # circular links, names with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"{where}: mesh {name} cannot be read: {reason}") from None


def _mesh_file(name: str, path: Path, where: str) -> Path:
    parts = urlsplit(name)
    if parts.scheme == "package":
        return package_folder(parts.netloc, path, where) / unquote(parts.path.lstrip("/"))
    if parts.scheme == "file":
        return Path(unquote(parts.path))
    if parts.scheme:
        raise UserError(f"{where}: mesh {name}: only package:// and file:// can be looked up")
    return path.parent / name
