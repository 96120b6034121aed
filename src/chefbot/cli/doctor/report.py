"""`chefbot doctor`: the state of this computer as far as the robot needs it, and what to change."""

from __future__ import annotations

import os
import platform
import shutil
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rich.console import Console

from chefbot import __version__
from chefbot.cli.board.ports import serial_port_lines
from chefbot.cli.doctor.built import built_lines
from chefbot.cli.doctor.computer import (
    camera_lines,
    clock_lines,
    disk_lines,
    map_lines,
    power_lines,
    web_ui_lines,
)
from chefbot.errors import ChefbotError
from chefbot.fleet.keyring import Keyring, keys_folder
from chefbot.fleet.membership_watch import MembershipWatch
from chefbot.kernels.cache_stamp import is_complete, stamp_path
from chefbot.plural import number_of
from chefbot.ros2.tools.health import graph_lines

BUILD_FIRMWARE = "make -C firmware images"
"""Builds the firmware from source; `chefbot board flash` writes the images of the package without it."""
TOOLS = {
    "g++": "make host in firmware/, and pip install of the sources",
    "avr-g++": BUILD_FIRMWARE,
    "arm-none-eabi-g++": BUILD_FIRMWARE,
    "make": BUILD_FIRMWARE,
    "avrdude": "chefbot board flash --board mega",
    "lm4flash": "chefbot board flash --board tiva",
    "picotool": "chefbot board flash --board pico",
}
NO_PORTS: Mapping[str, str] = {}
LIBRARIES = ("numpy", "numba", "mujoco-core", "pyserial")
console = Console(highlight=False, soft_wrap=True)


def print_report(*, everything: bool, built: str = "", ports: Mapping[str, str] = NO_PORTS) -> int:
    """Print what matters of this computer and return the number of problems, marked by "!"; nothing is changed.

    With `everything` also versions of libraries, missing tools, and a udev rule for boards that are not plugged in.
    built: robot file of a built robot, whose devices are checked, too; ports: of its devices instead of the file's.
    """
    lines = [
        *_programs(everything=everything),
        *web_ui_lines(),
        *disk_lines(),
        *map_lines(Path.cwd()),
        *camera_lines(),
        *serial_port_lines(rule_without_port=everything),
        *clock_lines(),
        *power_lines(),
        *fleet_lines(),
        *graph_lines(),
        *(built_lines(built, ports) if built else ()),
    ]
    for line in lines:
        console.print(line, markup=False)
    problems = sum(line.startswith("! ") for line in lines)
    if problems:
        console.print(f"{number_of(problems, 'problem')}, marked by !")
    return problems


def fleet_lines() -> list[str]:
    """Return this machine's membership in a fleet in a line, and another one if its certificate has a problem."""
    ring = Keyring(keys_folder())
    if not ring.is_member:
        return []
    try:
        summary = MembershipWatch(ring).summary()
    except ChefbotError as error:
        return [f"! {error}"]
    warning = ring.warning(datetime.now(UTC))
    return [summary, *([f"! {warning}"] if warning else [])]


def _programs(*, everything: bool) -> list[str]:
    kernels = (
        "compiled"
        if is_complete(stamp_path())
        else "not compiled yet: the first launch takes a minute longer; `chefbot doctor kernels` compiles them"
    )
    missing = [f"{tool} (for `{use}`)" for tool, use in TOOLS.items() if shutil.which(tool) is None]
    about = f"chefbot {__version__}, Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores"
    details = [
        "libraries: " + ", ".join(f"{name} {_version(name)}" for name in LIBRARIES),
        f"not installed: {', '.join(missing)}" if missing else "all tools are installed",
    ]
    return [about, f"kernels: {kernels}", *(details if everything else [])]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"
