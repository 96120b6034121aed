"""`chefbot board flash`: compile the firmware for a robot and flash it to its motor board."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

import chefbot
from chefbot.cli.board.board_kind import board_kind
from chefbot.devices.serial_ports import BOARD_VENDORS, ports
from chefbot.errors import UserError
from chefbot.robot.load import built_in_robots, find_robot, load_robot
from chefbot.robot.sensors import AUTO

console = Console(highlight=False, soft_wrap=True)


class Target(NamedTuple):
    """How the firmware for one kind of board is compiled and flashed."""

    make: str
    program: str
    compiler: str
    compiler_packages: str
    tool: str
    tool_packages: str
    arguments: str
    """Arguments of the tool, separated by spaces; {program} and {port} are replaced."""


TARGETS = {
    "mega": Target(
        "mega.elf",
        "mega.hex",
        "avr-g++",
        "gcc-avr avr-libc binutils-avr",
        "avrdude",
        "sudo apt-get install avrdude",
        "-p atmega2560 -c wiring -b 115200 -P {port} -D -U flash:w:{program}:i",
    ),
    "tiva": Target(
        "tiva.elf",
        "tiva.bin",
        "arm-none-eabi-g++",
        "gcc-arm-none-eabi",
        "lm4flash",
        "sudo apt-get install lm4flash",
        "-v {program}",
    ),
    "pico": Target(
        "pico.elf",
        "pico.uf2",
        "arm-none-eabi-g++",
        "gcc-arm-none-eabi",
        "picotool",
        "install the package picotool where your distribution has one, or hold BOOTSEL while plugging the Pico in "
        "and copy the file to the drive that appears",
        "load -v -x {program}",
    ),
}


def run_flash(board: str, robot: str, port: str) -> int:
    """Compile the firmware for the robot and flash it; returns the tool's exit code.

    Raises UserError for an unknown board, a missing tool, or a program that does not compile.
    """
    target = TARGETS[board_kind(board, load_robot(robot))]  # its errors are reported before the compiler's
    program = _compiled(target, robot)
    if shutil.which(target.tool) is None:
        raise UserError(f"{target.tool} is not installed: {target.tool_packages}; the program is {program}")
    values = {"program": str(program), "port": _port(port) if "{port}" in target.arguments else ""}
    command = [target.tool, *(argument.format(**values) for argument in target.arguments.split())]
    console.print(" ".join(command), markup=False)
    return subprocess.run(command).returncode


def _compiled(target: Target, robot: str) -> Path:
    folder = firmware_folder()
    for tool, packages in (("make", "make"), (target.compiler, target.compiler_packages)):
        if shutil.which(tool) is None:
            raise UserError(f"{tool} is not installed: sudo apt-get install {packages}")
    # make runs in another folder; a folder here may have a built-in robot's name
    robot_argument = robot if robot in built_in_robots() else str(find_robot(robot).resolve())
    build_folder = _cache() / "firmware"
    command = [
        "make",
        "-s",
        "-C",
        str(folder),
        f"BUILD={build_folder}",
        f"ROBOT={robot_argument}",
        f"PYTHON={sys.executable}",
    ]
    command.append(str(build_folder / target.make))
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != 0:
        raise UserError(f"the firmware does not compile: {(result.stderr or result.stdout).strip()[-500:]}")
    return build_folder / target.program


def firmware_folder() -> Path:
    """Return the folder of the firmware's sources, in an installed package or in a checkout.

    Raises UserError if they are missing.
    """
    package = Path(chefbot.__file__).parent
    for folder in (package / "_firmware", package.parents[1] / "firmware"):
        if (folder / "core").is_dir():
            return folder
    raise UserError(f"the firmware's sources are missing in {package}: install chefbot again")


def _cache() -> Path:
    """Return the user's cache folder of chefbot."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home).resolve() / "chefbot"


def _port(requested: str) -> str:
    if requested != AUTO:
        return requested
    likely = [port.path for port in ports() if port.vendor in BOARD_VENDORS]
    if len(likely) != 1:
        raise UserError(f"give --port; boards may be at: {', '.join(likely) or 'no port'}")
    return likely[0]
