"""The belief of the filter after a reading: an immutable value, so that the filter can return to it."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.motion_model import Array
from chefbot.odometry.readings import ImuReading
from chefbot.odometry.sensor_health import SensorMonitor, Source
from chefbot.odometry.wheel_travel import EncoderState


class MeanVelocity(NamedTuple):
    """The mean speed (m/s), yaw rate (rad/s) and duration (s) of the last interval between wheel readings."""

    speed: float
    turn: float
    dt: float


class FilterState(NamedTuple):
    """The posterior of the filter, with the readings and sensor monitors it needs for the next update.

    state (n,), covariance (n, n): see `motion_model`. stamp_ns: stamp of the last wheel reading. pending:
    readings after the last wheel reading, which are applied at the next one.
    """

    state: Array
    covariance: Array
    monitors: dict[Source, SensorMonitor]
    """Fault monitors by source; must not be changed in place."""
    stamp_ns: int | None = None
    counters: EncoderState = EncoderState()
    pending: tuple[ImuReading, ...] = ()
    velocity: MeanVelocity | None = None
    gyro_ns: int | None = None
    """Start of the yaw increment `SWING`: the stamp of the last gyro reading, ns."""
    spike_candidates: tuple[float, ...] = ()
    """Innovations, rad, of the last gyro readings that were left out as possible spikes."""
    tilt_reading: ImuReading | None = None
    """Last IMU reading whose rates about x and y can be used."""
    contradicted_ns: int | None = None
    """Stamp since which wheels and gyro contradict each other, ns."""
    dead_encoder_side: int | None = None
    """Wheel whose encoder may be dead: 0 left, 1 right, None for neither."""

    @classmethod
    def initial(cls, body: DriveModel) -> FilterState:
        """Return the initial belief at the origin of odom, without readings."""
        return cls(*body.start(), {source: SensorMonitor() for source in Source})
