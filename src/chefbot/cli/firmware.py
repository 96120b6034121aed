"""`chefbot firmware header` and `chefbot flash`: the robot's numbers into a board."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

import chefbot
from chefbot.cli.describe import deliver
from chefbot.design.export.firmware_header import firmware_header
from chefbot.devices.board_ports import BOARD_VENDORS, ports
from chefbot.devices.serial_connection import AUTO
from chefbot.errors import UserError, name_hint
from chefbot.robot.load import load_robot

console = Console(highlight=False, soft_wrap=True)


class Target(NamedTuple):
    """How one kind of board gets its program."""

    make: str
    program: str
    compiler: str
    compiler_packages: str
    tool: str
    tool_packages: str
    arguments: tuple[str, ...]
    """{program} and {port} are put in."""


TARGETS = {
    "mega": Target(
        "mega.elf",
        "mega.hex",
        "avr-g++",
        "gcc-avr avr-libc binutils-avr",
        "avrdude",
        "sudo apt-get install avrdude",
        (
            "-p",
            "atmega2560",
            "-c",
            "wiring",
            "-b",
            "115200",
            "-P",
            "{port}",
            "-D",
            "-U",
            "flash:w:{program}:i",
        ),
    ),
    "tiva": Target(
        "tiva.elf",
        "tiva.bin",
        "arm-none-eabi-g++",
        "gcc-arm-none-eabi",
        "lm4flash",
        "sudo apt-get install lm4flash",
        ("-v", "{program}"),
    ),
    "pico": Target(
        "pico.elf",
        "pico.uf2",
        "arm-none-eabi-g++",
        "gcc-arm-none-eabi",
        "picotool",
        "take the package picotool where your distribution has one, or hold BOOTSEL while plugging the Pico in and "
        "copy the file to the drive that appears",
        ("load", "-v", "-x", "{program}"),
    ),
}


def run_header(robot: str, out: Path | None) -> None:
    """The robot's constants as the C header that the firmware is compiled with."""
    deliver(firmware_header(load_robot(robot)), out)


def run_flash(board: str, robot: str, port: str) -> int:
    """Compile for the robot and write it to the board; the tool's exit code."""
    target = TARGETS.get(board)
    if target is None:
        raise UserError(f"no board is called {board!r}{name_hint(board, TARGETS)}")
    load_robot(robot)  # its faults are told before the compiler's
    program = _compiled(target, robot)
    if shutil.which(target.tool) is None:
        raise UserError(f"{target.tool} is not installed: {target.tool_packages}; the program is {program}")
    known = {"program": str(program), "port": _port(port) if "{port}" in " ".join(target.arguments) else ""}
    command = [target.tool, *(argument.format(**known) for argument in target.arguments)]
    console.print(" ".join(command), markup=False)
    return subprocess.run(command).returncode


def _compiled(target: Target, robot: str) -> Path:
    folder = firmware_folder()
    for tool, packages in (("make", "make"), (target.compiler, target.compiler_packages)):
        if shutil.which(tool) is None:
            raise UserError(f"{tool} is not installed: sudo apt-get install {packages}")
    named = str(Path(robot).resolve()) if Path(robot).exists() else robot
    made = _cache() / "firmware"
    command = ["make", "-s", "-C", str(folder), f"BUILD={made}", f"ROBOT={named}", f"PYTHON={sys.executable}"]
    command.append(str(made / target.make))
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise UserError(f"the firmware does not compile: {(done.stderr or done.stdout).strip()[-500:]}")
    return made / target.program


def firmware_folder() -> Path:
    """The firmware's sources: an installed package carries them, a checkout has them beside it. UserError."""
    package = Path(chefbot.__file__).parent
    for folder in (package / "_firmware", package.parents[1] / "firmware"):
        if (folder / "core").is_dir():
            return folder
    raise UserError(f"the firmware's sources are missing in {package}: install chefbot again")


def _cache() -> Path:
    """Where a user's programs keep what they can make again."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home).resolve() / "chefbot"


def _port(wanted: str) -> str:
    if wanted != AUTO:
        return wanted
    likely = [port.path for port in ports() if port.vendor in BOARD_VENDORS]
    if len(likely) != 1:
        raise UserError(f"say --port; boards may be at: {', '.join(likely) or 'no port'}")
    return likely[0]
