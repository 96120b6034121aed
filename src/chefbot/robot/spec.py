"""The Robot: a frozen value that one YAML file describes; every number about the robot lives here.

Lengths in metres, masses in kilograms, angles in radians, SI throughout; the file itself may use any unit.
"""

from __future__ import annotations

import math

from chefbot.robot import layout
from chefbot.robot.quantities import Name
from chefbot.robot.sections import (
    Battery,
    Body,
    Calibration,
    Casters,
    Drive,
    Driver,
    Equipment,
    Motor,
    MotorClamp,
    Part,
    Places,
    Plates,
    Poles,
    PowerNeeds,
    Sensors,
    Tubes,
    Wheels,
)
from chefbot.robot.shapes import MassProperties
from chefbot.robot.solids import whole_mass

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
    def mass_properties(self) -> MassProperties:
        """Of the solids, without payload, in base_link."""
        return whole_mass(self)

    @property
    def mass(self) -> float:
        """Without payload, kg."""
        return self.mass_properties.mass

    @property
    def total_mass(self) -> float:
        """With payload, kg."""
        return self.mass + self.body.payload

    @property
    def height(self) -> float:
        """Floor to the top plate's upper side, metres."""
        return layout.plate_top(self, self.plates.count)

    @property
    def clearance(self) -> float:
        """Floor to the lowest point of the body, which wheels and casters are not of; metres."""
        return min(layout.plate_undersides(self)[0], layout.motor_bottom(self))

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

    @property
    def overall_height(self) -> float:
        """Floor to the top of the payload, metres."""
        return self.height + self.body.payload_height

    @property
    def max_wheel_speed(self) -> float:
        """Rim speed in m/s that both motors hold while the loaded robot rolls on a hard floor."""
        rolling = ROLLING_RESISTANCE * self.total_mass * GRAVITY * self.wheel_radius / 2.0
        spare = 1.0 - rolling / (DRIVE_EFFICIENCY * self.motor.stall_torque)
        return self.motor.no_load_speed * self.wheel_radius * max(spare, 0.0)

    @property
    def max_speed(self) -> float:
        """Forward speed: what the owner allows, and never more than the motors give, m/s."""
        return min(self.drive.max_speed, self.max_wheel_speed)

    @property
    def max_turn(self) -> float:
        """Turning on the spot, rad/s; never more than the motors give."""
        return min(self.drive.max_turn, 2.0 * self.max_wheel_speed / self.wheels.separation)

    @property
    def max_acceleration(self) -> float:
        """Forward, m/s^2: of owner's wish, grip and motor torque the least."""
        grip = self.wheels.friction * GRAVITY * DRIVEN_SHARE_OF_WEIGHT
        motors = 2.0 * DRIVE_EFFICIENCY * self.motor.stall_torque / (self.wheel_radius * self.total_mass)
        return min(self.drive.max_acceleration, grip, motors)

    @property
    def max_turn_acceleration(self) -> float:
        """On the spot, rad/s^2: the rims accelerate no harder than they may forward."""
        return min(self.drive.max_turn_acceleration, 2.0 * self.max_acceleration / self.wheels.separation)
