"""Sections of a robot file that say what drives: motor, driver, battery, limits, calibration."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from chefbot.robot.quantities import (
    Acceleration,
    Charge,
    Count,
    Current,
    Deviation,
    Distance,
    Duration,
    Factor,
    Length,
    Mass,
    Power,
    RateOffset,
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
from chefbot.robot.section import Part, Size

ROTOR_SHARE = 1.63e-3
"""A rotor's inertia as a share of the whole motor's mass times its diameter squared: 5e-7 kg m^2 for a 37D motor of
Pololu's (estimated); rotors of one build grow with both."""


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

    @property
    def rotor_inertia(self) -> float:
        """Of the rotor seen through the gear, kg m^2."""
        return ROTOR_SHARE * self.mass * self.diameter**2 * self.gear_ratio**2


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
