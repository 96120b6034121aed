"""Driver of the real robot's motor board, for the book chapter's launchpad_node, gateway and wheel
controllers."""

from __future__ import annotations

import os
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.board.autodetect import ProtocolProbe
from chefbot.board.chapter_board import ChapterLink
from chefbot.board.drives.drive_link import DriveLink
from chefbot.board.drives.drives import DRIVES
from chefbot.board.link import BoardLink, MotorBoardLink
from chefbot.devices.board_node import MotorBoardNode
from chefbot.devices.drive_probe import drive_device
from chefbot.devices.port_search import SerialDevice
from chefbot.devices.serial_connection import ConnectionEvents, SerialConnection, is_missing_path
from chefbot.devices.serial_ports import open_port
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.diagnostic_msgs import ERROR, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.robot.drivetrain import ROS_BASE
from chefbot.robot.sensors import AUTO
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Out, every, topic

LINK_HZ = 50
"""Rate at which the serial link is served, Hz."""
MAX_COMMAND_AGE_NS = 200_000_000
"""Maximum age of a wheel speed command by its stamp, ns; an older one is dropped."""
SEARCH_TIMEOUT_NS = 6_000_000_000
"""Timeout after the start to find the board, ns; later it may be disconnected for any time."""
RIVALS_NS = 1_000_000_000
"""Time for which a second board is looked for: it may still be in its boot loader, ns."""


BOARD: SerialDevice[str] = SerialDevice(
    "motor board",
    open_port,
    lambda _, now_ns, __: ProtocolProbe(os.getpid(), now_ns),
    rivals_ns=RIVALS_NS,
)


class BoardParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the motor board's driver."""

    port: Annotated[
        str, Meta(min_length=1, description="a serial port's path, or auto: where a board answers")
    ] = AUTO


