"""Drivetrain sections of a robot file: motor, motor driver, battery, motion limits and calibration."""

from __future__ import annotations

import math
from typing import Annotated

from msgspec import Meta

from chefbot.robot.quantities import (
    Acceleration,
    AngularAcceleration,
    AngularSpeed,
    CalibrationFactor,
    Charge,
    Count,
    Current,
    Distance,
    Duration,
    Length,
    Mass,
    Power,
    RateOffset,
    RelativeStdDev,
    Share,
    Slope,
    SmallAngle,
    Speed,
    Text,
    Torque,
    Voltage,
)
from chefbot.robot.section import RobotSection, Size

DRIVE_PROTOCOLS = ("roboclaw", "ddsm115")
"""Motor drives with a controller of their own (chefbot.board.drives)."""
ROS_BASE = "ros2"
"""Protocol of a base that takes twists and publishes odometry over ROS 2 (chefbot.devices.ros_base)."""
DRIVER_INPUTS = ("ina_inb_pwm", "dir_pwm", "two_pwm")
"""Inputs of a motor driver: two for the direction and a PWM, one and a PWM, or a PWM for each direction."""
ROTOR_INERTIA_FACTOR = 1.63e-3
"""Rotor inertia as a share of the motor's mass times its diameter squared: 5e-7 kg m^2 for a Pololu 37D motor
(estimated); rotors of one design scale with both."""


class Motor(RobotSection, frozen=True, kw_only=True):
    """A gear motor with encoder whose torque falls linearly from stall torque to no-load speed, both at the
    gearbox output shaft."""

    title: Text
    voltage: Voltage
    no_load_speed: AngularSpeed
    stall_torque: Torque
    no_load_current: Current
    stall_current: Current
    continuous_torque: Torque
    gear_ratio: Annotated[float, Meta(gt=0, le=10_000)]
    encoder_counts: Count
    """Encoder counts per revolution of the motor shaft before the gearbox, all edges of both channels."""
    diameter: Length
    length: Length
    """Length of gearbox, motor and encoder, without the shaft."""
    shaft_offset: Distance
    """Distance of the output shaft below the motor's axis."""
    shaft_diameter: Length
    mass: Mass
    source: Text

    @property
    def ticks_per_turn(self) -> float:
        """Encoder counts per revolution of the wheel."""
        return self.gear_ratio * self.encoder_counts

    @property
    def ticks_per_radian(self) -> float:
        """Encoder counts per radian of the wheel."""
        return self.ticks_per_turn / (2.0 * math.pi)

    @property
    def no_load_tick_rate(self) -> float:
        """Encoder counts per second at no-load speed."""
        return self.no_load_speed * self.ticks_per_radian

    @property
    def speed_torque_gradient(self) -> float:
        """Speed lost per torque along the motor's straight line, rad/s per N m, at any voltage."""
        return self.no_load_speed / self.stall_torque

    @property
    def rotor_inertia(self) -> float:
        """Rotor inertia reflected to the gearbox output shaft, kg m^2."""
        return ROTOR_INERTIA_FACTOR * self.mass * self.diameter**2 * self.gear_ratio**2


class MotorDriver(RobotSection, frozen=True, kw_only=True):
    """A motor driver: the H-bridges between battery and motors."""

    title: Text
    channels: Annotated[int, Meta(ge=1, le=8)]
    voltage_min: Voltage
    voltage_max: Voltage
    continuous_current: Current
    """Continuous current per channel."""
    peak_current: Current
    logic_high_min: Voltage
    inputs: str = DRIVER_INPUTS[0]
    """What the motor board sends it, one of DRIVER_INPUTS."""
    enable: bool = True
    """Whether it has an input that switches it off (EN, STBY, nSLEEP)."""
    enable_diag: bool = False
    """Whether that is EN/DIAG: pulled up on the driver's board, and low while the driver has a fault."""
    obsolete: bool = False
    """Whether its chip is no longer made: no command proposes it."""
    size: Size
    mass: Mass
    source: Text


class Battery(RobotSection, frozen=True, kw_only=True):
    """The battery pack and its limits."""

    title: Text
    chemistry: Text
    voltage: Voltage
    """Nominal voltage."""
    full_voltage: Voltage
    empty_voltage: Voltage
    """Voltage at which the robot must stop."""
    capacity: Charge
    usable: Share
    """Share of the capacity that can be used without damage."""
    continuous_current: Current
    size: Size
    mass: Mass
    source: Text


class PowerRequirements(RobotSection, frozen=True, kw_only=True):
    """Power requirements that the battery has to meet."""

    electronics: Power
    """Power consumption of everything but the motors."""
    run_time: Duration
    """Required run time on one charge."""


class DriveLimits(RobotSection, frozen=True, kw_only=True):
    """Motion limits set by the owner, of which the motors may allow less, and what drives the motors."""

    max_speed: Speed
    max_turn: AngularSpeed
    max_acceleration: Acceleration
    max_turn_acceleration: AngularAcceleration
    max_slope: Slope
    """Steepest ramp that the robot has to climb."""
    max_deceleration: Acceleration | None = None
    """Deceleration of a stop; None for 0.7 of what the tyres grip. Braking that is planned ahead of an obstacle or a
    goal uses a part of max_acceleration."""
    protocol: str = ""
    """Protocol of a drive with its own controller, one of DRIVE_PROTOCOLS or ROS_BASE; without it there is a motor
    board."""
    command_timeout: Annotated[float, Meta(gt=0, le=1, extra={"unit": "s"})] | None = None
    """Time after which a ROS 2 base stops by itself without a command; None: it does not, and is driven slowly."""


class Calibration(RobotSection, frozen=True, kw_only=True):
    """How one built robot differs from its drawing, as measured by `chefbot robot calibrate` and `board test`.

    Drawings, solids and the simulated body keep the drawn dimensions; the kinematics of this robot use these
    factors.
    """

    left_wheel: CalibrationFactor = 1.0
    """Ratio of the left wheel's effective rolling diameter to the drawn one."""
    right_wheel: CalibrationFactor = 1.0
    separation: CalibrationFactor = 1.0
    """Ratio of the effective wheel separation while turning to the drawn one."""
    gyro_scale: CalibrationFactor = 1.0
    """Ratio of the gyro's yaw rate to the true yaw rate."""
    gyro_offset: RateOffset = 0.0
    """Gyro yaw rate of a robot at rest; an initial guess only, as it differs after each power-up."""
    battery: CalibrationFactor = 1.0
    """Ratio of the battery's voltage to the motor board's reading (`chefbot board test`)."""
    lidar_yaw: SmallAngle = 0.0
    """Yaw misalignment of the lidar against its mount, positive to the left."""
    camera_yaw: SmallAngle = 0.0
    wheel_deviation: RelativeStdDev | None = None
    """Standard deviation of both wheel factors; None if never measured."""
    separation_deviation: RelativeStdDev | None = None
    gyro_deviation: RelativeStdDev | None = None

    def yaw_of(self, frame: str) -> float:
        """Return the yaw misalignment of a sensor frame against its mount, rad."""
        return {"laser": self.lidar_yaw, "camera_link": self.camera_yaw}.get(frame, 0.0)
