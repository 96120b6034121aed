"""The simulated motor board together with the computer's end of the serial link."""

from __future__ import annotations

from chefbot.board.link import BoardLink
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot
from chefbot.sim.firmware import CONTROL_NS
from chefbot.sim.motor_board import SimulatedMotorBoard
from chefbot.sim.simulation import Simulation

EXCHANGE_PERIOD_NS = 20_000_000
"""Period at which the computer reads from and writes to the serial link."""
STARTUP_NS = 300_000_000
"""Duration of the board's start-up; the IMU takes 0.22 s of it."""


class SimulatedBoard:
    """The path from wheel-speed command to sensor message, as bytes through serial link and firmware."""

    def __init__(self, robot: Robot, simulation: Simulation, start_ns: int = 0) -> None:
        """Switch the board on and complete its start-up; `start_ns` is the computer's clock at this time."""
        self.robot = robot
        self._simulation = simulation
        self._offset_ns = start_ns - simulation.time_ns
        self.clock_jump_ns = 0
        """Time by which the clock of the driver is ahead of the computer's."""
        self.link = BoardLink(robot)
        self.motors = SimulatedMotorBoard(robot, simulation)
        self._start_up()

    @property
    def now_ns(self) -> int:
        """Time of the computer's clock, ns."""
        return self._simulation.time_ns + self._offset_ns

    @property
    def driver_ns(self) -> int:
        """Time of the clock with which the driver stamps messages, ns."""
        return self.now_ns + self.clock_jump_ns

    def command(self, left: float, right: float) -> None:
        """Send the wheels' angular velocities, rad/s; the board stops if no new command arrives within 150 ms.

        The board drives only after it has received a zero command.
        """
        self.motors.write(self.link.command(left, right, self.driver_ns))

    def stop(self) -> None:
        """Send an emergency stop; it stays active until `clear`."""
        self.motors.write(self.link.stop(self.driver_ns))

    def clear(self) -> None:
        """Release the emergency stop of the board."""
        self.link.clear(self.driver_ns)

    def run_until(self, time_ns: int) -> list[Message]:
        """Run physics, firmware and serial link up to `time_ns` of the computer's clock; return the
        messages."""
        messages: list[Message] = []
        # A remaining time shorter than a control step is left for the next call.
        while (now_ns := self.now_ns) + CONTROL_NS <= time_ns:
            self.motors.write(self.link.data_to_send(self.driver_ns))
            self.motors.run_until(min(now_ns + EXCHANGE_PERIOD_NS, time_ns) - self._offset_ns)
            messages += self.link.receive_data(self.motors.read(), self.driver_ns)
        return messages

    def _start_up(self) -> None:
        """Run the board for STARTUP_NS before the computer's programs start: handshake, IMU start-up, robot at
        rest.

        The computer's clock is set back by as much, so that at `start_ns` the board is ready to drive.
        """
        self._offset_ns -= STARTUP_NS
        end_ns = self.now_ns + STARTUP_NS
        while self.now_ns < end_ns:
            self.command(0.0, 0.0)
            self.run_until(self.now_ns + EXCHANGE_PERIOD_NS)
        if self.link.session.neutral_first:
            raise RuntimeError(f"handshake with the simulated board failed: {self.link.refused}")
