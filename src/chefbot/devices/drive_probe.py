"""Recognizes a motor drive at a serial port; where another device may be, the port is only read at first."""

from __future__ import annotations

from chefbot.board.drives.drives import MotorDrive
from chefbot.board.drives.half_duplex import HalfDuplexLine
from chefbot.devices.port_search import SerialDevice
from chefbot.devices.serial_ports import open_port

LISTENING_NS = 2_500_000_000
"""Time for which a port is only read, ns: a boot loader takes a byte in its first second for a new program."""
TIMEOUT_NS = 2_000_000_000
"""Time for an answer after that, ns."""


class DriveProbe:
    """Recognizes a drive by its answer to a request that moves nothing; what sends by itself is another device."""

    def __init__(self, drive: MotorDrive, now_ns: int, *, alone: bool) -> None:
        """alone: whether it is the port that the robot's owner names, so that the request is sent at once."""
        self._drive, self._line = drive, HalfDuplexLine()
        self._send_ns = now_ns if alone else now_ns + LISTENING_NS
        self._received = 0

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the request, again after each that was not answered."""
        if now_ns < self._send_ns or self._is_other_device(now_ns) or not self._line.is_free(now_ns):
            return b""
        return self._line.send(self._drive.greeting(), now_ns)

    def receive_data(self, data: bytes, now_ns: int) -> str | None:
        """Process received bytes; return the name of the drive once it has answered."""
        self._received += len(data)
        return self._drive.title if self._line.receive(data, now_ns) is not None else None

    def timed_out(self, now_ns: int) -> bool:
        """Return whether no such drive is there."""
        return self._is_other_device(now_ns) or now_ns - self._send_ns >= TIMEOUT_NS

    @property
    def failure_reason(self) -> str:
        """What is there instead, as a sentence for the operator."""
        if self._received:
            return f"the data there are not from a {self._drive.title}: is it another device, or another baud rate?"
        return f"no {self._drive.title} answers there: is it switched on, and at 115200 baud?"

    def _is_other_device(self, now_ns: int) -> bool:
        return now_ns < self._send_ns and self._received > 0


def drive_device(drive: MotorDrive) -> SerialDevice[str]:
    """Return how a drive is opened and recognized."""
    return SerialDevice(
        drive.title, open_port, lambda _, now_ns, alone: DriveProbe(drive, now_ns, alone=alone)
    )
