"""The belief of the filter after a reading: an immutable value, so that the filter can return to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.motion_model import Array
from chefbot.odometry.readings import ImuReading
from chefbot.odometry.sensor_health import IMU_SOURCES, NEVER_NS, Records, SensorMonitor, Source, new_monitors
from chefbot.odometry.wheel_travel import EncoderState

MEMORY = np.dtype(
    [
        ("gyro_ns", np.int64),  # start of the yaw increment `DELTA_YAW_GYRO`: stamp of the last gyro reading
        ("tilt_ns", np.int64),  # stamp of the last IMU reading whose rates about x and y can be used
        ("tilt_rates", np.float64, 2),  # its rates, rad/s, and their variances
        ("tilt_variances", np.float64, 2),
        ("spikes", np.int64),  # number of the last gyro readings that were left out as possible spikes
        ("spike_angle", np.float64),  # sum of their innovations, rad
        ("mirrored_angle", np.float64),  # slip since gyro and wheels last agreed in sign, rad
        ("speed", np.float64),  # mean speed, m/s, yaw rate, rad/s, and duration, s, of the last interval
        ("turn", np.float64),
        ("dt", np.float64),  # 0 before the first interval
        ("contradicted_ns", np.int64),  # stamp since which wheels and gyro contradict each other
    ]
)
"""Record of what the filter keeps from one interval between wheel readings to the next; a stamp may be `NEVER_NS`."""


class MeanVelocity(NamedTuple):
    """The mean speed (m/s), yaw rate (rad/s) and duration (s) of the last interval between wheel readings."""

    speed: float
    turn: float
    dt: float


class FilterState(NamedTuple):
    """The posterior of the filter, with the readings and sensor monitors it needs for the next update.

    state (n,), covariance (n, n): see `motion_model`. stamp_ns: stamp of the belief, that of a wheel reading
    unless they were lost. pending: readings after it, which are applied at the next one. The arrays must not
    be changed in place.
    """

    state: Array
    covariance: Array
    monitor_records: Records
    """Fault monitors (3,) of `IMU_SOURCES`."""
    memory: Records
    """One record of type `MEMORY`, (1,)."""
    stamp_ns: int | None = None
    wheels_ns: int | None = None
    """Stamp of the last wheel reading, even if it was a duplicate or began a new count."""
    counters: EncoderState = EncoderState()
    pending: tuple[ImuReading, ...] = ()
    dead_encoder_side: int | None = None
    """Wheel whose encoder may be dead: 0 left, 1 right, None for neither."""

    @classmethod
    def initial(cls, body: DriveModel) -> FilterState:
        """Return the initial belief at the origin of odom, without readings."""
        memory = np.zeros(1, MEMORY)
        memory["gyro_ns"] = memory["tilt_ns"] = memory["contradicted_ns"] = NEVER_NS
        return cls(*body.start(), new_monitors(), memory)

    @property
    def monitors(self) -> dict[Source, SensorMonitor]:
        """Fault monitors of all sensors by source."""
        monitors = {Source.WHEELS: SensorMonitor.of_wheels(self.wheels_ns)}
        records = zip(IMU_SOURCES, self.monitor_records, strict=True)
        return monitors | {source: SensorMonitor.of(record) for source, record in records}

    @property
    def interval(self) -> float:
        """Duration of the last interval between wheel readings, s; 0 before the first."""
        return float(self.memory["dt"][0])

    @property
    def velocity(self) -> MeanVelocity | None:
        """Mean velocity over the last interval; None before the first."""
        if not self.interval:
            return None
        return MeanVelocity(float(self.memory["speed"][0]), float(self.memory["turn"][0]), self.interval)

    @property
    def contradicted(self) -> bool:
        """Whether wheels and gyro contradicted each other in the last interval."""
        return int(self.memory["contradicted_ns"][0]) != NEVER_NS

    def with_gyro_since(self, gyro_ns: int) -> FilterState:
        """Return the belief with the yaw increment of the gyro beginning at a stamp; NEVER_NS if it is unknown."""
        memory = self.memory.copy()
        memory["gyro_ns"] = gyro_ns
        return self._replace(memory=memory)

    def without_readings(self) -> FilterState:
        """Return the belief without the readings of the IMU that it keeps for the next interval."""
        memory = self.memory.copy()
        memory["gyro_ns"] = memory["tilt_ns"] = NEVER_NS
        memory["spikes"] = memory["spike_angle"] = memory["mirrored_angle"] = 0
        return self._replace(memory=memory, pending=())
