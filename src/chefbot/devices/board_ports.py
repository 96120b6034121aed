"""Serial ports: which there are, which could be a board, and one of them opened."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import NamedTuple

import serial
from serial.tools import list_ports

BAUD = 115200
READ_TIMEOUT = 0.05
"""Seconds; so long a thread that reads may take to notice that it shall end."""
BOARD_VENDORS = {
    0x2341: "Arduino",
    0x2A03: "Arduino",
    0x1A86: "CH340, on Arduino clones",
    0x10C4: "CP210x",
    0x0403: "FTDI",
    0x1CBE: "Texas Instruments (Tiva Launchpad)",
    0x2E8A: "Raspberry Pi (Pico)",
}
"""USB vendors of motor boards and of the serial converters on them; they are tried first."""


class Port(NamedTuple):
    """A serial port of this computer."""

    path: str
    description: str
    vendor: int | None
    product: int | None
    serial: str | None

    @property
    def identity(self) -> tuple[int | None, int | None, str | None] | None:
        """The same for the same device whatever its path is; None for a port that is not USB."""
        return (self.vendor, self.product, self.serial) if self.vendor is not None else None


def ports() -> list[Port]:
    """All ports where something is plugged in, likely boards first."""
    found = [
        Port(str(p.device), str(p.description), p.vid, p.pid, p.serial_number) for p in list_ports.comports()
    ]
    real = [port for port in found if port.vendor is not None or port.description != "n/a"]
    return sorted(real, key=lambda port: (port.vendor not in BOARD_VENDORS, port.path))


def port_at(path: str) -> Port:
    """The port at a path, a symbolic link or a pty included."""
    real = str(Path(path).resolve())
    for port in ports():
        if port.path == real:
            return port._replace(path=path)
    return Port(path, "", None, None, None)


def same_device(wanted: Port) -> Port:
    """Where `wanted` is now: after a renumbering its path may be another one's."""
    if wanted.identity is not None:
        for port in ports():
            if port.identity == wanted.identity:
                return port
    return wanted


def open_port(path: str) -> serial.Serial:
    """Exclusively, at the protocol's speed, old bytes thrown away. OSError (SerialException) if not."""
    port = serial.Serial(path, BAUD, timeout=READ_TIMEOUT, write_timeout=0, exclusive=True)
    port.reset_input_buffer()
    return port


def receive(opened: serial.Serial) -> bytes:
    """What is there; waits READ_TIMEOUT for a first byte. OSError when the port is gone."""
    first = bytes(opened.read(1))
    waiting = opened.in_waiting if first else 0
    return first + bytes(opened.read(waiting)) if waiting else first


def broken(path: str, error: Exception) -> str:
    """Why an open port can no longer be read or written."""
    gone = getattr(error, "errno", None) in (errno.EIO, errno.ENXIO, errno.ENODEV)
    gone = gone or "returned no data" in str(error) or "Errno 5" in str(error)  # pyserial's ways to say so
    why = "its cable is out, it is switched off, or another program reads there too" if gone else str(error)
    return f"the connection to the board at {path} broke: {why}"


def explain(path: str, error: Exception) -> str:
    """Why a port cannot be opened, and what to do."""
    number = getattr(error, "errno", None)
    if number in (errno.EACCES, errno.EPERM):
        return f"{path} may not be opened by this user: `chefbot doctor` prints the rule that allows it"
    if number in (errno.EAGAIN, errno.EWOULDBLOCK) or "exclusively lock" in str(error):
        return f"{path} is in use by another program: close it"
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        return f"{path} is not there: plug the board in, or look at `chefbot doctor` for the ports there are"
    if number == errno.EISDIR or f"({errno.ENOTTY}," in str(error):  # pyserial's way to say so
        return f"{path} is no serial port: look at `chefbot doctor` for the ports there are"
    return f"{path} cannot be opened: {error}"
