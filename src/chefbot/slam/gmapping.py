"""Grid maps with a Rao-Blackwellized particle filter.

Grisetti, Stachniss, Burgard: Improved Techniques for Grid Mapping with Rao-Blackwellized Particle Filters,
IEEE Transactions on Robotics 23 (1), 2007. Each particle is a path of the robot and the map that follows
from it. A particle is moved by odometry with noise and from there to the pose nearby that suits both its
map and that odometry; its weight is multiplied by how well the scan fits there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.angles import wrap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.map_pyramid import Belief, Climb, Level
from chefbot.slam.motion_model import Step, compose
from chefbot.slam.occupancy_accumulator import Canvas
from chefbot.slam.params import GmappingParams
from chefbot.slam.particle_ancestry import Ancestry
from chefbot.slam.resampling import effective_number, normalized, systematic
from chefbot.slam.scan_beams import Beams, beams_of, reach

_COARSE = 4.0
"""Cells of the map along a cell of the coarse level."""
_OCCUPIED = 50
"""Percent from which a cell of a drawn map holds a surface."""
_FURTHEST = 1e6
"""Metres; odometry beyond is broken."""
_LEAP = 100.0
"""Metres between two scans that no robot drives: the frame of odometry has moved."""


class Gmapping:
    """A map and the robot's place in it, from laser scans and odometry.

    sensor: pose of the laser on the robot. initial: pose of the robot in the map frame at the first scan.
    """

    def __init__(self, params: GmappingParams, sensor: SE2 = IDENTITY, initial: SE2 = IDENTITY) -> None:
        self._params = params
        self._sensor = sensor
        self._random = np.random.default_rng(params.seed)
        self._poses = np.tile(initial.array(), (params.particles, 1))
        self._log_weights = np.zeros(params.particles)
        self._fits = np.zeros(params.particles)
        self._levels = levels_of(params)
        self._ancestry = Ancestry(params.particles)
        self._drawn = Canvas(params.resolution, params.max_cells)
        self._undrawn: list[Beams] = []
        self._odom: SE2 | None = None
        self._processed_odom = IDENTITY
        self._step = Step()

    def resume(self, grid: Grid) -> None:
        """Go on, before the first scan, with a map that was drawn before; the robot stands in it at `initial`.

        Where in its cell a beam ended is not known any more: the middle of an occupied cell stands for it.
        """
        rows, columns = np.nonzero(grid.cells >= _OCCUPIED)
        corner = np.array([grid.origin_x, grid.origin_y])
        middles = corner + (np.column_stack([columns, rows]) + 0.5) * grid.resolution
        seen = SE2.of(self._poses[0]).inverse().apply(middles).astype(np.float32)
        self._cover(float(np.hypot(seen[:, 0], seen[:, 1]).max(initial=0.0)))
        for level in self._levels:
            level.add(level.points(seen), self._poses[:1])
            level.maps.resample(np.zeros(len(self._poses), np.int64))
        self._drawn.begin_with(grid)

    def retune(self, params: GmappingParams) -> None:
        """Other thresholds, ranges and noise from the next scan on; what the maps are made by may not differ."""
        self._params = params

    def update(
        self, angles: NDArray[np.float32], ranges: NDArray[np.float32], odom: SE2, range_max: float = math.inf
    ) -> bool:
        """Take a scan: angles (n,) rad in the laser's frame, ranges (n,) m; odom: robot in the odom frame.

        +inf and ranges of at least `range_max` mean nothing was in reach; NaN, -inf and ranges not above 0
        are no measurement (REP-117). Returns whether the scan was used: one is after enough motion.
        UserError if the odometry is absurd, the arrays differ in length, or the map would grow absurdly; if
        odometry has leapt, too, and the robot is where it was, in a frame of odometry that has moved.
        """
        self._check(angles, ranges, odom)
        if self._odom is not None and (leap := self._odom.distance(odom)) > _LEAP:
            self._processed_odom = odom @ self._odom.between(self._processed_odom)
            self._odom = odom
            raise UserError(
                f"odometry leapt by {leap:.6g} m between two scans: taken for a new start of odometry"
            )
        if self._odom is not None:
            self._step.add(self._odom.between(odom))
        first, self._odom = self._odom is None, odom
        if not first and not self._moved_enough():
            return False
        ranges = np.where(ranges >= range_max, np.float32(np.inf), ranges)
        beams = beams_of(angles, ranges, self._sensor, self._params.max_range, self._params.clear_range)
        self._process(beams, first)
        self._processed_odom = odom
        self._step = Step()
        return True

    @staticmethod
    def _check(angles: NDArray[np.float32], ranges: NDArray[np.float32], odom: SE2) -> None:
        if not all(abs(v) < _FURTHEST for v in odom):
            raise UserError(f"odometry {tuple(odom)} is not a place: check the encoders and the log")
        if np.shape(angles) != np.shape(ranges) or np.ndim(ranges) != 1:
            raise UserError(
                f"a scan has {np.shape(angles)} angles and {np.shape(ranges)} ranges: give one for each beam"
            )

    def _moved_enough(self) -> bool:
        motion = self._step.motion
        return (
            math.hypot(motion.x, motion.y) >= self._params.linear_update
            or abs(motion.yaw) >= self._params.angular_update
        )

    def _process(self, beams: Beams, first: bool) -> None:
        points = [level.points(beams.surfaces) for level in self._levels]
        if not first:
            belief = self._predict()
            self._cover(reach(beams))
            self._match(points, belief)
        self._undrawn.append(beams)
        if self.neff < self._params.resample_threshold * len(self._poses):
            self._resample()
        self._ancestry.append(self._poses)
        self._cover(reach(beams))
        for level, ends in zip(self._levels, points, strict=True):
            level.add(ends, self._poses)

    def _predict(self) -> Belief:
        """Move the particles by odometry with noise."""
        variance = self._step.variance(self._params)
        noise = self._random.normal(size=self._poses.shape) * np.sqrt(variance)
        axes = self._poses[:, 2].copy()
        self._poses = compose(self._poses, self._step.motion.array() + noise)
        return Belief(self._poses, variance, axes)

    def _match(self, points: list[NDArray[np.float32]], belief: Belief) -> None:
        """Move the particles to where scan and odometry suit best, and weigh them by how well the scan fits.

        The noise moved the centre of what odometry says for each particle. Maximizing the posterior about a
        centre drawn at random draws from it where the scan says nothing, and finds its mode where the scan
        says much; so the proposal is that of the paper's section IV without its samples.
        """
        for level, ends in zip(self._levels, points, strict=True):
            self._poses, fits = level.match(ends, self._poses, belief)
        self._log_weights += fits
        self._fits += fits

    def _cover(self, far: float) -> None:
        for level in self._levels:
            level.cover(self._poses, far)

    def _resample(self) -> None:
        parents = systematic(normalized(self._log_weights), self._random.random())
        self._poses = self._poses[parents]
        self._fits = self._fits[parents]
        self._log_weights = np.zeros(len(parents))
        for level in self._levels:
            level.maps.resample(parents)
        self._ancestry.resample(parents)
        for pose in self._ancestry.settle():
            self._drawn.draw(self._undrawn.pop(0), pose)

    @property
    def _best(self) -> int:
        """The particle whose scans fitted best along all its path."""
        return int(np.argmax(self._fits))

    @property
    def neff(self) -> float:
        """How many equally weighted particles would be as good as these, 1 to `particles`."""
        return effective_number(normalized(self._log_weights))

    @property
    def map_T_odom(self) -> SE2:  # noqa: N802  REP-105's frames read left to right
        """The odom frame in the map frame, by the best particle; changes only when a scan is processed."""
        x, y, yaw = self._poses[self._best]
        return SE2(float(x), float(y), wrap(float(yaw))) @ self._processed_odom.inverse()

    @property
    def pose(self) -> SE2:
        """The robot in the map frame at the odometry given last, by the best particle."""
        return self.map_T_odom @ (IDENTITY if self._odom is None else self._odom)

    def trajectory(self) -> list[SE2]:
        """The robot in the map frame at each processed scan, along the best particle's ancestors."""
        return [SE2(x, y, wrap(yaw)) for x, y, yaw in self._ancestry.path(self._best).tolist()]

    def map(self) -> Grid:
        """The map of the best particle, as large as what was seen.

        What all particles share is drawn once; only the scans since are drawn at each call.
        """
        canvas = self._drawn.copy()
        for beams, pose in zip(self._undrawn, self._ancestry.branch(self._best), strict=True):
            canvas.draw(beams, pose)
        return canvas.grid()


def levels_of(p: GmappingParams) -> list[Level]:
    """Coarse cells first: there the matcher finds its way back from where bad odometry put it."""
    climbs = (
        (_COARSE, Climb(_COARSE * p.resolution, 0.1, 3)),
        (1.0, Climb(0.5 * p.resolution, 0.0125, p.iterations)),
    )
    return [
        Level(p.particles, k * p.resolution, k * p.sigma, climb, p.independent_beams / k, p.max_cells)
        for k, climb in climbs
    ]
