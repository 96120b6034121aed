"""The energy budget: mean power, run time, the peak current and the fuse for it."""

from __future__ import annotations

from chefbot.design.sizing import dc_motor
from chefbot.design.sizing.calculation import Result, calculated
from chefbot.design.sizing.forces import (
    CRUISE_ON_CARPET,
    DRIVEN_WHEELS,
    motor_torque,
    requested_wheel_speed,
    worst,
)
from chefbot.robot.spec import Robot

CONVERTER_EFFICIENCY = 0.9
"""Efficiency of the converters between battery and electronics (typical, not measured)."""
FUSE_RESERVE = 1.25
"""Permitted continuous load of a fuse over its rating (Littelfuse, Fuseology)."""
FUSES = (1.0, 2.0, 3.0, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0, 80.0, 100.0)
"""Amperes of blade fuses, ISO 8820-3."""
SOURCE = "energy balance; battery's sheet"


def driving_power(robot: Robot, mass: float) -> Result:
    """Return the power of both motors at full speed on level carpet, W."""
    torque = motor_torque(robot, mass, CRUISE_ON_CARPET).value
    across = dc_motor.voltage(robot.motor, torque, requested_wheel_speed(robot)).value
    drawn = dc_motor.current(robot.motor, torque, "").value
    return calculated(
        "power of both motors, cruising on carpet", DRIVEN_WHEELS * across * drawn, "W", "n * U * I",
        dc_motor.SOURCE, n=DRIVEN_WHEELS, U=across, I=drawn,
    )  # fmt: skip


def standing_power(robot: Robot) -> float:
    """Return the power that a standing robot draws from the battery, W."""
    return robot.power.electronics / CONVERTER_EFFICIENCY


def mean_power(robot: Robot, mass: float) -> Result:
    """Return the mean power of continuous driving with all electronics on, W."""
    motors, electronics = driving_power(robot, mass).value, robot.power.electronics
    value = motors + standing_power(robot)
    return calculated(
        "power from the battery", value, "W", "M + E / eta", SOURCE,
        M=motors, E=electronics, eta=CONVERTER_EFFICIENCY,
    )  # fmt: skip


def usable_energy(robot: Robot) -> Result:
    """Return the energy down to the charge at which the robot must stop, J."""
    battery = robot.battery
    value = battery.capacity * battery.voltage * battery.usable
    return calculated(
        "usable energy of the battery", value, "J", "Q * V * u", battery.title,
        Q=battery.capacity, V=battery.voltage, u=battery.usable,
    )  # fmt: skip


def run_time(robot: Robot, mass: float) -> Result:
    """Return the run time of one charge, s."""
    energy, power = usable_energy(robot).value, mean_power(robot, mass).value
    return calculated("run time", energy / power, "s", "E / P", SOURCE, E=energy, P=power)


def highest_draw(robot: Robot, mass: float) -> Result:
    """Return the peak current of the nearly empty battery while accelerating on the ramp, A."""
    drawn = dc_motor.current(robot.motor, motor_torque(robot, mass, worst(robot)).value, "").value
    electronics, empty = robot.power.electronics, robot.battery.empty_voltage
    value = DRIVEN_WHEELS * drawn + electronics / (CONVERTER_EFFICIENCY * empty)
    return calculated(
        "highest current from the battery", value, "A", "n * I + E / (eta * V)", SOURCE,
        n=DRIVEN_WHEELS, I=drawn, E=electronics, eta=CONVERTER_EFFICIENCY, V=empty,
    )  # fmt: skip


def fuse(robot: Robot, mass: float) -> Result:
    """Return the next blade fuse above the peak current, A; above the largest fuse, the calculated value."""
    draw = highest_draw(robot, mass).value
    wanted = FUSE_RESERVE * draw
    value = next((rating for rating in FUSES if rating >= wanted), wanted)
    return calculated(
        "fuse", value, "A", "next rating from k * I", "ISO 8820-3; Littelfuse, Fuseology",
        k=FUSE_RESERVE, I=draw,
    )  # fmt: skip
