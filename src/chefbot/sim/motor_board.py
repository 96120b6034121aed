"""The motor board of the simulated robot: the real firmware, run in lockstep with the physics."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import default_rng

from chefbot.board.firmware_constants import firmware_constants
from chefbot.robot.spec import Robot
from chefbot.sim.cliff_sensors import SimulatedCliffSensors
from chefbot.sim.faults.motor_board import MotorBoardFaults
from chefbot.sim.firmware import CONTROL_NS, DUTY_FULL, NO_ECHO, NO_SENSOR, Firmware, imu_scale
from chefbot.sim.simulation import STEP_NS, Simulation

SPEED_OF_SOUND = 343.2
"""Speed of sound in air at 20 degC, m/s."""
RAIL = 32767
"""Largest value of an IMU register, LSB."""
TEMPERATURE_LSB, TEMPERATURE_NOISE_LSB = -3920, 3
"""IMU temperature register at 25 degC and the width of its noise, LSB; the noise keeps a robot without sensor
noise from looking frozen."""


class SimulatedMotorBoard:
    """The real firmware between the protocol bytes of docs/protocol.md and the simulated hardware.

    Encoders, IMU, battery, ranger, cliff sensors and motors are those of the simulation. The firmware is configured
    for the robot as drawn, from which the simulated one deviates.
    """

    def __init__(self, robot: Robot, simulation: Simulation) -> None:
        self._simulation = simulation
        self.firmware = Firmware(robot)
        self.faults = MotorBoardFaults(self.firmware, simulation.seed)
        # The outputs are the firmware's, and so is the board's end of the serial link.
        self.write, self.read = self.faults.serial_link.write, self.faults.serial_link.read
        self.state = self.firmware.state
        constants = {constant.name: constant.value for constant in firmware_constants(robot)}
        self._ping_period_ns = constants["sonar_period"] * CONTROL_NS
        self._boot_ns = simulation.time_ns
        self._restart_count = 0
        self._ticks = simulation.wheel_ticks()
        self._lsb_per_force, self._lsb_per_rate = imu_scale()
        self._cliffs = SimulatedCliffSensors.of(robot, simulation.world)
        self._temperature = default_rng(simulation.seed)

    def run_until(self, time_ns: int) -> None:
        """Run physics and firmware for as many full control steps as end by `time_ns`."""
        while self._simulation.time_ns + CONTROL_NS <= time_ns:
            self._step()

    def _step(self) -> None:
        """Run one control step: apply the last outputs to the motors, then measure and run the firmware."""
        simulation, state = self._simulation, self.firmware.state
        start_ns = simulation.time_ns
        # Actuation: the duties of the previous control step, held over the physics steps.
        simulation.set_duty(state.duty[0] / DUTY_FULL, state.duty[1] / DUTY_FULL)
        simulation.set_drivers(bool(state.drivers))
        for _ in range(CONTROL_NS // STEP_NS):
            simulation.step()
        # Measurements: IMU registers, ultrasonic echo, cliff sensors, encoder ticks and battery voltage.
        self._write_imu_registers()
        if self._ping_period_ns and (simulation.time_ns - self._boot_ns) % self._ping_period_ns == 0:
            self.firmware.set_echo(self._echo())
        if self._cliffs is not None:
            self.firmware.set_cliffs(self._cliffs.measure(simulation.truth().pose))
        previous, self._ticks = self._ticks, simulation.wheel_ticks()
        moved_ticks = (self._ticks[0] - previous[0], self._ticks[1] - previous[1])
        moved_ticks = self.faults.encoders.apply(moved_ticks, simulation.time_ns)
        self.firmware.step(
            moved_ticks, round(1000.0 * self.faults.measured_voltage(simulation.battery.voltage))
        )
        if state.restarts != self._restart_count:
            self._boot_ns, self._restart_count = start_ns, state.restarts

    def _write_imu_registers(self) -> None:
        """Write the IMU registers as the chip's converters do: rounded and saturated."""
        rates, force = self._simulation.imu()
        temperature = TEMPERATURE_LSB + int(self._temperature.integers(TEMPERATURE_NOISE_LSB))
        accelerations = [_register(value * self._lsb_per_force) for value in force.tolist()]
        angular_rates = [_register(value * self._lsb_per_rate) for value in rates.tolist()]
        registers = [*accelerations, temperature, *angular_rates]
        if self.faults.imu.faults:
            faulty = self.faults.imu.apply(np.array(registers, dtype=np.float64), self._simulation.time_ns)
            registers = list(map(_register, faulty.tolist()))
        self.firmware.imu[:] = [*registers]

    def _echo(self) -> int:
        """Return the round-trip time of an echo in microseconds; at least 1, since 0 means no echo."""
        distance = self._simulation.echo()
        if self.faults.ultrasonic.stopped:
            return NO_SENSOR
        if self.faults.ultrasonic.faults:
            distance = float(self.faults.ultrasonic.apply(np.array([distance]), self._simulation.time_ns)[0])
        return NO_ECHO if math.isinf(distance) else max(1, round(2e6 * distance / SPEED_OF_SOUND))


def _register(value: float) -> int:
    """Return the content of a register that measures `value` LSB."""
    return round(max(-RAIL, min(RAIL, value)))
