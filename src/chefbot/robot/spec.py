"""The Robot: a frozen value that one YAML file describes; every number about the robot lives here.

Lengths in metres, masses in kilograms, angles in radians, SI throughout; the file itself may use any unit.
"""

from __future__ import annotations

import math

from chefbot.robot.chassis import Body, Casters, Equipment, MotorClamp, Places, Plates, Poles, Tubes, Wheels
from chefbot.robot.drivetrain import Battery, Calibration, Drive, Driver, Motor, PowerNeeds
from chefbot.robot.quantities import Name
from chefbot.robot.section import Part
from chefbot.robot.sensors import Sensors

GRAVITY = 9.80665  # m/s^2, standard gravity
ROLLING_RESISTANCE = 0.015
"""Rubber on a hard floor (handbook value)."""
DRIVE_EFFICIENCY = 0.65
"""Wheel and bearing losses behind the gear motor."""
DRIVEN_SHARE_OF_WEIGHT = 0.5
"""The driven wheels carry half, the casters the rest."""


class Robot(Part, frozen=True, kw_only=True):
    """A differential-drive robot."""

    name: Name
    body: Body
    plates: Plates
    poles: Poles
    tubes: Tubes
    motor_clamp: MotorClamp
    wheels: Wheels
    casters: Casters
    motor: Motor
    driver: Driver
    battery: Battery
    power: PowerNeeds
    drive: Drive
    places: Places
    equipment: tuple[Equipment, ...] = ()
    sensors: Sensors
    calibration: Calibration = Calibration()

    @property
    def wheel_radius(self) -> float:
        """Metres."""
        return self.wheels.diameter / 2.0

    @property
    def left_radius(self) -> float:
        """Metres that the built robot's left wheel rolls on."""
        return self.wheel_radius * self.calibration.left_wheel

    @property
    def right_radius(self) -> float:
        """Metres that its right wheel rolls on."""
        return self.wheel_radius * self.calibration.right_wheel

    @property
    def turning_separation(self) -> float:
        """Metres between the wheels by which the built robot turns."""
        return self.wheels.separation * self.calibration.separation

    @property
    def metres_per_tick(self) -> float:
        """Floor that one encoder tick stands for, by the drawing."""
        return math.pi * self.wheels.diameter / self.motor.ticks_per_turn

    @property
    def footprint_radius(self) -> float:
        """Circle about the axle's middle that holds plates and wheels, metres."""
        wheel_corner = math.hypot(self.wheels.separation / 2 + self.wheels.width / 2, self.wheel_radius)
        return max(self.body.radius, wheel_corner)
