"""Recognizes a lidar at a serial port; where a motor board may be instead, the port is only read at first."""

from __future__ import annotations

import serial

from chefbot.board.autodetect import ProtocolProbe
from chefbot.devices.serial_ports import BAUD
from chefbot.lidar.models import LidarModel
from chefbot.lidar.session import LidarError

LISTENING_NS = 2_500_000_000
"""Time for which a port is only read, at the baud rate of motor boards, before requests are sent to a lidar that
needs them, ns: the boot loader of an Arduino Mega takes a byte in its first second for a new program."""
MIN_SAMPLES = 100
"""Samples by which a lidar is recognized."""
TIMEOUT_NS = 6_000_000_000
"""Time for a lidar to begin its scan, ns: motors need some seconds to reach their speed."""


class LidarProbe:
    """Recognizes a lidar of one model by samples with valid checksums, and returns its description then.

    port: the open port, at the baud rate of the lidar. alone: whether it is the port that the robot's owner names, so
    that requests are sent at once.
    """

    def __init__(self, model: LidarModel, port: serial.Serial, now_ns: int, *, alone: bool) -> None:
        self._model, self._port, self._session = model, port, model.open()
        self._board: ProtocolProbe | None = None
        self._start_ns, self._samples, self._received = now_ns, 0, 0
        self._problem = ""
        if not alone and model.open().data_to_send(now_ns):
            self._board, port.baudrate = ProtocolProbe(0, now_ns), BAUD

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the requests that start the scan; nothing while a motor board may be there."""
        if self._board is not None and now_ns - self._start_ns >= LISTENING_NS:
            self._board, self._port.baudrate, self._start_ns = None, self._model.baud, now_ns
        return b"" if self._board is not None else self._session.data_to_send(now_ns)

    def receive_data(self, data: bytes, now_ns: int) -> str | None:
        """Process received bytes; return what the lidar reports about itself once it has sent enough samples."""
        self._received += len(data)
        if self._board is not None:
            self._board.receive_data(data, now_ns)
            if self._board.has_received_lines:
                self._problem = "a motor board is there"
            return None
        try:
            parts = self._session.receive_data(data, now_ns)
        except LidarError as error:
            self._problem = str(error)
            return None
        self._samples += sum(len(part.ranges) for part in parts)
        return self._session.description if self._samples >= MIN_SAMPLES else None

    def timed_out(self, now_ns: int) -> bool:
        """Return whether no such lidar is there."""
        return bool(self._problem) or (self._board is None and now_ns - self._start_ns >= TIMEOUT_NS)

    @property
    def failure_reason(self) -> str:
        """What is there instead, as a sentence for the operator."""
        name = f"{self._model.maker} at {self._model.baud} baud"
        if self._problem:
            return self._problem
        if self._received:
            return f"the data there are not from a {name}: is it another device, or another model?"
        return f"no data from a {name} there: does it rotate, and is its driver the right one?"
