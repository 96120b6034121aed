"""The sections of a robot file: frozen values in SI units; the file itself may use any unit."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.se2 import SE2
from chefbot.robot.quantities import (
    Acceleration,
    Angle,
    Charge,
    Coordinate,
    Count,
    Current,
    Deviation,
    Distance,
    Duration,
    Factor,
    FieldOfView,
    Length,
    Mass,
    Name,
    Power,
    Rate,
    RateOffset,
    Ratio,
    Share,
    Slope,
    SmallAngle,
    Speed,
    Text,
    Torque,
    TurnAcceleration,
    TurnRate,
    Voltage,
)


class Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A section of the robot file."""


class Size(Part, frozen=True, kw_only=True):
    """A box's sides along x, y and z."""

    x: Length
    y: Length
    z: Length


class Offset(Part, frozen=True, kw_only=True):
    """From the frame's origin to a box's middle."""

    x: Coordinate = 0.0
    y: Coordinate = 0.0
    z: Coordinate = 0.0


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


class Housing(Part, frozen=True, kw_only=True):
    """The box that a sensor is in, along the axes of the sensor's frame."""

    size: Size
    mass: Mass
    centre: Offset = Offset()


class Place(Part, frozen=True, kw_only=True):
    """Where a box stands: on which plate (1 is the lowest) and its middle seen from above."""

    plate: Annotated[int, Meta(ge=1, le=6)] = 1
    x: Coordinate = 0.0
    y: Coordinate = 0.0


class Equipment(Part, frozen=True, kw_only=True):
    """A computer, a board, a box of cables: something on a plate."""

    name: Name
    place: Place
    size: Size
    mass: Mass


class Places(Part, frozen=True, kw_only=True):
    """Where battery and motor driver stand; what they measure and weigh is theirs."""

    battery: Place
    driver: Place


class Body(Part, frozen=True, kw_only=True):
    """A round robot of stacked plates."""

    payload: Mass
    payload_height: Length
    """What stands on the top plate rises so far above it."""
    mass_budget: Mass
    """The sums before there is a drawing assume so much without payload; the solids tell what it became."""
    radius: Length
    """Of the plates."""
    clearance: Length
    """Wanted below everything but wheels and casters."""


class Notch(Part, frozen=True, kw_only=True):
    """Where a wheel passes the base plate: open to the plate's edge."""

    length: Length
    depth: Length


class Plates(Part, frozen=True, kw_only=True):
    """Discs, one above the other; the lowest has the notches."""

    count: Annotated[int, Meta(ge=1, le=6)]
    thickness: Length
    material: Name
    centre_hole: Length
    """Diameter, for the wiring."""
    screw_hole: Length
    """Diameter of all screw holes."""
    notch: Notch | None = None


class Poles(Part, frozen=True, kw_only=True):
    """Short rods screwed to the plates; they hold the tubes' ends."""

    radius: Length
    height: Length
    reach: Length
    """The four stand at (+-reach, +-reach)."""
    material: Name


class Tubes(Part, frozen=True, kw_only=True):
    """Between two plates, over the poles."""

    length: Length
    bore: Length
    """Diameter inside."""
    wall: Length
    material: Name


class MotorClamp(Part, frozen=True, kw_only=True):
    """An angle below the base plate: the flange is screwed to it, the face holds the motor's front."""

    length: Length
    """Along the axle."""
    width: Length
    thickness: Length
    material: Name


class Wheels(Part, frozen=True, kw_only=True):
    """The two driven wheels."""

    diameter: Length
    width: Length
    separation: Length
    """Between the two points that touch the floor."""
    mass: Mass
    friction: Ratio
    """Of the tyre on the floor."""
    gap: Length
    """Between a wheel and its motor clamp."""


class Casters(Part, frozen=True, kw_only=True):
    """A ball in a cup in front, another behind."""

    radius: Length
    offset: Length
    """Axle's middle to caster, along x."""
    wall: Length
    """Of the cup."""
    material: Name


class Motor(Part, frozen=True, kw_only=True):
    """Gear motor with encoder; linear between no-load speed and stall torque, both at the gear's shaft."""

    title: Text
    voltage: Voltage
    no_load_speed: TurnRate
    stall_torque: Torque
    no_load_current: Current
    stall_current: Current
    continuous_torque: Torque
    gear_ratio: Annotated[float, Meta(gt=0, le=10_000)]
    encoder_counts: Count
    """Per turn of the motor's own shaft, all edges of both channels."""
    diameter: Length
    length: Length
    """Gear, motor and encoder, without the shaft."""
    shaft_offset: Distance
    """The shaft lies so far below the motor's middle."""
    shaft_diameter: Length
    mass: Mass
    source: Text

    @property
    def ticks_per_turn(self) -> float:
        """Encoder counts for one turn of the wheel."""
        return self.gear_ratio * self.encoder_counts