class MotorBoardDevice(MotorBoardNode):
    """Driver of the motor board: sends wheel speeds and publishes ticks, IMU, ultrasonic and battery over a
    serial link that may be disconnected.

    Speeds are sent while fresh commands arrive; otherwise nothing is sent, and the board's own watchdog stops
    the wheels. An emergency stop is sent to the board at once; its release clears latched faults whose cause
    is gone. Bytes are sent from the event loop, never from the reading thread: a hanging loop must not
    continue to drive.
    """

    params: BoardParams
    notice: Out[String] = topic("board/notice")

    def start(self) -> None:
        """Start to search for the board; UserError if the given port does not exist.

        A robot whose drive has the protocol `ros2` has none, and this node does nothing.
        """
        if is_missing_path(self.params.port):
            raise UserError(
                f"the board's port {self.params.port} does not exist; plug it in, look at `chefbot doctor` for "
                "the available ports, or set board_port:=auto"
            )
        self._link: MotorBoardLink | None = None
        self._line: SerialConnection[str] | None = None
        self._dialect = ""
        self._connected = self._stop_pressed = False
        self._port, self._missing_reason = self.params.port, "the board has not been found yet"
        self._last_notice: str | None = None
        self._stale_commands = self._failed_writes = 0
        self._start_ns = self.now_ns
        if self.robot.drive.protocol == ROS_BASE:
            for port in (*self.board_outputs, self.notice):
                port.unadvertise()
            return
        if self.robot.sensors.imu.driver:
            self.imu.unadvertise()
        events: ConnectionEvents[str] = ConnectionEvents(
            lambda path, dialect: self.post(lambda: self._on_open(path, dialect)),
            lambda data, at: self.post(lambda: self._on_data(data, at)),
            lambda reason: self.post(lambda: self._on_lost(reason)),
            lambda reason: self.post(lambda: self._on_missing(reason)),
        )
        protocol = self.robot.drive.protocol
        device = drive_device(DRIVES[protocol]) if protocol else BOARD
        self._title = DRIVES[protocol].title if protocol else "motor board"
        self.announcement = (
            f"{self._title[0].upper()}{self._title[1:]}: looking for it, port {self.params.port}."
        )
        self._line = SerialConnection(self.params.port, device, events, self._ports_of_others())
        self._line.start()

    def _ports_of_others(self) -> frozenset[str]:
        """Return the ports that the robot file gives to other devices."""
        sensors = self.robot.sensors
        ports = {sensors.imu.port} | ({sensors.lidar.port} if sensors.lidar is not None else set())
        return frozenset(ports - {AUTO})

    def stop(self) -> None:
        """Send a final stop and close the port; the board's watchdog would stop the wheels a little later."""
        super().stop()
        if self._link is not None and self._connected:
            self._send(self._link.command(0.0, 0.0, self.now_ns) + self._link.data_to_send(self.now_ns))
        if self._line is not None:
            self._line.close()

    # -- commands

    def on_wheel_speeds(self, command: WheelSpeeds) -> None:
        """Send a wheel speed command at once, unless it is stale or not finite."""
        stamp_ns = command.header.stamp.ns
        if stamp_ns and self.now_ns - stamp_ns > MAX_COMMAND_AGE_NS:
            self._stale_commands += 1
        elif self._link is not None and self._connected:
            self._send(self._link.command(command.left, command.right, self.now_ns))

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Latch the emergency stop on the board, or clear it; after a release the robot drives only on a new
        command."""
        if self._link is not None:
            if pressed.data:
                self._send(self._link.stop(self.now_ns))
            elif self._stop_pressed:
                self._link.clear(self.now_ns)
        self._stop_pressed = pressed.data

    @every(hz=LINK_HZ)
    def serve_link(self) -> None:
        """Send what is due on the serial link: repeats, heartbeat, handshake."""
        if self._link is not None and self._connected:
            self._send(self._link.data_to_send(self.now_ns))
        self.publish_connection(self._connected and self._link is not None and self._link.is_open)
        self.publish_fault(self._link.fault if self._connected and self._link is not None else "")

    def _send(self, data: bytes) -> None:
        assert self._line is not None
        self._failed_writes += not self._line.send(data)

    # -- callbacks of the thread, run in the event loop

    def _on_open(self, path: str, dialect: str) -> None:
        self._port, self._connected = path, True
        if self._link is None or dialect != self._dialect:
            self._dialect, self._link = dialect, self._new_link(dialect)
        if self._stop_pressed:
            self._link.stop(self.now_ns)
        self.notice.publish(String(f"{self._title[0].upper()}{self._title[1:]} at {path}."))

    def _new_link(self, dialect: str) -> MotorBoardLink:
        if self.robot.drive.protocol:
            return DRIVES[self.robot.drive.protocol].link(self.robot)
        return ChapterLink(self.robot) if dialect == "chapter" else BoardLink(self.robot, os.getpid())

    def _on_data(self, data: bytes, at_ns: int) -> None:
        assert self._link is not None
        # Time of reception on the loop's clock: subtract the delay since the thread read the bytes.
        received_ns = self.now_ns - max(0, wall_ns() - at_ns)
        for message in self._link.receive_data(data, received_ns):
            if not (self.robot.sensors.imu.driver and isinstance(message, Imu)):
                self.publish_sensor_message(message)
        if isinstance(self._link, DriveLink):  # after an answer the next request is due
            self._send(self._link.data_to_send(self.now_ns))
        if self._link.refused is not None:
            raise UserError(f"{self._port}: {self._link.refused}")
        if self._link.notice is not None and self._link.notice != self._last_notice:
            self._last_notice = self._link.notice
            self.notice.publish(String(f"Warning: {self._last_notice}."))

    def _on_lost(self, reason: str) -> None:
        assert self._link is not None
        self._connected = False
        self._link.connection_lost()
        self._missing_reason = reason
        self.notice.publish(String(f"{reason[0].upper()}{reason[1:]}; looking for it again."))
        self._publish_health()

    def _on_missing(self, reason: str) -> None:
        self._missing_reason = f"no {self._title} found: {reason}"
        if self._link is None and self.now_ns - self._start_ns > SEARCH_TIMEOUT_NS:
            raise UserError(self._missing_reason)

    # -- health

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish the diagnostics of board and link."""
        if self._line is not None:
            self._publish_health()

    def _publish_health(self) -> None:
        if self._link is None or not self._connected:
            status = DiagnosticStatus(ERROR, "board", f"{self._missing_reason}.", self._port)
        else:
            status = self._with_driver_counters(self._link.report(self._port, self.now_ns))
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))

    def _with_driver_counters(self, status: DiagnosticStatus) -> DiagnosticStatus:
        """Add the counters of this driver."""
        counters = {
            "stale commands dropped": self._stale_commands,
            "incomplete writes": self._failed_writes,
        }
        pairs = tuple(KeyValue(key, str(value)) for key, value in counters.items())
        return msgspec.structs.replace(status, values=status.values + pairs)
