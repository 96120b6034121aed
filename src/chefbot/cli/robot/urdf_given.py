"""Check of an untrusted URDF or xacro file: it is parsed, expanded, and its meshes are looked up."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

from chefbot.cli.robot.packages import package_folder
from chefbot.config import read_bytes
from chefbot.design.export.urdf_check import Branch, check_urdf, mesh_names, parse_xml
from chefbot.design.export.urdf_xacro import XACRO
from chefbot.errors import UserError

MAX_BYTES = 10_000_000
EXPANSION_SECONDS = 20.0
EXPANSION_BYTES = 1_000_000_000
"""Memory limit: a recursive macro would otherwise exhaust it."""
CHILD = "chefbot.cli.robot.xacro_child"
"""Module of the separate process, since an expansion may not terminate. It is run with -P, so that a file
xacro.py in the current folder is not imported."""


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
    return parse_xml(_expand(path), f"robot description {path}, expanded by xacro")


def _read(path: Path) -> ET.Element:
    return parse_xml(read_bytes(path, "robot description", MAX_BYTES), f"robot description {path}")


def _in_xacro(element: ET.Element) -> bool:
    return isinstance(element.tag, str) and element.tag.startswith(f"{{{XACRO}}}")


def _expand(path: Path) -> bytes:
    if find_spec("xacro") is None:
        raise UserError(f"robot description {path} is xacro, which is not installed; `pip install xacro`")
    try:
        result = subprocess.run(
            [sys.executable, "-P", "-m", CHILD, str(path), str(EXPANSION_BYTES)],
            capture_output=True, timeout=EXPANSION_SECONDS, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise UserError(
            f"robot description {path}: xacro had not finished after {EXPANSION_SECONDS:g} s"
        ) from None
    if result.returncode != 0:
        reason = " ".join(result.stderr.decode(errors="replace").split())[-300:] or "it crashed"
        raise UserError(f"robot description {path}: xacro cannot expand it: {reason}")
    return result.stdout


def _check_mesh(name: str, path: Path, where: str) -> None:
    """Raise UserError unless the mesh is a readable file that is not empty."""
    file = _mesh_file(name, path, where)
    try:
        if file.exists() and (not file.is_file() or file.stat().st_size == 0):  # opening a pipe would block
            raise UserError(f"{where}: mesh {name} is no file, or is empty")
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
