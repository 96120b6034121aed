"""A simulated lidar that rotates while the robot moves: each ray has its own time, and the robot's pose then.

It rotates clockwise as seen from above, as all lidars do that have a driver here; a revolution begins at bearing pi.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.footprint import Footprint
from chefbot.robot.sensors import Lidar
from chefbot.sim.rays import BasePose, RayCaster, lidar_angles, lidar_rays, to_rep117
from chefbot.sim.simulation import Simulation

Floats = NDArray[np.float64]
MAX_STEP = 0.01
"""Distance that the robot drives while all rays have one origin, m, about the noise of a range."""
CARRIED_DISTANCE = 1.0
"""Distance between two poses beyond which the robot was carried from one to the other, m: no ray is between."""
POSES = 4
"""Number of poses that are kept: samples of a packet may be older than the last one."""


class RotatingLidar:
    """The rays of the robot's lidar while it moves. Call `follow` at short intervals, as motion between is even."""

    def __init__(self, simulation: Simulation, now_ns: int) -> None:
        lidar = simulation.robot.sensors.lidar
        assert lidar is not None, "the robot has a lidar"
        self._simulation, self.lidar = simulation, lidar
        self._poses: deque[tuple[int, BasePose]] = deque(maxlen=POSES)
        self.follow(now_ns)

    def follow(self, now_ns: int) -> None:
        """Take the robot's present pose as that at a time, ns."""
        pose = self._simulation.base_pose()
        if self._poses and math.dist(pose[0], self._poses[-1][1][0]) > CARRIED_DISTANCE:
            self._poses.clear()
        self._poses.append((now_ns, pose))

    def measure(self, bearings: Floats, times_ns: NDArray[np.int64]) -> Floats:
        """Return the ranges (n,), m, at bearings (n,), rad, in the sensor frame at times (n,), ns; inf for nothing.

        Solids are where they are now. Ranges of the robot's own body are among them, and the noise.
        """
        return self.measure_along(*self.rays_at(bearings), times_ns)

    @property
    def footprint(self) -> Footprint:
        """The outline of the robot that carries the lidar."""
        return self._simulation.robot.footprint

    @property
    def caster(self) -> RayCaster:
        """Casts the lidar's rays as it is mounted now: another one after `Simulation.remount`."""
        caster = self._simulation.lidar_caster
        assert caster is not None, "the robot has a lidar"
        return caster

    def rays_at(self, bearings: Floats) -> tuple[Floats, Floats]:
        """Return rays at bearings (n,), rad: unit vectors (n, 3) in base_link, and where the robot blocks them."""
        rays = lidar_rays(self.lidar, bearings, self._simulation.as_built)
        return rays, self._own_body(self.caster.own_body, bearings)

    def measure_along(self, rays: Floats, own: Floats, times_ns: NDArray[np.int64]) -> Floats:
        """Return the ranges (n,), as `measure`, of the rays and distances that `rays_at` returned."""
        if not len(rays):
            return np.empty(0)
        caster = self.caster
        (t0, (p0, r0)), (t1, (p1, r1)) = self._interval(int(times_ns[len(times_ns) // 2]))
        part = (times_ns - t0) / max(t1 - t0, 1)
        # rotations a few hundredths of a radian apart: their mean is one but for the square of that
        rotated = rays @ r0.T + part[:, None] * (rays @ (r1 - r0).T)
        rotated /= np.sqrt(np.einsum("ij,ij->i", rotated, rotated))[:, None]
        scene, ranges = self._simulation.ray_scene(), np.empty(len(rays))
        begin, travel = p0 + r0 @ caster.mount_position, (p1 - p0) + (r1 - r0) @ caster.mount_position
        # rays of nearly the same time have one origin
        steps = 1 + int(math.hypot(*travel) * abs(part[-1] - part[0]) / MAX_STEP)
        for step in range(steps):
            chosen = slice(len(rays) * step // steps, len(rays) * (step + 1) // steps)
            origin = begin + part[(chosen.start + chosen.stop) // 2] * travel
            ranges[chosen] = caster.light_along(scene, origin, rotated[chosen])
        ranges = np.minimum(ranges, own)
        if self._simulation.profile != "perfect":
            ranges += self.lidar.noise * self._simulation.noise["lidar"].standard_normal(len(ranges))
        return ranges

    def _own_body(self, by_beam: Floats, bearings: Floats) -> Floats:
        """Return the distances (n,) at which the robot blocks rays, by the nearest beams of the scan."""
        beams = np.rint((bearings - self.lidar.angle_min) / self.lidar.angle_increment).astype(np.int64)
        if self.lidar.full_turn:
            beams %= self.lidar.beams
        inside = (beams >= 0) & (beams < self.lidar.beams)
        own: Floats = np.where(inside, by_beam[beams.clip(0, self.lidar.beams - 1)], np.inf)
        return own

    def _interval(self, time_ns: int) -> tuple[tuple[int, BasePose], tuple[int, BasePose]]:
        """Return the two poses, with their times, between which a time is, or those nearest to it."""
        poses = list(self._poses)
        if len(poses) == 1:
            return poses[0], poses[0]
        after = next((i for i in range(1, len(poses)) if poses[i][0] >= time_ns), len(poses) - 1)
        return poses[after - 1], poses[after]


class SweptScan:
    """Collects the rays of a revolution in a number of equal parts.

    parts: of a revolution, one for each call of `add`.
    """

    def __init__(self, rotating: RotatingLidar, parts: int) -> None:
        self._rotating, self._parts, self._part = rotating, parts, 0
        lidar = rotating.lidar
        self._angles = lidar_angles(lidar)
        # share of the revolution at which each beam is measured: it begins at pi
        self._shares = (math.pi - self._angles) / (2.0 * math.pi)
        self._beams = [self._beams_of(part / parts, (part + 1) / parts) for part in range(parts)]
        self._aim()
        self._ranges = np.full(lidar.beams, np.inf)

    @property
    def first_share(self) -> float:
        """Share of the revolution at which the first beam of the scan is measured; it is the last one."""
        return float(self._shares[0])

    def add(self, before_ns: int, now_ns: int) -> NDArray[np.float32] | None:
        """Measure the next part of a revolution, between two times, ns; return the ranges (beams,) after the last."""
        beams, low = self._beams[self._part], self._part / self._parts
        times = before_ns + (self._shares[beams] - low) * self._parts * (now_ns - before_ns)
        if self._rotating.caster is not self._caster:  # the lidar was mounted otherwise
            self._aim()
        rays, own = self._rays[self._part]
        self._ranges[beams] = self._rotating.measure_along(rays, own, times.astype(np.int64))
        self._part = (self._part + 1) % self._parts
        if self._part:
            return None
        lidar: Lidar = self._rotating.lidar
        return to_rep117(self._ranges, lidar.range_min, lidar.range_max)

    def _aim(self) -> None:
        """Compute the rays of each part as the lidar is mounted now."""
        self._caster = self._rotating.caster
        self._rays = [self._rotating.rays_at(self._angles[beams]) for beams in self._beams]

    def _beams_of(self, low: float, high: float) -> NDArray[np.int64]:
        """Return the beams that are measured between two shares of the revolution, in the order of time."""
        return np.flatnonzero((self._shares > low) & (self._shares <= high + 1e-9))[::-1]
