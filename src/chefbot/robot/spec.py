"""The Robot: a frozen value that one YAML file describes; every number about the robot lives here.

Lengths in metres, masses in kilograms, angles in radians, SI throughout; the file itself may use any unit.
"""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.se2 import SE2

GRAVITY = 9.80665  # m/s^2, standard gravity

Length = Annotated[float, Meta(gt=0, le=10, extra={"unit": "m"})]
Coordinate = Annotated[float, Meta(ge=-10, le=10, extra={"unit": "m"})]
Mass = Annotated[float, Meta(gt=0, le=1000, extra={"unit": "kg"})]
Speed = Annotated[float, Meta(gt=0, le=10, extra={"unit": "m/s"})]
Acceleration = Annotated[float, Meta(gt=0, le=50, extra={"unit": "m/s^2"})]
TurnRate = Annotated[float, Meta(gt=0, le=50, extra={"unit": "rad/s"})]
TurnAcceleration = Annotated[float, Meta(gt=0, le=500, extra={"unit": "rad/s^2"})]
Torque = Annotated[float, Meta(gt=0, le=1000, extra={"unit": "N m"})]
Angle = Annotated[float, Meta(ge=-2 * math.pi, le=2 * math.pi, extra={"unit": "rad"})]
FieldOfView = Annotated[float, Meta(gt=0, le=2 * math.pi, extra={"unit": "rad"})]
Voltage = Annotated[float, Meta(gt=0, le=100, extra={"unit": "V"})]
Charge = Annotated[float, Meta(gt=0, le=1e7, extra={"unit": "C"})]
Power = Annotated[float, Meta(gt=0, le=10_000, extra={"unit": "W"})]
Duration = Annotated[float, Meta(gt=0, le=1e6, extra={"unit": "s"})]
Rate = Annotated[float, Meta(gt=0, le=1000, extra={"unit": "Hz"})]
Count = Annotated[int, Meta(gt=0, le=1_000_000)]
Ratio = Annotated[float, Meta(gt=0, le=10)]


class Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A section of the robot file."""


class Mount(Part, frozen=True, kw_only=True):
    """Where a sensor sits: its frame in base_link (on the floor below the axle's middle; x forward)."""

    x: Coordinate
    y: Coordinate = 0.0
    z: Coordinate
    pitch: Angle = 0.0
    """Positive looks down (REP-103: about +y)."""
    yaw: Angle = 0.0

    @property
    def planar(self) -> SE2:
        """The frame seen from above."""
        return SE2(self.x, self.y, self.yaw)


class Body(Part, frozen=True, kw_only=True):
    """A round robot of stacked plates."""

    mass: Mass
    """Without payload, with battery, motors and wheels."""
    payload: Mass
    radius: Length
    """Of the plates."""
    height: Length
    """Floor to top plate."""
    payload_height: Length
    """What stands on the top plate rises so far above it."""
    clearance: Length
    """Floor to the underside of the base plate."""


class Wheels(Part, frozen=True, kw_only=True):
    """The two driven wheels."""

    diameter: Length
    width: Length
    separation: Length
    """Between the two points that touch the floor."""
    mass: Mass
    friction: Ratio
    """Of the tyre on the floor."""


class Casters(Part, frozen=True, kw_only=True):
    """One caster in front, one behind."""

    radius: Length
    offset: Length
    """Axle's middle to caster, along x."""


class Motor(Part, frozen=True, kw_only=True):
    """Gear motor at the wheel's shaft, linear between no-load speed and stall torque."""

    stall_torque: Torque
    no_load_speed: TurnRate
    ticks_per_turn: Count
    """Encoder ticks for one turn of the wheel, after gear and decoding."""


class Drive(Part, frozen=True, kw_only=True):
    """What the owner allows; the motors may allow less."""

    max_speed: Speed
    max_turn: TurnRate
    max_acceleration: Acceleration
    max_turn_acceleration: TurnAcceleration


class Battery(Part, frozen=True, kw_only=True):
    """The pack and what drains it."""

    voltage: Voltage
    capacity: Charge
    empty_voltage: Voltage
    electronics_power: Power
    """Everything but the motors."""
    run_time: Duration
    """What the owner wants from one charge."""


class Imu(Part, frozen=True, kw_only=True):
    """Gyro and accelerometer."""

    mount: Mount
    rate: Rate
    gyro_noise: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of one reading."""
    gyro_bias: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of the offset that a start leaves."""
    accelerometer_noise: Annotated[float, Meta(ge=0, le=10, extra={"unit": "m/s^2"})]


class Ultrasonic(Part, frozen=True, kw_only=True):
    """A ranger with a cone."""

    mount: Mount
    rate: Rate
    field_of_view: FieldOfView
    range_min: Length
    range_max: Length


class DepthCamera(Part, frozen=True, kw_only=True):
    """A camera that measures distance along its optical axis."""

    mount: Mount
    rate: Rate
    width: Count
    height: Count
    field_of_view: FieldOfView
    """Horizontal."""
    range_min: Length
    range_max: Annotated[float, Meta(gt=0, le=100, extra={"unit": "m"})]
    noise: Annotated[float, Meta(ge=0, le=1)]
    """Standard deviation of depth z is `noise * z^2` metres, as of structured light."""

    @property
    def focal_length_px(self) -> float:
        """Pixels, square ones."""
        return self.width / 2.0 / math.tan(self.field_of_view / 2.0)

    def range_with_noise(self, deviation: float) -> float:
        """Metres up to which the standard deviation of a depth is at most `deviation` metres."""
        wanted = math.sqrt(deviation / self.noise) if self.noise > 0.0 else math.inf
        return min(self.range_max, wanted)


class Lidar(Part, frozen=True, kw_only=True):
    """A scanner that turns in the plane."""

    mount: Mount
    rate: Rate
    beams: Count
    range_min: Length
    range_max: Annotated[float, Meta(gt=0, le=200, extra={"unit": "m"})]
    noise: Annotated[float, Meta(ge=0, le=1, extra={"unit": "m"})]
    """Standard deviation of a range."""


class Sensors(Part, frozen=True, kw_only=True):
    """What is mounted; a robot maps with the lidar where there is one, else with the camera."""

    imu: Imu
    ultrasonic: Ultrasonic | None = None
    depth_camera: DepthCamera | None = None
    lidar: Lidar | None = None


class Robot(Part, frozen=True, kw_only=True):
    """A differential-drive robot."""

    name: Annotated[str, Meta(min_length=1, max_length=64, pattern=r"^[a-z][a-z0-9_]*$")]
    body: Body
    wheels: Wheels
    casters: Casters
    motor: Motor
    drive: Drive
    battery: Battery
    sensors: Sensors

    @property
    def total_mass(self) -> float:
        """With payload, kg."""
        return self.body.mass + self.body.payload

    @property
    def wheel_radius(self) -> float:
        """Metres."""
        return self.wheels.diameter / 2.0

    @property
    def metres_per_tick(self) -> float:
        """Floor that one encoder tick stands for."""
        return math.pi * self.wheels.diameter / self.motor.ticks_per_turn

    @property
    def footprint_radius(self) -> float:
        """Circle about the axle's middle that holds plates and wheels, metres."""
        wheel_corner = math.hypot(self.wheels.separation / 2 + self.wheels.width / 2, self.wheel_radius)
        return max(self.body.radius, wheel_corner)

    @property
    def overall_height(self) -> float:
        """Floor to the top of the payload, metres."""
        return self.body.height + self.body.payload_height

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


ROLLING_RESISTANCE = 0.015
"""Rubber on a hard floor (handbook value)."""
DRIVE_EFFICIENCY = 0.65
"""Wheel and bearing losses behind the gear motor."""
DRIVEN_SHARE_OF_WEIGHT = 0.5
"""The driven wheels carry half, the casters the rest."""