class Driver(Part, frozen=True, kw_only=True):
    """The bridge between battery and motors."""

    title: Text
    channels: Annotated[int, Meta(ge=1, le=8)]
    voltage_min: Voltage
    voltage_max: Voltage
    continuous_current: Current
    """Of one channel."""
    peak_current: Current
    logic_high_min: Voltage
    size: Size
    mass: Mass
    source: Text


class Battery(Part, frozen=True, kw_only=True):
    """The pack."""

    title: Text
    chemistry: Text
    voltage: Voltage
    """Nominal."""
    full_voltage: Voltage
    empty_voltage: Voltage
    """Where the robot must stop."""
    capacity: Charge
    usable: Share
    """Of the capacity, without harm."""
    continuous_current: Current
    size: Size
    mass: Mass
    source: Text


class PowerNeeds(Part, frozen=True, kw_only=True):
    """What the battery is for."""

    electronics: Power
    """Everything but the motors."""
    run_time: Duration
    """What the owner wants from one charge."""


class Drive(Part, frozen=True, kw_only=True):
    """What the owner allows; the motors may allow less."""

    max_speed: Speed
    max_turn: TurnRate
    max_acceleration: Acceleration
    max_turn_acceleration: TurnAcceleration
    max_slope: Slope
    """The steepest ramp on its ways."""


class Imu(Part, frozen=True, kw_only=True):
    """Gyro and accelerometer."""

    mount: Mount
    housing: Housing
    rate: Rate
    gyro_noise: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of one reading."""
    gyro_bias: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of the offset that a start leaves."""
    accelerometer_noise: Annotated[float, Meta(ge=0, le=10, extra={"unit": "m/s^2"})]


class Ultrasonic(Part, frozen=True, kw_only=True):
    """A ranger with a cone."""

    mount: Mount
    housing: Housing
    rate: Rate
    field_of_view: FieldOfView
    range_min: Length
    range_max: Length


class DepthCamera(Part, frozen=True, kw_only=True):
    """A camera that measures distance along its optical axis."""

    mount: Mount
    housing: Housing
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
    housing: Housing
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

    @property
    def by_frame(self) -> dict[str, Imu | Ultrasonic | DepthCamera | Lidar]:
        """What is mounted, by the name of its frame (REP-105 and the drivers' usage)."""
        named = {
            "imu_link": self.imu,
            "ultrasonic_link": self.ultrasonic,
            "camera_link": self.depth_camera,
            "laser": self.lidar,
        }
        return {frame: sensor for frame, sensor in named.items() if sensor is not None}

    @property
    def look_ahead_only(self) -> bool:
        """Whether nothing sees what is beside the robot."""
        return self.lidar is None


class Calibration(Part, frozen=True, kw_only=True):
    """How one built robot differs from its drawing, as `chefbot calibrate` measured it.

    Drawings, solids and the simulated body stay as drawn; what computes the motion of this robot follows these.
    """

    left_wheel: Factor = 1.0
    """The left wheel rolls as if its diameter were so many times the drawn one."""
    right_wheel: Factor = 1.0
    separation: Factor = 1.0
    """The robot turns as if its wheels stood so many times the drawn distance apart."""
    gyro_scale: Factor = 1.0
    """The gyro tells so many times the rate of turn about the vertical."""
    gyro_offset: RateOffset = 0.0
    """What it tells of a robot that stands; a guess to begin with, as every start leaves another one."""
    lidar_yaw: SmallAngle = 0.0
    """The sensor looks so much further to the left than its mount says."""
    camera_yaw: SmallAngle = 0.0
    wheel_deviation: Deviation | None = None
    """Standard deviation of both wheels' factors; None: never measured."""
    separation_deviation: Deviation | None = None
    gyro_deviation: Deviation | None = None

    def yaw_of(self, frame: str) -> float:
        """Of a sensor's frame beyond its mount's, rad."""
        return {"laser": self.lidar_yaw, "camera_link": self.camera_yaw}.get(frame, 0.0)
