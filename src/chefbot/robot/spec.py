"""The Robot: a frozen value described by one YAML file; every number about the robot is stored here once.

Lengths are in metres, masses in kilograms, angles in radians, SI throughout; the file itself may use any
unit.
"""

from __future__ import annotations

import math

from chefbot.maths.footprint import Footprint, disc
from chefbot.robot.board import MotorBoard
from chefbot.robot.chassis import (
    Body,
    Casters,
    Equipment,
    MotorClamp,
    MountingPositions,
    Plates,
    Poles,
    Tubes,
    Wheels,
)
from chefbot.robot.drivetrain import Battery, Calibration, DriveLimits, Motor, MotorDriver, PowerRequirements
from chefbot.robot.plate_shape import RoundPlate
from chefbot.robot.quantities import Name
from chefbot.robot.section import RobotSection
from chefbot.robot.sensors import Sensors

GRAVITY = 9.80665  # m/s^2, standard gravity
ROLLING_RESISTANCE = 0.015
"""Rolling resistance coefficient of rubber on a hard floor (handbook value)."""
DRIVE_EFFICIENCY = 0.65
"""Efficiency of wheel and bearings after the gear motor."""
DRIVEN_WEIGHT_FRACTION = 0.5
"""Share of the weight on the driven wheels; the casters carry the other half."""


class Robot(RobotSection, frozen=True, cache_hash=True, kw_only=True):
    """The complete description of a differential-drive robot."""

    name: Name
    body: Body
    plates: Plates
    poles: Poles
    tubes: Tubes
    motor_clamp: MotorClamp
    wheels: Wheels
    casters: Casters
    motor: Motor
    driver: MotorDriver
    battery: Battery
    power: PowerRequirements
    drive: DriveLimits
    places: MountingPositions
    equipment: tuple[Equipment, ...] = ()
    sensors: Sensors
    board: MotorBoard = MotorBoard()
    calibration: Calibration = Calibration()

    @property
    def wheel_radius(self) -> float:
        """Wheel radius of the drawing, m, without the calibration of either wheel."""
        return self.wheels.diameter / 2.0

    @property
    def left_wheel_radius(self) -> float:
        """Calibrated rolling radius of the left wheel, metres."""
        return self.wheel_radius * self.calibration.left_wheel

    @property
    def right_wheel_radius(self) -> float:
        """Calibrated rolling radius of the right wheel, metres."""
        return self.wheel_radius * self.calibration.right_wheel

    @property
    def effective_wheel_separation(self) -> float:
        """Calibrated (effective) wheel separation while turning, metres."""
        return self.wheels.separation * self.calibration.separation

    @property
    def metres_per_tick(self) -> float:
        """Distance that the wheel rolls per encoder tick, for the drawn diameter, metres."""
        return self.wheel_radius / self.motor.ticks_per_radian

    @property
    def wheel_stall_torque(self) -> float:
        """Stall torque of one motor at its wheel, after the losses of the drive, N m."""
        return DRIVE_EFFICIENCY * self.motor.stall_torque

    @property
    def traction(self) -> float:
        """Maximum push of the driven tyres on a level floor, as a share of the robot's weight."""
        return self.wheels.friction * DRIVEN_WEIGHT_FRACTION

    @property
    def wheel_corner_radius(self) -> float:
        """Distance of the wheels' outer corners from the middle of the axle, seen from above, metres."""
        return math.hypot(self.wheels.outer_face, self.wheel_radius)

    @property
    def footprint(self) -> Footprint:
        """Outline of plates and wheels on the floor: a disc, or a rectangle if the plates are rectangular."""
        plate = self.body.plate
        if isinstance(plate, RoundPlate):
            return disc(max(plate.radius, self.wheel_corner_radius))
        front, back = max(plate.front, self.wheel_radius), max(plate.back, self.wheel_radius)
        side = max(plate.half_width, self.wheels.outer_face)
        corners = ((front, side), (-back, side), (-back, -side), (front, -side))
        return Footprint(min(front, back, side), math.hypot(max(front, back), side), corners)

    @property
    def inscribed_radius(self) -> float:
        """Radius of the largest circle about the middle of the axle inside the footprint, metres."""
        return self.footprint.inscribed_radius

    @property
    def circumscribed_radius(self) -> float:
        """Radius of the smallest circle about the middle of the axle around the footprint, metres."""
        return self.footprint.circumscribed_radius
