"""Compiles the board for this computer into a shared library: `python build.py LIBRARY`.

The package's build calls it (hatch_build.py), and the simulator of a checkout whose firmware has changed. Standard
library only, as neither has chefbot installed.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PORT = Path(__file__).resolve().parent
CORE = PORT.parents[1] / "core"
FLAGS = ("-std=c++11", "-O2", "-fPIC", "-shared", "-s")
ONE_FILE = ("-static-libstdc++", "-static-libgcc")
"""Then the library asks of the computer that runs it for no more than a C library."""


def sources() -> list[Path]:
    """Everything that the library is made of, headers as well."""
    return [
        *sorted(CORE.glob("*.cpp")),
        *sorted(CORE.glob("*.h")),
        *sorted(PORT.glob("*.cpp")),
        *sorted(PORT.glob("*.h")),
    ]


def fingerprint() -> str:
    """SHA-256 of the sources; the library holds it as text, so that an old one is told."""
    digest = hashlib.sha256()
    for path in (*sources(), Path(__file__)):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def compiler() -> list[str] | None:
    """The system's C++ compiler, or the one in the Python package `ziglang`, or None."""
    if asked := os.environ.get("CXX"):
        return [*shlex.split(asked), *ONE_FILE]
    for name in ("g++", "clang++", "c++"):
        if found := shutil.which(name):
            return [found, *ONE_FILE]
    return [sys.executable, "-m", "ziglang", "c++"] if importlib.util.find_spec("ziglang") else None


def build(library: Path) -> None:
    """Write the library beside its place and rename it; RuntimeError with the compiler's words if it fails."""
    command = compiler()
    if command is None:
        raise RuntimeError("there is no C++ compiler: `sudo apt-get install g++`, or `pip install ziglang`")
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        mark, made = Path(folder, "mark.cpp"), Path(folder, library.name)
        mark.write_text(f'extern "C" const char chefbot_board_sources[] = "{fingerprint()}";\n')
        units = [*(path for path in sources() if path.suffix == ".cpp"), mark]
        folders = ("-iquote", str(CORE), "-iquote", str(PORT))  # -I would hide the C library's limits.h
        command += [*FLAGS, *folders, *map(str, units), "-o", str(made)]
        done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
        if done.returncode:
            raise RuntimeError(f"{shlex.join(command)}\n{done.stdout}{done.stderr}")
        made.replace(library)


if __name__ == "__main__":
    try:
        build(Path(sys.argv[1]))
    except (RuntimeError, OSError) as error:
        sys.exit(f"cannot compile the board's firmware for this computer: {error}")
