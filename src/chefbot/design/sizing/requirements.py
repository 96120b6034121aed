"""Requirements of a robot's motors, driver and battery, each as a figure against a bound."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from chefbot.design.sizing import dc_motor, energy_budget
from chefbot.design.sizing.forces import (
    CRUISE_ON_CARPET,
    DRIVEN_WHEELS,
    climb,
    force,
    grip,
    motor_torque,
    requested_wheel_speed,
    worst,
)
from chefbot.design.sizing.mounting_clearance import battery_clearance, driver_clearance
from chefbot.design.sizing.stability import SAFETY, Load, tipping
from chefbot.robot.geometry import layout
from chefbot.robot.motion_limits import turn_rate_on_spot
from chefbot.robot.spec import Robot

SPEED_RESERVE = 1.2
"""Speed reserve at an empty battery: a closed loop needs 20 to 30 % for corrections."""
WORST_SHARE_OF_STALL = 0.5
"""Beyond half the stall torque a motor gives less power and more heat (maximum-power point of the line)."""
OVERVOLTAGE = 1.25
"""Maximum voltage of a full battery over the motor's rated voltage, for its life."""
TIPS_LESS = "body.radius"
"""The key that moves wheels and casters apart."""
WHEEL = "wheels.diameter"
LOGIC_SHARE = 0.9
"""Share of the voltage of the board's outputs that remains under load and noise."""
Part = Literal["motor", "driver", "battery", "robot"]


class Check(NamedTuple):
    """One figure, SI, against a bound; `key` is the key of the robot file to change."""

    part: Part
    name: str
    have: float
    bound: float
    unit: str
    at_least: bool
    key: str

    @property
    def lack(self) -> float:
        """Return the shortfall or excess as a share of the larger of the two; 0 if the check passes."""
        gap = self.bound - self.have if self.at_least else self.have - self.bound
        return 0.0 if gap <= 1e-9 * abs(self.bound) else gap / max(abs(self.bound), abs(self.have))

    @property
    def passed(self) -> bool:
        """Return whether the figure keeps the bound."""
        return self.lack == 0.0


def at_least(part: Part, name: str, have: float, bound: float, unit: str, key: str = "") -> Check:
    """Return the check that `have` reaches `bound`; the key is by default the part's own."""
    return Check(part, name, have, bound, unit, True, key or part)


def at_most(part: Part, name: str, have: float, bound: float, unit: str, key: str = "") -> Check:
    """Return the check that `have` does not exceed `bound`."""
    return Check(part, name, have, bound, unit, False, key or part)


def judge(robot: Robot, load: Load) -> list[Check]:
    """Return all checks of a robot; `load` is its mass and centre with the payload."""
    return [
        *motor_checks(robot, load.mass),
        *driver_checks(robot, load.mass),
        *battery_checks(robot, load.mass),
        *robot_checks(robot, load),
    ]


def motor_checks(robot: Robot, mass: float) -> list[Check]:
    """Return the checks of torque, heat, speed, voltage and space."""
    motor, empty = robot.motor, robot.battery.empty_voltage
    hardest = motor_torque(robot, mass, worst(robot)).value
    lasting = motor_torque(robot, mass, climb(robot)).value
    strong = WORST_SHARE_OF_STALL * dc_motor.stall_torque(motor, empty).value
    full, high = robot.battery.full_voltage, OVERVOLTAGE * motor.voltage
    speed, turn = wheel_speed(robot, mass), turn_rate(robot, mass)
    bottom, front = layout.motor_bottom(robot), layout.motor_front(robot)
    return [
        at_most("motor", "rated voltage against the full battery", full, high, "V", "battery"),
        at_least("motor", "torque on the ramp", strong, hardest, "N m"),
        at_least("motor", "continuous torque", motor.continuous_torque, lasting, "N m"),
        at_least("motor", "speed with reserve", speed, required_wheel_speed(robot), "rad/s"),
        at_least("motor", "turn rate", turn, robot.drive.max_turn, "rad/s", "drive.max_turn"),
        at_least("motor", "clearance below it", bottom, robot.body.clearance, "m", WHEEL),
        at_most("motor", "length", motor.length, front, "m", "wheels.separation"),
    ]


def driver_checks(robot: Robot, mass: float) -> list[Check]:
    """Return the checks of the voltages of battery and board, the motor currents, and space."""
    driver, battery, level = robot.driver, robot.battery, LOGIC_SHARE * robot.board.logic
    lasting = dc_motor.current(robot.motor, motor_torque(robot, mass, climb(robot)).value, "").value
    stalled = dc_motor.stall_current(robot.motor, battery.full_voltage).value
    return [
        at_least("driver", "highest voltage", driver.voltage_max, battery.full_voltage, "V"),
        at_most("driver", "lowest voltage", driver.voltage_min, battery.empty_voltage, "V"),
        at_least("driver", "continuous current", driver.continuous_current, lasting, "A"),
        at_most("driver", "input level without a level shifter", driver.logic_high_min, level, "V"),
        at_least("driver", "current of a stalled motor", driver.peak_current, stalled, "A"),
        at_least("driver", "room round it", driver_clearance(robot), 0.0, "m", "places.driver"),
    ]


def battery_checks(robot: Robot, mass: float) -> list[Check]:
    """Return the checks of energy, current and space."""
    run_time, draw = energy_budget.run_time(robot, mass).value, energy_budget.highest_draw(robot, mass).value
    given = robot.battery.continuous_current
    return [
        at_least("battery", "run time", run_time, robot.power.run_time, "s"),
        at_least("battery", "current", given, draw, "A"),
        at_least("battery", "room round it", battery_clearance(robot), 0.0, "m", "places.battery"),
    ]


def robot_checks(robot: Robot, load: Load) -> list[Check]:
    """Return the checks of grip and tipping, which no motor can improve."""
    push, held = force(load.mass, worst(robot)).value, grip(robot, load.mass, robot.drive.max_slope).value
    slips = at_least("robot", "grip on the ramp", held, push, "N", "drive.max_acceleration")
    tips = [
        at_least(
            "robot", f"tipping, {case.name}", case.limit.value, SAFETY * case.expected.value, "g", TIPS_LESS
        )
        for case in tipping(robot, load)
    ]
    return [slips, *tips]


def wheel_speed(robot: Robot, mass: float) -> float:
    """Return the wheel speed on level carpet with an empty battery, rad/s; 0 if the motors cannot move the robot."""
    torque = motor_torque(robot, mass, CRUISE_ON_CARPET).value
    return max(dc_motor.speed(robot.motor, torque, robot.battery.empty_voltage, "").value, 0.0)


def required_wheel_speed(robot: Robot) -> float:
    """Return the required wheel speed with the reserve, rad/s."""
    return SPEED_RESERVE * requested_wheel_speed(robot)


def turn_rate(robot: Robot, mass: float) -> float:
    """Return the turn rate on the spot, rad/s."""
    return turn_rate_on_spot(robot, wheel_speed(robot, mass) * robot.wheel_radius)


def boards(robot: Robot) -> int:
    """Return the number of driver boards for both motors."""
    return math.ceil(DRIVEN_WHEELS / robot.driver.channels)
