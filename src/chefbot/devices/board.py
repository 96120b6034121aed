"""The motor board of a built robot: what the chapter's launchpad_node, gateway and wheel controllers did."""

from __future__ import annotations

import os
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.board.autodetect import Dialect
from chefbot.board.chapter_board import ChapterLink
from chefbot.board.link import BoardLink, Link
from chefbot.devices.board_line import BoardLine, missing_path
from chefbot.devices.board_node import BoardNode
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.diagnostic_msgs import ERROR, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import Out, every, topic

SPEAK_HZ = 50
STALE_NS = 200_000_000
"""A command that was stamped so long ago is nobody's will any more."""
FIRST_PATIENCE_NS = 6_000_000_000
"""At the start the board must be found within so long; later it may come and go."""


class BoardParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where it is plugged in."""

    port: Annotated[
        str, Meta(min_length=1, description="a serial port's path, or auto: where a board answers")
    ] = "auto"


class BoardDevice(BoardNode):
    """Wheel speeds down, ticks, IMU, ultrasonic and battery up, over a cable that may break.

    Speeds are passed on while fresh ones arrive; when they stop nothing is sent, and the board's own watchdog
    stops the wheels. STOP goes to the board at once; releasing it lifts latched faults whose cause is gone.
    Sent from the loop, never from the thread that reads: a loop that hangs must not go on driving.
    """

    params: BoardParams
    remark: Out[String] = topic("board/remark")

    def start(self) -> None:
        """Look for the board; UserError if a port was named that is not there."""
        if missing_path(self.params.port):
            raise UserError(
                f"the board's port {self.params.port} does not exist; plug it in, look at `chefbot doctor` for "
                "the ports there are, or say board_port:=auto"
            )
        self._link: Link | None = None
        self._connected = self._pressed = False
        self._where, self._missing = self.params.port, "the board has not been found yet"
        self._told: str | None = None
        self._refused_commands = self._unsent = 0
        self._began_ns = self.now_ns
        self.announcement = f"Motor board: looking for it, port {self.params.port}."
        self._line = BoardLine(
            self.params.port,
            lambda path, dialect: self.post(lambda: self._opened(path, dialect)),
            lambda data, at: self.post(lambda: self._heard(data, at)),
            lambda why: self.post(lambda: self._lost(why)),
            lambda why: self.post(lambda: self._not_found(why)),
        )
        self._line.start()

    def stop(self) -> None:
        """The last word is a stop; the board's watchdog would do the same a little later."""
        super().stop()
        if self._link is not None and self._connected:
            self._send(self._link.command(0.0, 0.0, self.now_ns) + self._link.speak(self.now_ns))
        self._line.close()

    # -- commands

    def on_wheel_speeds(self, command: WheelSpeeds) -> None:
        """Passed on at once, unless it is old or no number."""
        stamp_ns = command.header.stamp.ns
        if stamp_ns and self.now_ns - stamp_ns > STALE_NS:
            self._refused_commands += 1
        elif self._link is not None and self._connected:
            self._send(self._link.command(command.left, command.right, self.now_ns))

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Pressed: the board stops by itself. Released: it may drive again, after a new command."""
        if self._link is not None:
            if pressed.data:
                self._send(self._link.stop(self.now_ns))
            elif self._pressed:
                self._link.clear(self.now_ns)
        self._pressed = pressed.data

    @every(hz=SPEAK_HZ)
    def keep_up(self) -> None:
        """What the line needs at this time: repeats, heartbeat, handshake."""
        if self._link is not None and self._connected:
            self._send(self._link.speak(self.now_ns))

    def _send(self, data: bytes) -> None:
        self._unsent += not self._line.send(data)

    # -- what the thread tells, done in the loop

    def _opened(self, path: str, dialect: Dialect) -> None:
        self._where, self._connected = path, True
        kind = ChapterLink if dialect == "chapter" else BoardLink
        if type(self._link) is not kind:
            self._link = kind(self.robot) if kind is ChapterLink else BoardLink(self.robot, os.getpid())
        if self._pressed:
            self._link.stop(self.now_ns)
        self.remark.publish(String(f"Motor board at {path}."))

    def _heard(self, data: bytes, at_ns: int) -> None:
        assert self._link is not None
        heard_ns = self.now_ns - max(0, wall_ns() - at_ns)
        for message in self._link.hear(data, heard_ns):
            self.publish_sensed(message)
        if self._link.refused is not None:
            raise UserError(f"{self._where}: {self._link.refused}")
        if self._link.notice is not None and self._link.notice != self._told:
            self._told = self._link.notice
            self.remark.publish(String(f"Warning: {self._told}."))

    def _lost(self, why: str) -> None:
        assert self._link is not None
        self._connected = False
        self._link.lost_line()
        self._missing = why
        self.remark.publish(String(f"{why[0].upper()}{why[1:]}; looking for it again."))
        self._tell_health()

    def _not_found(self, why: str) -> None:
        self._missing = f"no motor board found: {why}"
        if self._link is None and self.now_ns - self._began_ns > FIRST_PATIENCE_NS:
            raise UserError(self._missing)

    # -- health

    @every(hz=1)
    def tell_health(self) -> None:
        """How board and line are, in words."""
        self._tell_health()

    def _tell_health(self) -> None:
        if self._link is None or not self._connected:
            status = DiagnosticStatus(ERROR, "board", f"{self._missing}.", self._where)
        else:
            status = self._with_own(self._link.report(self._where, self.now_ns))
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))

    def _with_own(self, status: DiagnosticStatus) -> DiagnosticStatus:
        """What only this side knows."""
        own = {"old commands refused": self._refused_commands, "writes that did not fit": self._unsent}
        pairs = tuple(KeyValue(key, str(value)) for key, value in own.items())
        return msgspec.structs.replace(status, values=status.values + pairs)
