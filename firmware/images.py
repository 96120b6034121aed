"""Puts the compiled programs into the Python package: `python images.py build/mega.bin ...`.

Beside them, `images.json` says which sources and compilers they are of, so that old ones are noticed.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

FIRMWARE = Path(__file__).resolve().parent
TARGET = FIRMWARE.parent / "src" / "chefbot" / "board" / "images"
FOLDERS = ("core", "ports/arduino_mega", "ports/arm", "ports/pico", "ports/tiva_launchpad")
COMPILERS = ("avr-g++", "arm-none-eabi-g++")


def sources() -> list[Path]:
    """Everything that the programs are made of, the flags of the compiler as well."""
    inside = [path for folder in FOLDERS for path in (FIRMWARE / folder).iterdir() if path.is_file()]
    return [*sorted(inside), *sorted((FIRMWARE / "ports").glob("*.h")), FIRMWARE / "Makefile"]


def sources_digest() -> str:
    """SHA-256 of the sources."""
    digest = hashlib.sha256()
    for path in sources():
        digest.update(path.relative_to(FIRMWARE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def compiler_versions() -> dict[str, str]:
    """The first line of each compiler's version."""
    outputs = {name: subprocess.check_output([name, "--version"], text=True) for name in COMPILERS}
    return {name: output.splitlines()[0] for name, output in outputs.items()}


if __name__ == "__main__":
    TARGET.mkdir(exist_ok=True)
    for program in map(Path, sys.argv[1:]):
        (TARGET / program.name).write_bytes(program.read_bytes())
    made_of = {"sources": sources_digest(), "compilers": compiler_versions()}
    (TARGET / "images.json").write_text(json.dumps(made_of, indent=2) + "\n")
