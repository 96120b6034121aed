"""The design sheet of a robot: what driving needs, what its motors, driver and battery give, whether it tips.

The chapter's own method is in `chapter_method`; here the weight is that of the solids, torque comes from the forces
on the robot instead of from the grip, and speed, heat, energy and stability are looked at.
"""

from __future__ import annotations

import math

from chefbot.design.sizing import dc_motor, energy_budget, forces
from chefbot.design.sizing.calculation import Result, worked
from chefbot.design.sizing.requirements import (
    SPEED_RESERVE,
    WORST_SHARE_OF_STALL,
    turn_rate,
    wanted_speed,
    wheel_speed,
)
from chefbot.design.sizing.stability import Load, tipping
from chefbot.robot.geometry import layout
from chefbot.robot.spec import Robot


def needs(robot: Robot, load: Load) -> list[Result]:
    """Forces, torques and speed that the drive must reach."""
    mass, cases = load.mass, forces.duties(robot)
    return [
        worked("mass with payload", mass, "kg", "b + p", "solids", b=mass - robot.body.payload, p=robot.body.payload),
        *(forces.force(mass, case) for case in cases),
        forces.grip(robot, mass, robot.drive.max_slope),
        *(forces.motor_torque(robot, mass, case) for case in cases),
        forces.slip_torque(robot, mass),
        _needed_speed(robot),
    ]  # fmt: skip


def gives(robot: Robot, load: Load) -> list[Result]:
    """What the motor gives, and what driver and battery must."""
    mass, motor, battery = load.mass, robot.motor, robot.battery
    cruising = forces.motor_torque(robot, mass, forces.CRUISE_ON_CARPET).value
    climbing = forces.motor_torque(robot, mass, forces.climb(robot)).value
    hardest = forces.motor_torque(robot, mass, forces.worst(robot)).value
    return [
        _usable_torque(robot),
        dc_motor.speed(motor, cruising, battery.empty_voltage, "speed on carpet, empty battery"),
        dc_motor.current(motor, cruising, "current of a motor, cruising on carpet"),
        dc_motor.current(motor, climbing, "current of a motor on the ramp"),
        dc_motor.current(motor, hardest, "current of a motor, speeding up on the ramp"),
        dc_motor.stall_current(motor, battery.full_voltage),
        _turn_rate(robot, mass),
        energy_budget.driving_power(robot, mass),
        energy_budget.mean_power(robot, mass),
        energy_budget.usable_energy(robot),
        energy_budget.run_time(robot, mass),
        energy_budget.highest_draw(robot, mass),
        energy_budget.fuse(robot, mass),
    ]


def stands(robot: Robot, load: Load) -> list[Result]:
    """Clearance below the motor, and for each way of tipping what the robot bears and what it may meet."""
    return [
        _motor_clearance(robot),
        *(
            result._replace(name=f"{case.name}: {result.name}")
            for case in tipping(robot, load)
            for result in (case.bears, case.meets)
        ),
    ]


def _needed_speed(robot: Robot) -> Result:
    return worked(
        "speed of the wheels, with reserve", wanted_speed(robot), "rad/s", "k * v / r",
        "20 to 30 % to correct with", k=SPEED_RESERVE, v=robot.drive.max_speed, r=robot.wheel_radius,
    )  # fmt: skip


def _usable_torque(robot: Robot) -> Result:
    stall = dc_motor.stall_torque(robot.motor, robot.battery.empty_voltage).value
    return worked(
        "torque for a moment, empty battery", WORST_SHARE_OF_STALL * stall, "N m", "k * T",
        "maximum-power point of the motor line", k=WORST_SHARE_OF_STALL, T=stall,
    )  # fmt: skip


def _turn_rate(robot: Robot, mass: float) -> Result:
    rims = wheel_speed(robot, mass) * robot.wheel_radius
    return worked(
        "turn rate on the spot", turn_rate(robot, mass), "rad/s", "2 * v / L", "differential drive",
        v=rims, L=robot.wheels.separation,
    )  # fmt: skip


def _motor_clearance(robot: Robot) -> Result:
    motor = robot.motor
    return worked(
        "clearance below the motor's body", layout.motor_bottom(robot), "m", "r + o - d / 2", motor.title,
        r=robot.wheel_radius, o=motor.shaft_offset, d=motor.diameter,
    )  # fmt: skip


def smallest_wheel(robot: Robot) -> float:
    """Diameter at which the motor's body keeps the wanted clearance, m, up to the next millimetre."""
    motor = robot.motor
    radius = robot.body.clearance - motor.shaft_offset + motor.diameter / 2.0
    return math.ceil(2000.0 * radius - 1e-6) / 1000.0
