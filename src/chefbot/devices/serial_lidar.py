"""Driver of lidars on a serial line."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated

import msgspec
import serial
from msgspec import Meta

from chefbot.devices.lidar_probe import LidarProbe
from chefbot.devices.port_search import SerialDevice
from chefbot.devices.serial_connection import ConnectionEvents, SerialConnection
from chefbot.devices.serial_ports import READ_TIMEOUT
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
RIVALS_NS = 1_000_000_000
"""Time for which a second lidar of the model is looked for after the first was found, ns."""
MIN_SAMPLES = 20
"""Samples of a turn below which it is not a scan."""


NO_DRIVER = (
    "Lidar: the robot file names no driver (sensors.lidar.driver); scans are expected from another machine."
)


class SerialLidarParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of a lidar's driver; the robot file names the model."""

    port: Annotated[
        str,
        Meta(
            description="a serial port's path, or auto: where such a lidar sends; empty: as in the robot file"
        ),
    ] = ""


class SerialLidarDevice(Device):
    """Publishes a scan for each turn of the robot's lidar, and is back after its cable was out, on any port.

    A thread reads; the bytes are decoded in the event loop. A robot whose file names no driver has its scans from
    another node, and this one does nothing.
    """

    params: SerialLidarParams
    scan: Out[LaserScan]
    diagnostics: Out[DiagnosticArray]
    remark: Out[String] = topic("lidar/remark")

    def start(self) -> None:
        """Begin to look for the lidar."""
        self._line: SerialConnection[str] | None = None
        lidar = self.robot.sensors.lidar
        if lidar is None or not lidar.driver:
            for port in (self.scan, self.diagnostics, self.remark):
                port.unadvertise()
            self.announcement = "" if lidar is None else NO_DRIVER
            return
        self._lidar, self._model = lidar, LIDARS[lidar.driver]
        self._session: LidarSession | None = None
        self._turns = TurnAssembler()
        self._turn_ns, self._newest_ns, self._published = self.now_ns, 0, 0
        self._problem, self._damaged = "the lidar has not been found yet", 0
        self._missing = False
        self._port = self.params.port or lidar.port
        self.announcement = f"Lidar: looking for the {self._model.maker}, port {self._port}."
        events: ConnectionEvents[str] = ConnectionEvents(
            lambda path, _: self.post(lambda: self._on_open(path)),
            lambda data, at: self.post(lambda: self._on_data(data, at)),
            lambda reason: self.post(lambda: self._on_lost(reason)),
            lambda reason: self.post(lambda: self._on_missing(reason)),
        )
        self._line = SerialConnection(self._port, lidar_device(self._model), events)
        self._line.start()

    def stop(self) -> None:
        """Stop the lidar's motor and close the port."""
        super().stop()
        if self._line is not None:
            self._line.close(b"" if self._session is None else self._session.stop_command())

    @every(hz=20)
    def request(self) -> None:
        """Send the requests that are due; those that are lost with the connection are repeated after it."""
        if self._line is not None and self._session is not None:
            self._line.send(self._session.data_to_send(self.now_ns))

    def _on_open(self, path: str) -> None:
        self._session, self._damaged = self._model.open(), 0
        self._turns.clear()
        self._problem, self._missing = "", False
        self._port = path
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
        self.remark.publish(String(f"{reason[0].upper()}{reason[1:]}; looking for it again."))
        self._session, self._problem = None, reason
        self.publish_health()

    def _on_missing(self, reason: str) -> None:
        if not self._missing:
            self.remark.publish(String(f"No lidar found: {reason}."))
        self._missing, self._problem = True, f"no lidar found: {reason}"

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish whether the lidar sends turns, and what was damaged on the line."""
        if self._line is None:
            return
        session = self._session
        damaged, self._damaged = (
            (0, 0) if session is None else (session.damaged - self._damaged, session.damaged)
        )
        silent = (self.now_ns - self._turn_ns) / 1e9
        level, text = OK, "The lidar sends scans."
        if self._problem:
            level, text = ERROR, f"{self._problem[0].upper()}{self._problem[1:]}."
        elif silent * 1e9 > SILENCE_NS:
            level, text = ERROR, f"The lidar has sent no complete turn for {silent:.0f} s."
        elif damaged:
            level, text = WARN, f"{damaged} packets of the lidar were damaged in the last second."
        values = (
            KeyValue("driver", self._model.maker),
            KeyValue("lidar", "" if session is None else session.description),
            KeyValue("turns", str(self._published)),
        )
        status = DiagnosticStatus(level, "lidar", text, self._port, values)
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "laser"), (status,)))


def lidar_device(model: LidarModel) -> SerialDevice[str]:
    """Return how a lidar is opened and recognized, and its motor stopped at the end."""

    def opened(path: str) -> serial.Serial:
        port = serial.Serial(None, model.baud, timeout=READ_TIMEOUT, write_timeout=0, exclusive=True)
        if model.dtr is not None:
            port.dtr = model.dtr  # before opening: the motor of some stands at the usual level
        port.port = path
        port.open()
        port.reset_input_buffer()
        return port

    def stop_motor(port: serial.Serial) -> None:
        if model.dtr is not None:
            with suppress(OSError):  # a line without DTR, such as a pseudo-terminal
                port.dtr = not model.dtr

    def probe(port: serial.Serial, now_ns: int, alone: bool) -> LidarProbe:
        return LidarProbe(model, port, now_ns, alone=alone)

    return SerialDevice("lidar", opened, probe, stop_motor, RIVALS_NS)
