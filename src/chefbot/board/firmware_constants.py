"""What the motor board's firmware must know of the robot, as whole numbers.

The board counts encoder ticks and knows no metres; the radius of a wheel only enters where the robot file gives a
limit in metres.
"""

from __future__ import annotations

import math
import zlib
from typing import NamedTuple

from chefbot.errors import UserError
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.motion_limits import max_acceleration, max_speed, max_turn, max_wheel_speed
from chefbot.robot.spec import DRIVE_EFFICIENCY, Robot

CONTROL_HZ = 100
"""Control steps per second of the firmware."""
MOST_TICKS = 32767
"""Ticks/s of the motor without load that the firmware's 32-bit arithmetic holds (core/robot.h)."""
LEAST_ACCELERATION, MOST_ACCELERATION = 128, 102_000
"""Ticks/s^2: below, a step of the ramp is under one tick/s; above, its product leaves 32 bits."""
MOST_LAG = 2000
"""Milliseconds."""
LOW_BATTERY_MARGIN = 0.05
"""The warning comes this share above the voltage that stops the robot."""
SHORTEST_PING_PERIOD = 6
"""Control steps: 60 ms, the HC-SR04 data sheet's shortest cycle."""


class Constant(NamedTuple):
    """One number of the firmware."""

    name: str
    """As in core/robot.h."""
    value: int
    unit: str
    source: str
    """Keys of the robot file that it comes from."""


def firmware_constants(robot: Robot) -> tuple[Constant, ...]:
    """All constants in the order of the firmware's struct, the hash first.

    Raises UserError where the board cannot count so fine or so coarse an encoder.
    """
    constants = _checked(robot, (*_motion(robot), *_power_and_sensors(robot)))
    text = "".join(f"{c.name}={c.value}\n" for c in constants)
    return (Constant("hash", zlib.crc32(text.encode()), "CRC-32", "all that follows"), *constants)


def as_int32(value: int) -> int:
    """The 32 bits of `value` read as a signed number, as the firmware's struct holds them."""
    return (value + 2**31) % 2**32 - 2**31


def _motion(robot: Robot) -> tuple[Constant, ...]:
    per_turn = robot.motor.ticks_per_turn
    per_metre = per_turn / (2.0 * math.pi * robot.wheel_radius)
    no_load = robot.motor.no_load_speed * per_turn / (2.0 * math.pi)
    turn = max_turn(robot) * robot.wheels.separation
    return (
        Constant("ticks_per_turn_milli", round(1000 * per_turn), "1/1000 tick", "motor"),
        Constant("max_wheel", int(max_wheel_speed(robot) * per_metre), "ticks/s", "motor, body, wheels"),
        Constant("max_forward", round(max_speed(robot) * per_metre), "ticks/s", "drive.max_speed, motor"),
        Constant("max_turn", round(turn * per_metre), "ticks/s", "drive.max_turn, wheels.separation"),
        Constant(
            "acceleration", round(max_acceleration(robot) * per_metre), "ticks/s^2", "drive.max_acceleration"
        ),
        Constant("no_load", round(no_load), "ticks/s", "motor.no_load_speed"),
        Constant(
            "lag", min(round(1000 * _lag(robot)), MOST_LAG), "ms", "motor, mass with body.payload, wheels"
        ),
    )


def _lag(robot: Robot) -> float:
    """Seconds: time constant of half the loaded robot and a rotor on the line of one motor."""
    inertia = total_mass(robot) * robot.wheel_radius**2 / 2.0 + robot.motor.rotor_inertia
    return inertia * robot.motor.no_load_speed / (DRIVE_EFFICIENCY * robot.motor.stall_torque)


def _power_and_sensors(robot: Robot) -> tuple[Constant, ...]:
    stop = round(1000 * robot.battery.empty_voltage)
    imu = max(1, round(CONTROL_HZ / robot.sensors.imu.rate))
    sonar = robot.sensors.ultrasonic
    ping = max(SHORTEST_PING_PERIOD, round(CONTROL_HZ / sonar.rate)) if sonar else 0
    return (
        Constant("battery_stop", stop, "mV", "battery.empty_voltage"),
        Constant("battery_low", round(stop * (1.0 + LOW_BATTERY_MARGIN)), "mV", "battery.empty_voltage"),
        Constant("imu_period", imu, "control steps", "sensors.imu.rate"),
        Constant("sonar_period", ping, "control steps", "sensors.ultrasonic.rate"),
    )


def _checked(robot: Robot, constants: tuple[Constant, ...]) -> tuple[Constant, ...]:
    value = {c.name: c.value for c in constants}
    if value["no_load"] > MOST_TICKS:
        raise UserError(
            f"{robot.name}: the encoder gives {value['no_load']} ticks/s at full speed, the motor board counts "
            f"at most {MOST_TICKS}; use an encoder with fewer counts, or count fewer edges."
        )
    if not LEAST_ACCELERATION <= value["acceleration"] <= MOST_ACCELERATION:
        raise UserError(
            f"{robot.name}: drive.max_acceleration is {value['acceleration']} ticks/s^2, the motor board takes "
            f"{LEAST_ACCELERATION} to {MOST_ACCELERATION}; change motor.encoder_counts or drive.max_acceleration."
        )
    return constants
