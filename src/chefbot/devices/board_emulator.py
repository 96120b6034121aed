"""The firmware's program for this computer, compiled for one robot: a motor board on a pty."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import chefbot
from chefbot.design.firmware_header import firmware_header
from chefbot.errors import UserError
from chefbot.robot.spec import Robot

HEADER = "robot_constants.h"
FLAGS = ("-std=c++11", "-O2", "-Wall")
PARTS = ("core", "ports/host")


def firmware_folder() -> Path:
    """The firmware's sources. UserError where this installation has none."""
    folder = Path(chefbot.__file__).parents[2] / "firmware"
    if not (folder / "core").is_dir():
        raise UserError(
            f"the firmware's sources are not beside this installation (looked for {folder}); clone the repository "
            "and install from there, with `pip install -e .`"
        )
    return folder


def emulator(robot: Robot) -> Path:
    """The program, compiled if it is not in the user's cache yet. UserError if there is no compiler."""
    folder = firmware_folder()
    header = firmware_header(robot)
    program = _cache() / f"board-{_digest(folder, header)}"
    if not program.exists():
        _compile(folder, header, program)
    return program


def _cache() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "chefbot"


def _sources(folder: Path) -> list[Path]:
    return [
        path for part in PARTS for path in sorted((folder / part).iterdir()) if path.suffix in (".cpp", ".h")
    ]


def _digest(folder: Path, header: str) -> str:
    whole = hashlib.sha256(" ".join([header, *FLAGS]).encode())
    for path in _sources(folder):
        whole.update(path.name.encode() + path.read_bytes())
    return whole.hexdigest()[:16]


def _compile(folder: Path, header: str, program: Path) -> None:
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        raise UserError("the board's program needs a C++ compiler: `sudo apt-get install g++`")
    program.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=program.parent) as made:
        (Path(made) / HEADER).write_text(header)
        new = Path(made) / "board"
        paths = [f"-I{folder / part}" for part in PARTS]
        sources = [str(path) for path in _sources(folder) if path.suffix == ".cpp"]
        command = [compiler, *FLAGS, *paths, f"-I{made}", *sources, "-lutil", "-o", str(new)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise UserError(f"the board's program does not compile: {done.stderr.strip()[-500:]}")
        new.replace(program)
