"""The motor board in the simulated robot: the firmware itself, in step with the physics."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import default_rng

from chefbot.board.firmware_constants import firmware_constants
from chefbot.robot.spec import Robot
from chefbot.sim.firmware import CONTROL_NS, DUTY_FULL, NO_ECHO, Firmware, FirmwareState, imu_scale
from chefbot.sim.simulation import STEP_NS, Simulation

SOUND = 343.2
"""m/s, air of 20 degC."""
RAIL = 32767
ROOM_TEMPERATURE, RIPPLE = -3920, 3
"""LSB: 25 degC, and the width of its noise. So a robot without noise of its own has no sensor that looks stuck."""


class MotorBoard:
    """Bytes of docs/protocol.md in and out; encoders, IMU, battery, ranger and motors are the simulation's.

    The board is made for the robot as drawn, which the simulated one differs from.
    """

    def __init__(self, robot: Robot, simulation: Simulation) -> None:
        self._simulation = simulation
        self.firmware = Firmware(robot)
        constants = {constant.name: constant.value for constant in firmware_constants(robot)}
        self._ping_ns = constants["sonar_period"] * CONTROL_NS
        self._boot_ns = simulation.time_ns
        self._restarts = 0
        self._ticks = simulation.wheel_ticks()
        self._lsb_per_force, self._lsb_per_rate = imu_scale()
        self._temperature = default_rng(simulation.seed)

    @property
    def state(self) -> FirmwareState:
        """What the board puts out now."""
        return self.firmware.state

    def write(self, data: bytes) -> None:
        """From the computer; obeyed from the next control step on. What the line cannot hold is lost."""
        self.firmware.write(data)

    def read(self) -> bytes:
        """All that the board has said since the last call."""
        return self.firmware.read()

    def run_until(self, time_ns: int) -> None:
        """Physics and firmware, as many whole control steps as end by `time_ns`."""
        while self._simulation.time_ns + CONTROL_NS <= time_ns:
            self._step()

    def _step(self) -> None:
        """The motors get what the last control step decided; then it is told what came of it."""
        simulation, state = self._simulation, self.firmware.state
        began_ns = simulation.time_ns
        simulation.set_duty(state.duty[0] / DUTY_FULL, state.duty[1] / DUTY_FULL)
        simulation.set_drivers(bool(state.drivers))
        for _ in range(CONTROL_NS // STEP_NS):
            simulation.step()
        self._fill_imu()
        if self._ping_ns and (simulation.time_ns - self._boot_ns) % self._ping_ns == 0:
            self.firmware.hear(_echo(simulation.echo()))
        before, self._ticks = self._ticks, simulation.wheel_ticks()
        moved = (self._ticks[0] - before[0], self._ticks[1] - before[1])
        self.firmware.step(moved, round(1000.0 * simulation.battery.voltage))
        if state.restarts != self._restarts:
            self._boot_ns, self._restarts = began_ns, state.restarts

    def _fill_imu(self) -> None:
        """The registers as the chip's converters would fill them, with whole numbers up to its rails."""
        rates, force = self._simulation.imu()
        registers = self.firmware.imu
        registers[:3] = np.rint(np.clip(force * self._lsb_per_force, -RAIL, RAIL))
        registers[3] = ROOM_TEMPERATURE + self._temperature.integers(RIPPLE)
        registers[4:] = np.rint(np.clip(rates * self._lsb_per_rate, -RAIL, RAIL))


def _echo(distance: float) -> int:
    """Microseconds of the round trip over metres; at least one, as 0 means that nothing came back."""
    return NO_ECHO if math.isinf(distance) else max(1, round(2e6 * distance / SOUND))


assert CONTROL_NS % STEP_NS == 0
