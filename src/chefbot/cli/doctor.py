"""`chefbot doctor`: what of this computer matters to the robot, and what to do about it."""

from __future__ import annotations

import getpass
import os
import platform
import shutil
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rich.console import Console

from chefbot import __version__
from chefbot.devices.board_ports import BOARD_VENDORS, Port, ports
from chefbot.kernels.cache_stamp import is_complete, stamp_path
from chefbot.ros2.tools.health import graph_lines

try:
    import grp
except ImportError:  # Windows, where ports belong to nobody
    grp = None  # type: ignore[assignment]

RULES = Path("/etc/udev/rules.d/60-chefbot.rules")
"""Before 73-seat-late.rules, which gives what is tagged uaccess to whoever sits at the computer."""
BOARDS = {
    "Arduino Mega 2560": (0x2341, 0x0042),
    "Tiva Launchpad": (0x1CBE, 0x00FD),
    "Raspberry Pi Pico": (0x2E8A, 0x000A),
    "FTDI cable": (0x0403, 0x6001),
    "CP210x cable": (0x10C4, 0xEA60),
    "CH340 cable": (0x1A86, 0x7523),
}
"""USB numbers (http://www.linux-usb.org/usb.ids) of what a motor board is plugged in with."""
TOOLS = {
    "g++": "make host in firmware/, and pip install of the sources",
    "avr-g++": "chefbot flash --board mega",
    "arm-none-eabi-g++": "chefbot flash --board tiva or pico",
    "make": "chefbot flash",
    "avrdude": "chefbot flash --board mega",
    "lm4flash": "chefbot flash --board tiva",
    "picotool": "chefbot flash --board pico",
}
LIBRARIES = ("numpy", "numba", "mujoco-core", "pyserial")
console = Console(highlight=False, soft_wrap=True)


def run_doctor() -> None:
    """Everything in a few lines; nothing is changed."""
    for sentence in (*_programs(), "", *_serial_ports(), "", *graph_lines()):
        console.print(sentence, markup=False)


def _programs() -> list[str]:
    kernels = (
        "compiled"
        if is_complete(stamp_path())
        else "not compiled yet: the first launch takes a minute longer"
    )
    missing = [f"{tool} (for `{use}`)" for tool, use in TOOLS.items() if shutil.which(tool) is None]
    return [
        f"chefbot {__version__}, Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores",
        "libraries: " + ", ".join(f"{name} {_version(name)}" for name in LIBRARIES),
        f"kernels: {kernels}",
        f"not installed: {', '.join(missing)}" if missing else "all tools are installed",
    ]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "is missing"


def _serial_ports() -> list[str]:
    found = ports()
    if not found:
        return ["serial ports: none has anything plugged in", *_rule([])]
    told = [f"  {port.path}: {port.description}{_vendor(port)}; {_permission(port.path)}" for port in found]
    boards = [port for port in found if port.vendor in BOARD_VENDORS]
    wanted = not boards or any(not _may_open(port.path) for port in found)
    return ["serial ports:", *told, *(_rule(boards) if wanted else [])]


def _vendor(port: Port) -> str:
    if port.vendor is None or port.product is None:
        return ""
    maker = BOARD_VENDORS.get(port.vendor, "no board that is known")
    return f" [{port.vendor:04x}:{port.product:04x}, {maker}]"


def _may_open(path: str) -> bool:
    return os.access(path, os.R_OK | os.W_OK)


def _permission(path: str) -> str:
    user = getpass.getuser()
    if grp is None or _may_open(path):
        return f"{user} may open it"
    try:
        group = grp.getgrgid(Path(path).stat().st_gid).gr_name
    except (OSError, KeyError):
        return f"{user} may not open it"
    mine = [grp.getgrgid(number).gr_name for number in os.getgroups()]
    hint = (
        "log out and in again" if group in mine else f"sudo usermod -aG {group} {user}, then log out and in"
    )
    return f"{user} may not open it; it belongs to group {group}: the rule below, or {hint}"


def _rule(boards: list[Port]) -> list[str]:
    """A rule for the boards that were found, or for those that are known; never a port that all may write."""
    if sys.platform != "linux":
        return []
    numbers = {port.description: (port.vendor, port.product) for port in boards} or BOARDS
    rules = [
        f'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{vendor:04x}", ATTRS{{idProduct}}=="{product:04x}", '
        f'MODE="0660", GROUP="dialout", TAG+="uaccess", ENV{{ID_MM_DEVICE_IGNORE}}="1"'
        for vendor, product in numbers.values()
    ]
    return [
        "",
        f"Rule for {RULES}, so that members of dialout and whoever is logged in at this computer may open the board, "
        "and ModemManager leaves it alone:",
        *rules,
        "Then: sudo udevadm control --reload && sudo udevadm trigger, and plug the board in again.",
    ]
