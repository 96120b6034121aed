"""Somebody's URDF or xacro file: read without trusting it, expanded, and its meshes looked for."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

from chefbot.config import read_bytes
from chefbot.design.urdf_check import Branch, check_urdf, mesh_names, parse_xml
from chefbot.design.urdf_xacro import XACRO
from chefbot.errors import UserError

MAX_BYTES = 10_000_000
EXPANSION_SECONDS = 20.0
EXPANSION_BYTES = 1_000_000_000
"""Of memory: a macro that calls itself would take all there is."""
MAX_INCLUDES = 30
EXPAND = """
import resource, sys, xml.parsers.expat
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]),) * 2)
import xacro
try:
    text = xacro.process_file(sys.argv[1]).toxml()
except RecursionError:
    sys.exit("a macro or an include calls itself without end")
except MemoryError:
    sys.exit("it needs too much memory")
except Exception as error:
    cause = getattr(error, "exc", None)  # what xacro met, which may have no words
    sys.exit(f"{'' if cause is None or str(cause) else type(cause).__name__} {error}".strip() or type(error).__name__)
sys.stdout.buffer.write(text.encode())
"""
"""Runs in a process of its own: xacro evaluates what the file says, and may never end."""
_FIND = re.compile(r"^\$\(find ([^)]+)\)/(.+)$")


def check_given(path: Path) -> list[Branch]:
    """The tree of links of a URDF or xacro file; UserError with its first fault."""
    root = expanded(path)
    where = f"robot description {path}"
    tree = check_urdf(root, where)
    for name in mesh_names(root):
        _check_mesh(name, path, where)
    return tree


def expanded(path: Path) -> ET.Element:
    """The URDF that the file is, or that xacro makes of it."""
    root = _read(path)
    if path.suffix != ".xacro" and not any(_in_xacro(element) for element in root.iter()):
        return root
    _check_includes(path, root, (), set())
    return parse_xml(_expand(path), f"robot description {path}, expanded by xacro")


def _read(path: Path) -> ET.Element:
    return parse_xml(read_bytes(path, "robot description", MAX_BYTES), f"robot description {path}")


def _in_xacro(element: ET.Element) -> bool:
    return isinstance(element.tag, str) and element.tag.startswith(f"{{{XACRO}}}")


def _check_includes(path: Path, root: ET.Element, line: tuple[Path, ...], done: set[Path]) -> None:
    """UserError where a file includes itself over some others, or one is harmful. A name with variables in it
    and a file that is missing are left to xacro: the include may stand below a condition."""
    line = (*line, path.resolve())
    if len(line) > MAX_INCLUDES:
        raise UserError(f"robot description {path}: includes are nested more than {MAX_INCLUDES} deep")
    for include in root.iter(f"{{{XACRO}}}include"):
        name = include.get("filename", "")
        file = _named(name, path)
        if file is None or not file.is_file() or file.resolve() in done:
            continue
        if file.resolve() in line:
            raise UserError(
                f"robot description {path}: {name} includes, over some files, itself; end the circle"
            )
        _check_includes(file, _read(file), line, done)
    done.add(path.resolve())


def _named(name: str, path: Path) -> Path | None:
    """The file that an include in `path` means; None where only xacro can tell."""
    found = _FIND.match(name)
    if found:
        return _package(found[1], path, f"robot description {path}") / found[2]
    name = name.replace("$(dirname)", str(path.resolve().parent))
    return None if "$" in name or "*" in name or not name else path.parent / name


def _expand(path: Path) -> bytes:
    if find_spec("xacro") is None:
        raise UserError(f"robot description {path} is xacro, which is not installed; `pip install xacro`")
    try:
        done = subprocess.run(
            [sys.executable, "-c", EXPAND, str(path), str(EXPANSION_BYTES)],
            capture_output=True, timeout=EXPANSION_SECONDS, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise UserError(
            f"robot description {path}: xacro was not done after {EXPANSION_SECONDS:g} s"
        ) from None
    if done.returncode != 0:
        reason = " ".join(done.stderr.decode(errors="replace").split())[-300:] or "it crashed"
        raise UserError(f"robot description {path}: xacro cannot expand it: {reason}")
    return done.stdout


def _check_mesh(name: str, path: Path, where: str) -> None:
    """UserError unless the mesh is a readable file with something in it."""
    file = _mesh_file(name, path, where)
    try:
        if file.exists() and (not file.is_file() or file.stat().st_size == 0):  # a pipe would be waited for
            raise UserError(f"{where}: mesh {name} is no file, or an empty one")
        file.open("rb").close()
    except FileNotFoundError:
        raise UserError(f"{where}: mesh {name} does not exist (looked for {file})") from None
    except (OSError, ValueError) as error:  # links that run in a circle, names with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"{where}: mesh {name} cannot be read: {reason}") from None


def _mesh_file(name: str, path: Path, where: str) -> Path:
    parts = urlsplit(name)
    if parts.scheme == "package":
        return _package(parts.netloc, path, where) / unquote(parts.path.lstrip("/"))
    if parts.scheme == "file":
        return Path(unquote(parts.path))
    if parts.scheme:
        raise UserError(f"{where}: mesh {name}: only package:// and file:// can be looked up")
    return path.parent / name


def _package(name: str, path: Path, where: str) -> Path:
    """The folder of a ROS package: one above the file, or one that ROS's variables name."""
    above = [folder for folder in path.resolve().parents if _is_package(folder, name)]
    installed = [Path(p) / "share" / name for p in os.environ.get("AMENT_PREFIX_PATH", "").split(":") if p]
    found = [*above, *(folder for folder in installed if folder.is_dir())]
    if not found:
        raise UserError(f"{where}: package {name} is not found; put the file into that package's folder")
    return found[0]


def _is_package(folder: Path, name: str) -> bool:
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return folder.name == name
    named = parse_xml(read_bytes(manifest, "package manifest"), f"package manifest {manifest}").findtext(
        "name", ""
    )
    return named.strip() == name
