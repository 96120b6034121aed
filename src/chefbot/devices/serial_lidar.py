"""Driver of lidars on a serial line."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Annotated

import msgspec
import serial
from msgspec import Meta

from chefbot.devices.lidar_probe import LidarProbe
from chefbot.devices.port_search import SerialDevice
from chefbot.devices.serial_ports import READ_TIMEOUT
from chefbot.devices.serial_sensor import SensorText, SerialSensorDevice
from chefbot.lidar.laser_scan import scan_of
from chefbot.lidar.models import LIDARS, LidarModel
from chefbot.lidar.own_body import OwnBody
from chefbot.lidar.revolutions import RevolutionAssembler, Samples
from chefbot.lidar.session import LidarError, LidarSession
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Out, topic

RIVALS_NS = 1_000_000_000
"""Time for which a second lidar of the model is looked for after the first was found, ns."""
MIN_SAMPLES = 20
"""Samples of a revolution below which it is not a scan."""


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


class SerialLidarDevice(SerialSensorDevice[LidarSession]):
    """Publishes a scan for each revolution of the robot's lidar.

    A robot whose file names no driver has its scans from another node, and this one does nothing.
    """

    params: SerialLidarParams
    scan: Out[LaserScan]
    notice: Out[String] = topic("lidar/notice")

    def start(self) -> None:
        """Begin to look for the lidar."""
        lidar = self.robot.sensors.lidar
        if lidar is None or not lidar.driver:
            for port in (self.scan, self.diagnostics, self.notice):
                port.unadvertise()
            self.announcement = "" if lidar is None else NO_DRIVER
            return
        self._lidar, model = lidar, LIDARS[lidar.driver]
        self._own_body = OwnBody(lidar, self.robot.footprint)
        self._revolutions, self._newest_ns = RevolutionAssembler(), 0
        text = SensorText("lidar", model.maker, "laser", "complete revolution", "scans")
        self.connect(self.params.port or lidar.port, lidar_device(model), self._open(model), text)

    def _open(self, model: LidarModel) -> Callable[[], LidarSession]:
        def opened() -> LidarSession:
            self._revolutions.clear()
            return model.open()

        return opened

    def farewell(self) -> bytes:
        """Return the command that stops the lidar's motor."""
        return b"" if self._line is None or self.session is None else self.session.stop_command()

    def process(self, session: LidarSession, data: bytes, received_ns: int) -> None:
        """Publish the revolutions that end in received bytes."""
        try:
            parts = session.receive_data(data, received_ns)
        except LidarError as error:
            self.fail(str(error))
            return
        for part in parts:
            for revolution in self._revolutions.push(part):
                self._publish(revolution)

    def _publish(self, revolution: Samples) -> None:
        if len(revolution.ranges) < MIN_SAMPLES:
            return
        scan = scan_of(revolution, self._lidar, self._own_body, "laser")
        if scan.header.stamp.ns <= self._newest_ns:
            return  # it has waited on the line, so that its time is not known
        self._newest_ns = scan.header.stamp.ns
        self.note_published()
        self.scan.publish(scan)


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
