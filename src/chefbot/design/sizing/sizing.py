"""The design sheet of a robot: requirements of the drive, results of motors, driver and battery, stability.

The chapter's own method is in `chapter_method`; here the weight is that of the solids, the torque follows
from the forces on the robot instead of from the grip, and speed, heat, energy and stability are checked.
"""

from __future__ import annotations

import math

from chefbot.design.sizing import dc_motor, energy_budget, forces
from chefbot.design.sizing.calculation import Result, calculated
from chefbot.design.sizing.requirements import (
    SPEED_RESERVE,
    WORST_SHARE_OF_STALL,
    required_wheel_speed,
    turn_rate,
    wheel_speed,
)
from chefbot.design.sizing.stability import Load, tipping
from chefbot.robot.geometry import layout
from chefbot.robot.spec import Robot


def drive_requirements(robot: Robot, load: Load) -> list[Result]:
    """Return the forces, torques and speed that the drive must reach."""
    mass, payload, cases = load.mass, robot.body.payload, forces.duties(robot)
    return [
        calculated("mass with payload", mass, "kg", "b + p", "solids", b=mass - payload, p=payload),
        *(forces.force(mass, case) for case in cases),
        forces.grip(robot, mass, robot.drive.max_slope),
        *(forces.motor_torque(robot, mass, case) for case in cases),
        forces.slip_torque(robot, mass),
        _needed_speed(robot),
    ]  # fmt: skip


def component_results(robot: Robot, load: Load) -> list[Result]:
    """Return the results of the motor, and the requirements of driver and battery."""
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


def stability_results(robot: Robot, load: Load) -> list[Result]:
    """Return the clearance below the motor, and limit and expected value of each way of tipping."""
    return [
        _motor_clearance(robot),
        *(
            result._replace(name=f"{case.name}: {result.name}")
            for case in tipping(robot, load)
            for result in (case.limit, case.expected)
        ),
    ]


def _needed_speed(robot: Robot) -> Result:
    return calculated(
        "speed of the wheels, with reserve", required_wheel_speed(robot), "rad/s", "k * v / r",
        "20 to 30 % to correct with", k=SPEED_RESERVE, v=robot.drive.max_speed, r=robot.wheel_radius,
    )  # fmt: skip


def _usable_torque(robot: Robot) -> Result:
    stall = dc_motor.stall_torque(robot.motor, robot.battery.empty_voltage).value
    return calculated(
        "torque for a moment, empty battery", WORST_SHARE_OF_STALL * stall, "N m", "k * T",
        "maximum-power point of the motor line", k=WORST_SHARE_OF_STALL, T=stall,
    )  # fmt: skip


def _turn_rate(robot: Robot, mass: float) -> Result:
    rims = wheel_speed(robot, mass) * robot.wheel_radius
    return calculated(
        "turn rate on the spot", turn_rate(robot, mass), "rad/s", "2 * v / L", "differential drive",
        v=rims, L=robot.wheels.separation,
    )  # fmt: skip


def _motor_clearance(robot: Robot) -> Result:
    motor = robot.motor
    return calculated(
        "clearance below the motor's body", layout.motor_bottom(robot), "m", "r + o - d / 2", motor.title,
        r=robot.wheel_radius, o=motor.shaft_offset, d=motor.diameter,
    )  # fmt: skip


def smallest_wheel(robot: Robot) -> float:
    """Return the diameter at which the motor's body keeps the wanted clearance, m, rounded up to millimetres."""
    motor = robot.motor
    radius = robot.body.clearance - motor.shaft_offset + motor.diameter / 2.0
    return math.ceil(2000.0 * radius - 1e-6) / 1000.0
