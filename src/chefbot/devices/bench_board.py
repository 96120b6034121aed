"""A motor board on the bench: commanded step by step at an open serial port, without a launch."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

import serial

from chefbot.board.messages import BoardLine
from chefbot.board.session import BoardSession
from chefbot.devices.serial_ports import explain_disconnection
from chefbot.errors import UserError
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import wall_ns

COMMAND_NS = 40_000_000
"""Period of the repeated speeds, ns."""
OPEN_NS = 15_000_000_000
"""Time for a board to answer, ns: an Arduino Mega waits some seconds in its boot loader."""
CLEAR_SECONDS = 0.5
"""Time for a board to clear its faults, s."""
CATCH_UP_SECONDS = 0.1
"""Time in which lines that have waited are read, and the wheels stand, s."""
L = TypeVar("L", bound=BoardLine)


class BenchBoard:
    """A session with one board; `lines` are all lines that it has sent."""

    def __init__(self, port: serial.Serial, robot: Robot) -> None:
        self._port, self.session = port, BoardSession(robot, os.getpid())
        self.lines: list[BoardLine] = []
        self._command_ns = 0

    def open(self) -> None:
        """Begin the session, and command a stop. Raises UserError if the board does not answer, or is another's.

        A session that has ended, while a question waited for its answer, is begun again by `run`.
        """
        if not self.until(lambda: self.session.is_open or self.session.refused is not None, OPEN_NS / 1e9):
            raise UserError(
                f"{self._port.port}: no motor board answers; look at it with `chefbot board check`"
            )
        if self.session.refused is not None:
            raise UserError(f"{self._port.port}: {self.session.refused}")
        self._command_for(0.3, 0.0, 0.0)

    def clear_faults(self) -> None:
        """Clear latched faults whose cause is gone."""
        self.session.clear(wall_ns())
        self.run(CLEAR_SECONDS)

    def run(self, seconds: float, left: float = 0.0, right: float = 0.0) -> list[BoardLine]:
        """Command the angular velocities of the wheels, rad/s, for a time; return the lines received meanwhile."""
        self._command_for(CATCH_UP_SECONDS, 0.0, 0.0)
        if not self.session.is_open:
            self.open()
        count = len(self.lines)
        self._command_for(seconds, left, right)
        return self.lines[count:]

    def until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Let the wheels stand until a condition holds; return whether it does within a time."""
        end_ns = wall_ns() + round(1e9 * seconds)
        while not condition():
            if wall_ns() > end_ns:
                return False
            self._step(0.0, 0.0)
        return True

    def newest(self, kind: type[L]) -> L | None:
        """Return the newest line of a kind, None if there was none."""
        return next((line for line in reversed(self.lines) if isinstance(line, kind)), None)

    def _command_for(self, seconds: float, left: float, right: float) -> None:
        end_ns = wall_ns() + round(1e9 * seconds)
        while wall_ns() < end_ns:
            self._step(left, right)

    def _step(self, left: float, right: float) -> None:
        try:
            data = self._port.read(max(1, self._port.in_waiting))
            now_ns = wall_ns()
            self.lines += [received.line for received in self.session.receive_data(data, now_ns)]
            if now_ns - self._command_ns >= COMMAND_NS:
                self._command_ns = now_ns
                self._port.write(self.session.command(left, right, now_ns))
                self._port.write(self.session.data_to_send(now_ns))
        except OSError as error:
            raise UserError(explain_disconnection(str(self._port.port), error)) from None
