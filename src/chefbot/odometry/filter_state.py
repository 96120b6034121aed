"""All that the filter knows after a reading: a value, so that one can go back to it."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.odometry.drive_model import Body
from chefbot.odometry.motion_model import Array
from chefbot.odometry.readings import ImuReading, PoseReading
from chefbot.odometry.sensor_health import Source, Watch
from chefbot.odometry.wheel_travel import Counters


class Pace(NamedTuple):
    """Mean speed (m/s), turn rate (rad/s) and length (s) of the last stretch between readings of the wheels."""

    speed: float
    turn: float
    dt: float


class Belief(NamedTuple):
    """Estimate and memory. `pending` was sensed after the last reading of the wheels, and waits for the next.

    state (n,), covariance (n, n): see `motion`. stamp_ns: of the last reading of the wheels.
    """

    state: Array
    covariance: Array
    watches: dict[Source, Watch]
    """Not to be changed in place."""
    stamp_ns: int | None = None
    counters: Counters = Counters()
    pending: tuple[ImuReading | PoseReading, ...] = ()
    pace: Pace | None = None
    gyro_ns: int | None = None
    """From then on a gyro's reading tells of the turn `SWING`."""
    doubted: tuple[float, ...] = ()
    """Turns, rad, that the last readings told beyond the wheels' and that the next one has to confirm."""
    tilting: ImuReading | None = None
    """The last reading whose rates about x and y can be used."""
    contradicted_ns: int | None = None
    """Since when wheels and gyro contradict each other."""
    silent_side: int | None = None
    """0: the left wheel is silent against all evidence, 1: the right one."""

    @classmethod
    def begin(cls, body: Body) -> Belief:
        """At the origin of odom, nothing heard."""
        return cls(*body.start(), {source: Watch() for source in Source})
