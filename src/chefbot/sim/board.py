"""The simulated board with the computer's end of its line: wheel speeds in, messages out."""

from __future__ import annotations

from chefbot.board.link import BoardLink
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot
from chefbot.sim.motor_board import MotorBoard
from chefbot.sim.simulation import Simulation

TALK_NS = 20_000_000
"""The computer reads and speaks so often."""
WAKE_NS = 300_000_000
"""Of which the IMU takes 0.22 s."""


class Board:
    """Everything between a command and a sensor's message goes as bytes through the firmware."""

    def __init__(self, robot: Robot, simulation: Simulation, began_ns: int = 0) -> None:
        """Switched on, and woken; `began_ns`: what the computer's clock says now."""
        self._simulation = simulation
        self._offset_ns = began_ns - simulation.time_ns
        self.link = BoardLink(robot)
        self.motors = MotorBoard(robot, simulation)
        self._wake()

    @property
    def now_ns(self) -> int:
        """The computer's clock."""
        return self._simulation.time_ns + self._offset_ns

    def command(self, left: float, right: float) -> None:
        """Rim speeds in m/s; without a new one in 150 ms the board stops. Nothing drives before a stop."""
        self.motors.write(self.link.command(left, right, self.now_ns))

    def stop(self) -> None:
        """Emergency stop, until `clear`."""
        self.motors.write(self.link.stop(self.now_ns))

    def clear(self) -> None:
        """Lift the emergency stop."""
        self.link.clear(self.now_ns)

    def run_until(self, time_ns: int) -> list[Message]:
        """Physics, firmware and talk up to `time_ns` of the computer's clock; what the board told."""
        messages: list[Message] = []
        while (now_ns := self.now_ns) < time_ns:
            self.motors.write(self.link.speak(now_ns))
            self.motors.run_until(min(now_ns + TALK_NS, time_ns) - self._offset_ns)
            messages += self.link.hear(self.motors.read(), self.now_ns)
            if self.now_ns == now_ns:
                break  # less than a control step is left
        return messages

    def _wake(self) -> None:
        """The robot is switched on WAKE_NS before its programs: hands are shaken, the IMU runs, it stands still.

        The computer's clock is as it was, so that they find a board that may drive.
        """
        self._offset_ns -= WAKE_NS
        end_ns = self.now_ns + WAKE_NS
        while self.now_ns < end_ns:
            self.command(0.0, 0.0)
            self.run_until(self.now_ns + TALK_NS)
        if self.link.session.neutral_first:
            raise RuntimeError(f"the simulated board does not shake hands: {self.link.refused}")
