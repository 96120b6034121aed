"""The constants of the robot that are compiled into the motor board's firmware, as integers.

The board counts encoder ticks and has no metric units; the wheel radius only enters where the robot file
gives a limit in metres.
"""

from __future__ import annotations

import zlib
from typing import NamedTuple

from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.motion_limits import (
    max_acceleration,
    max_deceleration,
    max_speed,
    max_turn,
    max_wheel_speed,
)
from chefbot.robot.spec import DRIVE_EFFICIENCY, Robot

CONTROL_HZ = 100
"""Control rate of the firmware, Hz."""
MAX_NO_LOAD_TICKS = 32767
"""Maximum no-load speed of the motor, ticks/s, that the firmware's 32-bit arithmetic holds (core/robot.h)."""
MIN_ACCELERATION, MAX_ACCELERATION = 128, 102_000
"""Limits of acceleration and deceleration, ticks/s^2: below, a step of the ramp is under one tick/s; above, its
product overflows 32 bits."""
MAX_LAG_MS = 2000
"""Maximum time constant of the motor, ms."""
LOW_BATTERY_MARGIN = 0.05
"""The warning is given at this share above the voltage that stops the robot."""
MIN_PING_PERIOD = 6
"""Minimum period of the ultrasonic sensor, control steps: 60 ms, the shortest cycle in the HC-SR04 data
sheet."""


class FirmwareConstant(NamedTuple):
    """One integer constant of the firmware."""

    name: str
    """Name as in core/robot.h."""
    value: int
    unit: str
    source: str
    """Keys of the robot file that it is calculated from."""


def firmware_constants(robot: Robot) -> tuple[FirmwareConstant, ...]:
    """Return all constants in the order of the firmware's struct, the hash first.

    Raises RobotFileError where the encoder resolution is too high or too low for the board.
    """
    constants = _checked(robot, tuple(FirmwareConstant(*row) for row in _rows(robot)))
    text = "".join(f"{c.name}={c.value}\n" for c in constants) + _wiring_text(robot)
    return (FirmwareConstant("hash", zlib.crc32(text.encode()), "CRC-32", "all that follows"), *constants)


def _wiring_text(robot: Robot) -> str:
    """Return what the ports know besides the constants: the driver's inputs, and the pins that were moved."""
    pins = robot.board.pins.moved()
    return f"{robot.driver.inputs}\n" + "".join(f"{name}={pin}\n" for name, pin in pins.items())


def as_int32(value: int) -> int:
    """Interpret the low 32 bits of `value` as a signed number, as the firmware's struct holds them."""
    return (value + 2**31) % 2**32 - 2**31


def _rows(robot: Robot) -> tuple[tuple[str, int, str, str], ...]:
    """Return name, value, unit and source of all constants without the hash."""
    ticks = 1.0 / robot.metres_per_tick
    turn_wheel_speed = max_turn(robot) * robot.wheels.separation
    lag = min(round(1000 * _lag(robot)), MAX_LAG_MS)
    stop_millivolts = round(1000 * robot.battery.empty_voltage / robot.calibration.battery)
    low_millivolts = round(stop_millivolts * (1.0 + LOW_BATTERY_MARGIN))
    imu_period = max(1, round(CONTROL_HZ / robot.sensors.imu.rate))
    sonar = robot.sensors.ultrasonic
    ping_period = max(MIN_PING_PERIOD, round(CONTROL_HZ / sonar.rate)) if sonar else 0
    return (
        ("ticks_per_turn_milli", round(1000 * robot.motor.ticks_per_turn), "1/1000 tick", "motor"),
        ("max_wheel", int(max_wheel_speed(robot) * ticks), "ticks/s", "motor, body, wheels"),
        ("max_forward", round(max_speed(robot) * ticks), "ticks/s", "drive.max_speed, motor"),
        ("max_turn", round(turn_wheel_speed * ticks), "ticks/s", "drive.max_turn, wheels.separation"),
        ("acceleration", round(max_acceleration(robot) * ticks), "ticks/s^2", "drive.max_acceleration"),
        ("deceleration", round(max_deceleration(robot) * ticks), "ticks/s^2", "drive.max_deceleration"),
        ("no_load", round(robot.motor.no_load_tick_rate), "ticks/s", "motor.no_load_speed"),
        ("lag", lag, "ms", "motor, mass with body.payload, wheels"),
        ("battery_stop", stop_millivolts, "mV", "battery.empty_voltage, calibration.battery"),
        ("battery_low", low_millivolts, "mV", "battery.empty_voltage, calibration.battery"),
        ("imu_period", imu_period, "control steps", "sensors.imu.rate"),
        ("sonar_period", ping_period, "control steps", "sensors.ultrasonic.rate"),
        ("cliff_sensors", len(robot.sensors.cliff_sensors), "inputs", "sensors.cliffs.positions"),
        ("hold", int(robot.board.at_rest == "hold"), "1 or 0", "board.at_rest"),
        ("enable_diag", int(robot.driver.enable_diag), "1 or 0", "driver.enable_diag"),
    )


def _lag(robot: Robot) -> float:
    """Return the time constant, s, of one motor: half the loaded robot and the rotor against the motor's
    torque-speed line."""
    # Reflected inertia of half the mass at the wheel radius, plus the rotor.
    inertia = total_mass(robot) * robot.wheel_radius**2 / 2.0 + robot.motor.rotor_inertia
    # Linear torque-speed line: tau = J * (omega_no_load / T_stall) / eta.
    return inertia * robot.motor.speed_torque_gradient / DRIVE_EFFICIENCY


def _checked(robot: Robot, constants: tuple[FirmwareConstant, ...]) -> tuple[FirmwareConstant, ...]:
    value = {c.name: c.value for c in constants}
    if value["no_load"] > MAX_NO_LOAD_TICKS:
        raise RobotFileError(
            f"{robot.name}: the encoder gives {value['no_load']} ticks/s at full speed, the motor board counts "
            f"at most {MAX_NO_LOAD_TICKS}; use an encoder with fewer counts, or count fewer edges."
        )
    for limit in ("acceleration", "deceleration"):
        if not MIN_ACCELERATION <= value[limit] <= MAX_ACCELERATION:
            raise RobotFileError(
                f"{robot.name}: drive.max_{limit} is {value[limit]} ticks/s^2, the motor board takes "
                f"{MIN_ACCELERATION} to {MAX_ACCELERATION}; change motor.encoder_counts or drive.max_{limit}."
            )
    return constants
