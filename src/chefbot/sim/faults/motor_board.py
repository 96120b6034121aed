"""Faults of the motor board: its sensors, its battery measurement and its serial link."""

from __future__ import annotations

import numpy as np
from numpy.random import default_rng

from chefbot.sim.faults.board_sensors import TURN_RATE, FaultyEncoders, FaultyReading
from chefbot.sim.faults.serial_link import FaultySerialLink
from chefbot.sim.firmware import Firmware, imu_scale

_SEED_SALT = 0xFA017
"""Separates this random stream from others with the same seed."""


class MotorBoardFaults:
    """Fault injectors at the pins, registers and bytes of one board; without faults they change nothing."""

    def __init__(self, firmware: Firmware, seed: int) -> None:
        rngs = [default_rng([seed, _SEED_SALT, stream]) for stream in range(4)]
        turn_rate = np.zeros(7)
        turn_rate[TURN_RATE] = imu_scale()[1]
        self.imu = FaultyReading(rngs[0], offset=turn_rate)
        """Registers ax ay az temperature gx gy gz, LSB."""
        self.ultrasonic = FaultyReading(rngs[1], offset=np.ones(1))
        """Distance of the echo, m."""
        self.encoders = FaultyEncoders(rngs[2])
        self.serial_link = FaultySerialLink(firmware.write, firmware.read, rngs[3])
        self.wrong_voltage_reading: float | None = None
        """Voltage that the board measures whatever the battery has, V."""

    def measured_voltage(self, voltage: float) -> float:
        """Return the voltage that the board measures, V."""
        return voltage if self.wrong_voltage_reading is None else self.wrong_voltage_reading
