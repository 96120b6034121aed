"""The scans of the simulated lidar: swept, as a snapshot, or decoded from the bytes of an emulated model."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.lidar.own_body import OwnBody
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.sim.lidar import RotatingLidar, SweptScan
from chefbot.sim.lidar_line import LidarLine
from chefbot.sim.simulation import Simulation

SWEEP, SNAPSHOT = "sweep", "snapshot"


class SimulatedScans:
    """The scans of a robot's lidar; call `advance` `hz` times a second.

    mode: SWEEP, SNAPSHOT, or the driver of an emulated model. The lidar's rate is rounded to a divisor of `hz`.
    """

    def __init__(self, simulation: Simulation, mode: str, now_ns: int, hz: int) -> None:
        lidar = simulation.robot.sensors.lidar
        assert lidar is not None, "the robot has a lidar"
        self._simulation, self._spec, self._before_ns = simulation, lidar, now_ns
        self._parts = max(1, round(hz / lidar.rate))
        self._period, self._ticks = self._parts / hz, 0
        self._rotating = RotatingLidar(simulation, now_ns)
        self._own_body = OwnBody(lidar, simulation.robot.footprint)
        self._sweep = SweptScan(self._rotating, self._parts) if mode == SWEEP else None
        self._line = LidarLine(mode, self._rotating, now_ns) if mode not in (SWEEP, SNAPSHOT) else None

    def advance(self, now_ns: int) -> list[LaserScan]:
        """Return the scans that ended since the last call."""
        before_ns, self._before_ns = self._before_ns, now_ns
        self._rotating.follow(now_ns)
        self._ticks += 1
        if self._line is not None:
            return self._line.advance(now_ns)
        if self._sweep is not None:
            ranges = self._sweep.add(before_ns, now_ns)
            since_first = (1.0 - self._sweep.first_share) * self._period
            increment = -self._period * self._spec.angle_increment / (2.0 * math.pi)
            stamp_ns = now_ns - round(since_first * 1e9)
            return [] if ranges is None else [self._scan(stamp_ns, increment, ranges)]
        if self._ticks % self._parts:
            return []
        return [self._scan(now_ns, 0.0, self._simulation.lidar())]

    def _scan(self, stamp_ns: int, increment: float, ranges: NDArray[np.float32]) -> LaserScan:
        spec = self._spec
        angles = spec.angle_min, spec.angle_max, spec.angle_increment
        times = increment, self._period
        limits = spec.range_min, spec.range_max
        ranges = self._own_body.without(ranges, spec.range_min)
        return LaserScan(Header.of(stamp_ns, "laser"), *angles, *times, *limits, ranges)
