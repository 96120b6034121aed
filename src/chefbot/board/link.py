"""Session, sensor conversion and health of a board in one object: bytes and commands in, messages, bytes and
diagnostics out."""

from __future__ import annotations

from typing import Protocol

from chefbot.board.link_health import LinkDiagnostics
from chefbot.board.sensors import SensorConverter
from chefbot.board.session import BoardSession
from chefbot.board.status_codes import BoardFlag, as_text, motors_off
from chefbot.msgs.diagnostic_msgs import DiagnosticStatus
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot


class MotorBoardLink(Protocol):
    """The interface between a driver and a board of either protocol. Times are integer nanoseconds of one
    clock."""

    @property
    def refused(self) -> str | None:
        """Why the board may not drive this robot, None if it may."""

    @property
    def notice(self) -> str | None:
        """A warning about the board for the operator, None if there is none."""

    @property
    def is_open(self) -> bool:
        """Whether the board answers and accepts commands."""

    @property
    def fault(self) -> str:
        """Why the board has switched its motors off, in sentences with the remedy; empty if it has not.

        An emergency stop commanded by the computer is not a fault.
        """

    def receive_data(self, data: bytes, now_ns: int) -> list[Message]:
        """Process bytes from the board and return the sensor messages in them."""

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the bytes that are due now; call it every 20 ms."""

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """Set the requested wheel speeds at the ground, m/s; return the bytes to send at once."""

    def stop(self, now_ns: int) -> bytes:
        """Latch the emergency stop; return the bytes to send at once."""

    def clear(self, now_ns: int) -> None:
        """Clear the emergency stop and other latched faults; the robot drives after a stop was commanded
        once."""

    def connection_lost(self) -> None:
        """Reset the link after the serial connection was lost."""

    def report(self, port: str, now_ns: int) -> DiagnosticStatus:
        """Return the diagnostics of board and link; call it about once a second."""


class BoardLink:
    """The `MotorBoardLink` of a board with our firmware."""

    def __init__(self, robot: Robot, token: int = 0) -> None:
        self.session = BoardSession(robot, token)
        self._sensors = SensorConverter(robot)
        self._health = LinkDiagnostics()
        # What is sent is the session's; the angular velocities of a command are in rad/s.
        self.command, self.stop, self.clear = self.session.command, self.session.stop, self.session.clear
        self.data_to_send, self.connection_lost = self.session.data_to_send, self.session.connection_lost

    @property
    def refused(self) -> str | None:
        """Why the board may not drive: another protocol version or another number of ticks per turn."""
        return self.session.refused

    @property
    def notice(self) -> str | None:
        """A warning that the firmware was built from another robot file, None if it was not."""
        return self.session.warning

    @property
    def is_open(self) -> bool:
        """Whether the handshake is complete and the session has not ended since."""
        return self.session.is_open

    @property
    def fault(self) -> str:
        """The latched faults in the board's last line, but for an emergency stop that was commanded."""
        return as_text(motors_off(self.session.flags & ~BoardFlag.ESTOP_COMMAND))

    def receive_data(self, data: bytes, now_ns: int) -> list[Message]:
        """Process bytes from the board and return the messages of the accepted lines."""
        messages: list[Message] = []
        for received in self.session.receive_data(data, now_ns):
            self._health.update(received.line, now_ns)
            messages += self._sensors.messages(received)
        return messages

    def report(self, port: str, now_ns: int) -> DiagnosticStatus:
        """Return the diagnostics of board and link; call it about once a second."""
        return self._health.report(self.session, port, now_ns)
