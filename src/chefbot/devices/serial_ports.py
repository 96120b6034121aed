"""Serial ports: lists them, ranks those of likely motor boards first, opens and reads one."""

from __future__ import annotations

import errno
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import serial
from serial.tools import list_ports

BAUD = 115200
"""Baud rate of the protocol."""
READ_TIMEOUT = 0.05
"""Read timeout, s; a reading thread may take so long to end."""
SERIAL_LINKS = Path("/dev/serial")
"""Folder of udev's links to serial ports."""
BOARD_VENDORS = {
    0x2341: "Arduino",
    0x2A03: "Arduino",
    0x1A86: "CH340, on Arduino clones",
    0x10C4: "CP210x",
    0x0403: "FTDI",
    0x1CBE: "Texas Instruments (Tiva Launchpad)",
    0x2E8A: "Raspberry Pi (Pico)",
}
"""USB vendors of motor boards and of their serial converters; these ports are tried first."""


class Port(NamedTuple):
    """A serial port of this computer."""

    path: str
    description: str
    vendor: int | None
    product: int | None
    serial: str | None

    @property
    def identity(self) -> tuple[int | None, int | None, str | None] | None:
        """USB vendor, product and serial number, independent of the path; None for a port that is not USB."""
        return (self.vendor, self.product, self.serial) if self.vendor is not None else None


def ports() -> list[Port]:
    """Return all ports with a device, likely boards first."""
    listed = [
        Port(str(p.device), str(p.description), p.vid, p.pid, p.serial_number) for p in list_ports.comports()
    ]
    connected = [port for port in listed if port.vendor is not None or port.description != "n/a"]
    return sorted(connected, key=lambda port: (port.vendor not in BOARD_VENDORS, port.path))


def lasting_path(port: Port, connected: Sequence[Port]) -> str:
    """Return a link of udev to a port that lasts when it is plugged in again, empty if there is none.

    connected: all ports. The link names the device or, where two have the same identity, the USB socket.
    """
    is_alone = sum(other.identity == port.identity for other in connected) == 1
    folder = SERIAL_LINKS / ("by-id" if is_alone else "by-path")
    links = sorted(folder.iterdir()) if folder.is_dir() else []
    return next((str(link) for link in links if str(link.resolve()) == port.path), "")


def port_at(path: str) -> Port:
    """Return the port at a path, which may be a symbolic link or a pty."""
    resolved = str(Path(path).resolve())
    for port in ports():
        if port.path == resolved:
            return port._replace(path=path)
    return Port(path, "", None, None, None)


def find_same_device(device: Port) -> Port:
    """Return the port where `device` is connected now: after a renumbering its path may belong to another
    device.

    Some adapters all have the same serial number: then it is the one at the same path, which may be a symbolic link,
    and if none is there, it is not known.
    """
    if device.identity is None:
        return device
    same = [port for port in ports() if port.identity == device.identity]
    resolved = str(Path(device.path).resolve())
    if any(port.path == resolved for port in same):
        return device
    return same[0] if len(same) == 1 else device


def open_port(path: str) -> serial.Serial:
    """Open a port exclusively at the protocol's baud rate and discard buffered bytes; raises OSError
    (SerialException)."""
    port = serial.Serial(path, BAUD, timeout=READ_TIMEOUT, write_timeout=0, exclusive=True)
    port.reset_input_buffer()
    return port


def receive(opened: serial.Serial) -> bytes:
    """Read the available bytes; waits READ_TIMEOUT for a first byte. Raises OSError when the port is gone."""
    first = bytes(opened.read(1))
    waiting = opened.in_waiting if first else 0
    return first + bytes(opened.read(waiting)) if waiting else first


def explain_disconnection(path: str, error: Exception, device: str = "board") -> str:
    """Explain why the open port of a device can no longer be read or written."""
    gone = getattr(error, "errno", None) in (errno.EIO, errno.ENXIO, errno.ENODEV)
    gone = gone or "returned no data" in str(error) or "Errno 5" in str(error)  # texts of pyserial's errors
    cause = (
        "its cable is unplugged, it is switched off, or another program uses the port" if gone else str(error)
    )
    return f"the connection to the {device} at {path} broke: {cause}"


def explain(path: str, error: Exception, device: str = "board") -> str:
    """Explain why the port of a device cannot be opened, and what to do."""
    code = getattr(error, "errno", None)
    if code in (errno.EACCES, errno.EPERM):
        return f"{path} may not be opened by this user: `chefbot doctor` prints the rule that allows it"
    if code in (errno.EAGAIN, errno.EWOULDBLOCK) or "exclusively lock" in str(error):
        return f"{path} is in use by another program: close it"
    if code in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        return f"{path} is not there: plug the {device} in, or see `chefbot doctor` for a list of the ports"
    if code == errno.EISDIR or f"({errno.ENOTTY}," in str(error):  # text of pyserial's error
        return f"{path} is not a serial port: see `chefbot doctor` for a list of the ports"
    return f"{path} cannot be opened: {error}"
