"""Driver of lidars on a serial line."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated

import msgspec
import serial
from msgspec import Meta

from chefbot.devices.board_ports import (
    READ_TIMEOUT,
    Port,
    explain,
    explain_disconnection,
    find_same_device,
    port_at,
    receive,
)
from chefbot.errors import UserError
from chefbot.lidar.laser_scan import scan_of
from chefbot.lidar.models import LIDARS, LidarModel
from chefbot.lidar.session import LidarError, LidarSession
from chefbot.lidar.turns import Samples, TurnAssembler
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Device, Out, every, topic

SILENCE_NS = 1_000_000_000
"""Time without a turn from which the lidar counts as silent, ns."""
PAUSE = 0.3
"""Pause between two attempts to open the port, s."""
MIN_SAMPLES = 20
"""Samples of a turn below which it is no scan."""


class SerialLidarParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of a lidar's driver."""

    driver: Annotated[str, Meta(min_length=1, description="model of the lidar: " + ", ".join(LIDARS))]
    port: Annotated[
        str, Meta(min_length=1, description="a serial port's path, best one in /dev/serial/by-id")
    ]


class SerialLidarDevice(Device):
    """Publishes a scan for each turn of the robot's lidar, and is back after its cable was out, on any port.

    A thread reads; the bytes are decoded in the event loop.
    """

    params: SerialLidarParams
    scan: Out[LaserScan]
    diagnostics: Out[DiagnosticArray]
    remark: Out[String] = topic("lidar/remark")

    def start(self) -> None:
        """Begin to open the port; UserError for a model or a robot that has none."""
        if self.params.driver not in LIDARS:
            raise UserError(
                f"there is no driver {self.params.driver!r} for a lidar; there are {', '.join(LIDARS)}"
            )
        if self.robot.sensors.lidar is None:
            raise UserError("the robot has no lidar: give the section sensors.lidar in its file")
        self._lidar, self._model = self.robot.sensors.lidar, LIDARS[self.params.driver]
        self._session: LidarSession | None = None
        self._turns = TurnAssembler()
        self._turn_ns, self._newest_ns, self._published = self.now_ns, 0, 0
        self._problem, self._damaged = "the port has not been opened yet", 0
        self._line = LidarLine(
            self.params.port,
            self._model,
            lambda path: self.post(lambda: self._on_open(path)),
            lambda data, at: self.post(lambda: self._on_data(data, at)),
            lambda reason: self.post(lambda: self._on_lost(reason)),
        )
        self._line.start()

    def stop(self) -> None:
        """Stop the lidar's motor and close the port."""
        self._line.close(b"" if self._session is None else self._session.stop_command())

    @every(hz=20)
    def request(self) -> None:
        """Send the requests that are due."""
        if self._session is not None:
            self._line.send(self._session.data_to_send(self.now_ns))

    def _on_open(self, path: str) -> None:
        self._session, self._damaged = self._model.open(), 0
        self._turns.clear()
        self._problem = ""
        self.remark.publish(String(f"Lidar at {path}."))

    def _on_data(self, data: bytes, at_ns: int) -> None:
        if self._session is None:
            return
        # time of reception on the loop's clock: subtract the delay since the thread read the bytes
        received_ns = self.now_ns - max(0, wall_ns() - at_ns)
        try:
            parts = self._session.receive_data(data, received_ns)
        except LidarError as error:
            self._problem, self._session = str(error), None
            return
        for part in parts:
            for turn in self._turns.push(part):
                self._publish(turn)

    def _publish(self, turn: Samples) -> None:
        if len(turn.ranges) < MIN_SAMPLES:
            return
        scan = scan_of(turn, self._lidar, "laser")
        if scan.header.stamp.ns <= self._newest_ns:
            return  # it has waited on the line, so that its time is not known
        self._turn_ns, self._newest_ns = self.now_ns, scan.header.stamp.ns
        self._published += 1
        self.scan.publish(scan)

    def _on_lost(self, reason: str) -> None:
        if self._session is not None:
            self.remark.publish(String(f"The lidar is lost: {reason}; looking for it again."))
        self._session, self._problem = None, reason

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish whether the lidar sends turns, and what was damaged on the line."""
        session = self._session
        damaged, self._damaged = (
            (0, 0) if session is None else (session.damaged - self._damaged, session.damaged)
        )
        silent = (self.now_ns - self._turn_ns) / 1e9
        level, text = OK, "The lidar sends scans."
        if self._problem:
            level, text = ERROR, f"{self._problem[0].upper()}{self._problem[1:]}."
        elif silent * 1e9 > SILENCE_NS:
            level, text = ERROR, f"The lidar has sent no whole turn for {silent:.0f} s."
        elif damaged:
            level, text = WARN, f"{damaged} packets of the lidar were damaged in the last second."
        values = (
            KeyValue("driver", self._model.maker),
            KeyValue("lidar", "" if session is None else session.description),
            KeyValue("turns", str(self._published)),
        )
        status = DiagnosticStatus(level, "lidar", text, self.params.port, values)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "laser"), (status,)))


class LidarLine:
    """A thread that opens a lidar's port, reads it, and opens it again when it is back, wherever it is then.

    It calls back in its thread: `on_open(path)`, `on_data(data, wall_ns)`, `on_lost(reason)`, also after each attempt
    that failed. `send` may be called from one other thread.
    """

    def __init__(
        self,
        port: str,
        model: LidarModel,
        on_open: Callable[[str], None],
        on_data: Callable[[bytes, int], None],
        on_lost: Callable[[str], None],
    ) -> None:
        self._path, self._model = port, model
        self._on_open, self._on_data, self._on_lost = on_open, on_data, on_lost
        self._device: Port | None = None
        self._serial: serial.Serial | None = None
        self._closing = threading.Event()
        self._farewell = b""
        self._thread = threading.Thread(target=self._run, name="lidar", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self, farewell: bytes) -> None:
        """Send the last bytes, which stop the motor, and close the port."""
        self._farewell = farewell
        self._closing.set()
        self._thread.join()

    def send(self, data: bytes) -> None:
        """Send bytes if the port is open; requests that are lost with the connection are repeated after it."""
        port = self._serial
        if port is None or not data:
            return
        try:
            port.write(data)
        except (OSError, TypeError, ValueError):  # pyserial raises any of these if the port was just closed
            return

    def _run(self) -> None:
        while not self._closing.is_set():
            path = self._path if self._device is None else find_same_device(self._device).path
            try:
                opened = self._open(path)
            except OSError as error:
                self._on_lost(explain(path, error, "lidar"))
                self._closing.wait(PAUSE)
                continue
            self._device = port_at(path)
            self._on_open(path)
            self._read(path, opened)

    def _open(self, path: str) -> serial.Serial:
        port = serial.Serial(None, self._model.baud, timeout=READ_TIMEOUT, write_timeout=0, exclusive=True)
        if self._model.dtr is not None:
            port.dtr = self._model.dtr  # before opening: the motor of some stands at the usual level
        port.port = path
        port.open()
        port.reset_input_buffer()
        return port

    def _read(self, path: str, port: serial.Serial) -> None:
        self._serial = port
        reason = ""
        try:
            while not self._closing.is_set():
                data = receive(port)
                if data:
                    self._on_data(data, wall_ns())
            if self._farewell:
                port.write(self._farewell)
                port.flush()
        except OSError as error:
            reason = explain_disconnection(path, error, "lidar")
        self._serial = None
        if not reason:
            self._stop_motor(port)
        port.close()
        if not self._closing.is_set():
            self._on_lost(reason)

    def _stop_motor(self, port: serial.Serial) -> None:
        """Set DTR so that the motor stands, where the adapter switches it by that."""
        if self._model.dtr is None:
            return
        with suppress(OSError):  # a line without DTR, such as a pseudo-terminal
            port.dtr = not self._model.dtr
