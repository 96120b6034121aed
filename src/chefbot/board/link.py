"""Session, sensors and health of a board as one: bytes and commands in, messages, bytes and diagnostics out."""

from __future__ import annotations

from typing import Protocol

from chefbot.board.link_health import Health
from chefbot.board.sensors import Sensors
from chefbot.board.session import Session
from chefbot.msgs.diagnostic_msgs import DiagnosticStatus
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot


class Link(Protocol):
    """What a driver does with a board of any dialect. Times are integer nanoseconds of one clock."""

    @property
    def refused(self) -> str | None:
        """Why the board may not drive this robot."""

    @property
    def notice(self) -> str | None:
        """What the person who started the driver should know of the board."""

    def hear(self, data: bytes, now_ns: int) -> list[Message]:
        """Sensor messages in bytes from the board."""

    def speak(self, now_ns: int) -> bytes:
        """What is to be sent now; call it every 20 ms."""

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """Rim speeds in m/s that upstream wants now; what to send at once."""

    def stop(self, now_ns: int) -> bytes:
        """Emergency stop; what to send at once."""

    def clear(self, now_ns: int) -> None:
        """Lift the emergency stop and other faults; nothing drives before a stop was commanded once."""

    def lost_line(self) -> None:
        """The cable was pulled."""

    def report(self, port: str, now_ns: int) -> DiagnosticStatus:
        """How board and line are; call it about once a second."""


class BoardLink:
    """A board with our firmware."""

    def __init__(self, robot: Robot, token: int = 0) -> None:
        self.session = Session(robot, token)
        self._sensors = Sensors(robot)
        self._health = Health()

    @property
    def refused(self) -> str | None:
        """Another version or other ticks per turn."""
        return self.session.refused

    @property
    def notice(self) -> str | None:
        """Made from another robot file."""
        return self.session.warning

    def hear(self, data: bytes, now_ns: int) -> list[Message]:
        """Messages of the lines that count."""
        messages: list[Message] = []
        for heard in self.session.hear(data, now_ns):
            self._health.take(heard.line, now_ns)
            messages += self._sensors.messages(heard)
        return messages

    def speak(self, now_ns: int) -> bytes:
        """Handshake, repeated speeds, heartbeat."""
        return self.session.speak(now_ns)

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """See Session."""
        return self.session.command(left, right, now_ns)

    def stop(self, now_ns: int) -> bytes:
        """See Session."""
        return self.session.stop(now_ns)

    def clear(self, now_ns: int) -> None:
        """See Session."""
        self.session.clear(now_ns)

    def lost_line(self) -> None:
        """See Session."""
        self.session.lost_line()

    def report(self, port: str, now_ns: int) -> DiagnosticStatus:
        """See Health."""
        return self._health.report(self.session, port, now_ns)
