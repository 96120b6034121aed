"""`chefbot board flash`: flash the firmware, with the robot filled in, to the motor board."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from chefbot.cli.board.image import firmware_image
from chefbot.devices.serial_ports import BOARD_VENDORS, ports
from chefbot.errors import UserError
from chefbot.robot.sensors import AUTO
from chefbot.storage.atomic_files import write_into_folder

console = Console(highlight=False, soft_wrap=True)


class FlashingTool(NamedTuple):
    """The program that writes the firmware to one kind of board."""

    name: str
    installation: str
    arguments: str
    """Separated by spaces; {image} and {port} are replaced."""


TOOLS = {
    "mega": FlashingTool(
        "avrdude",
        "sudo apt-get install avrdude",
        "-p atmega2560 -c wiring -b 115200 -P {port} -D -U flash:w:{image}:i",
    ),
    "tiva": FlashingTool("lm4flash", "sudo apt-get install lm4flash", "-v {image}"),
    "pico": FlashingTool(
        "picotool",
        "install the package picotool where your distribution has one, or hold BOOTSEL while plugging the Pico in "
        "and copy the file to the drive that appears",
        "load -v -x {image}",
    ),
}


def run_flash(board: str, robot: str, port: str, program: Path | None) -> int:
    """Flash the firmware with the robot filled in; returns the tool's exit code.

    program: a program that was compiled by oneself; None: that of the package. Raises UserError for an unknown board,
    a missing tool, or a program that is not one.
    """
    image = firmware_image(board, robot, program)
    path = _cache() / "firmware" / image.file_name
    write_into_folder(path, image.data)
    tool = TOOLS[image.board]
    if shutil.which(tool.name) is None:
        raise UserError(f"{tool.name} is not installed: {tool.installation}; the firmware is {path}")
    values = {"image": str(path), "port": _port(port) if "{port}" in tool.arguments else ""}
    command = [tool.name, *(argument.format(**values) for argument in tool.arguments.split())]
    console.print(" ".join(command), markup=False)
    return subprocess.run(command).returncode


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
