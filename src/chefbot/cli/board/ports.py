"""`chefbot board find`: the serial ports of this computer, their permissions, and a udev rule."""

from __future__ import annotations

import getpass
import os
import sys
from pathlib import Path

from rich.console import Console

from chefbot.devices.serial_ports import BOARD_VENDORS, Port, lasting_path, ports

try:
    import grp
except ImportError:  # Windows has no groups of ports
    grp = None  # type: ignore[assignment]

RULES = Path("/etc/udev/rules.d/60-chefbot.rules")
"""Its number must be below 73: 73-seat-late.rules evaluates the tag uaccess."""
BOARDS = {
    "Arduino Mega 2560": (0x2341, 0x0042),
    "Tiva Launchpad": (0x1CBE, 0x00FD),
    "Raspberry Pi Pico": (0x2E8A, 0x000A),
    "FTDI cable": (0x0403, 0x6001),
    "CP210x cable": (0x10C4, 0xEA60),
    "CH340 cable": (0x1A86, 0x7523),
}
"""USB vendor and product ids (http://www.linux-usb.org/usb.ids) of boards and serial converters."""
console = Console(highlight=False, soft_wrap=True, markup=False)


def print_serial_ports() -> None:
    """Print the serial ports, and a udev rule where no board can be opened."""
    for line in serial_port_lines():
        console.print(line)


def serial_port_lines(*, rule_without_port: bool = True) -> list[str]:
    """Return sentences about the serial ports, with a udev rule where no board can be opened."""
    found = ports()
    if not found:
        return ["serial ports: no device is plugged in", *(_rule([]) if rule_without_port else [])]
    lines = [
        f"  {port.path}: {port.description}{_vendor(port)}; {_permission(port.path)}{_lasting(port, found)}"
        for port in found
    ]
    boards = [port for port in found if port.vendor in BOARD_VENDORS]
    needs_rule = not boards or any(not _may_open(port.path) for port in found)
    return ["serial ports:", *lines, *(_rule(boards) if needs_rule else [])]


def _lasting(port: Port, found: list[Port]) -> str:
    link = lasting_path(port, found)
    return f"; always {link}" if link else ""


def _vendor(port: Port) -> str:
    if port.vendor is None or port.product is None:
        return ""
    maker = BOARD_VENDORS.get(port.vendor, "not a known board")
    return f" [{port.vendor:04x}:{port.product:04x}, {maker}]"


def _may_open(path: str) -> bool:
    return os.access(path, os.R_OK | os.W_OK)


def _permission(path: str) -> str:
    user = _user()
    if grp is None or _may_open(path):
        return f"{user} may open it"
    try:
        group = grp.getgrgid(Path(path).stat().st_gid)
    except (OSError, KeyError):
        return f"{user} may not open it"
    belongs = f"{user} may not open it; it belongs to group {group.gr_name}"
    if group.gr_gid in os.getgroups():
        return f"{belongs}, whose members may not either: the rule below"
    # A member of the group whose session began before: its processes do not have the group yet
    is_member = user in group.gr_mem
    hint = "log out and in again"
    if not is_member:
        hint = f"sudo usermod -aG {group.gr_name} {user}, then log out and in"
    return f"{belongs}: the rule below, or {hint}"


def _user() -> str:
    """Return the user's name, or the number of one without a name, as in a container."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def _rule(boards: list[Port]) -> list[str]:
    """Return a udev rule for the boards found, else for all known ones; no port gets writable for all users."""
    if sys.platform != "linux":
        return []
    found = [
        (port.vendor, port.product) for port in boards if port.vendor is not None and port.product is not None
    ]
    rules = [
        f'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{vendor:04x}", ATTRS{{idProduct}}=="{product:04x}", '
        f'MODE="0660", GROUP="dialout", TAG+="uaccess", ENV{{ID_MM_DEVICE_IGNORE}}="1"'
        for vendor, product in dict.fromkeys(found or BOARDS.values())
    ]
    return [
        "",
        f"Rule for {RULES}, by which members of dialout and the user at this computer may open the board, "
        "and ModemManager ignores it:",
        *rules,
        "Then: sudo udevadm control --reload && sudo udevadm trigger, and plug the board in again.",
    ]
