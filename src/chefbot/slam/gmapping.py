"""Grid mapping with a Rao-Blackwellized particle filter.

Grisetti, Stachniss, Burgard: Improved Techniques for Grid Mapping with Rao-Blackwellized Particle Filters,
IEEE Transactions on Robotics 23 (1), 2007. Each particle is a trajectory of the robot with the map that
follows from it. A particle is propagated with noisy odometry and then moved to the nearby pose of highest
posterior given its map and that odometry; its weight is multiplied by the likelihood of the scan there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import OdometryError, ScanError
from chefbot.maths.angles import wrap
from chefbot.maths.grid import Grid
from chefbot.maths.resampling import low_variance
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.relative_poses import relative
from chefbot.slam.map_pyramid import HillClimbParams, MapLevel, OdometryPrior
from chefbot.slam.motion_model import OdometryStep, compose
from chefbot.slam.occupancy_accumulator import OccupancyAccumulator
from chefbot.slam.odometry_scale import OdometryScale
from chefbot.slam.params import GmappingParams
from chefbot.slam.particle_ancestry import ParticleAncestry
from chefbot.slam.resampling import effective_number, normalized
from chefbot.slam.scan_beams import Beams, beams_of, reach

_COARSE_FACTOR = 4.0
"""Ratio of the cell sizes of the coarse level and of the map."""
_OCCUPIED_THRESHOLD = 50
"""Occupancy in percent from which a cell of a prior map counts as a surface."""
_MIN_SPREAD = 0.15
"""Smallest factor on the assumed variance of odometry: closing a loop takes particles that differ."""
_SYSTEMATIC_STEPS = 20.0
"""Number of steps along which the particles cover a systematic error of odometry: a corridor of 10 m."""
_MIN_CERTAINTY = 0.5
"""Share of a motion's variance that the scan must take away for it to measure the error of odometry."""
_MAX_COORDINATE = 1e6
"""Limit of plausible odometry coordinates, m."""
_MAX_JUMP = 100.0
"""Distance between two scans in m that no robot drives: beyond it the odom frame must have been reset."""


class Gmapping:
    """Simultaneous localization and mapping from laser scans and odometry (Grisetti et al. 2007).

    sensor: pose of the laser in the base frame. initial: pose of the robot in the map frame at the first
    scan.
    """

    def __init__(self, params: GmappingParams, sensor: SE2 = IDENTITY, initial: SE2 = IDENTITY) -> None:
        self._params = params
        self._sensor = sensor
        self._random = np.random.default_rng(params.seed)
        self._poses = np.tile(initial.array(), (params.particles, 1))
        self._log_weights = np.zeros(params.particles)
        self._path_log_likelihoods = np.zeros(params.particles)
        self._levels = create_levels(params)
        self._ancestry = ParticleAncestry(params.particles)
        self._common_map = OccupancyAccumulator(params.resolution, params.max_cells)
        self._pending_scans: list[Beams] = []
        self._odom: SE2 | None = None
        self._processed_odom = IDENTITY
        self._odometry_step = OdometryStep()
        self._odometry_scale = OdometryScale(_MIN_SPREAD, _SYSTEMATIC_STEPS)
        self._relocation: OdometryPrior | None = None

    def resume(self, grid: Grid) -> None:
        """Continue an existing map; call it before the first scan, with `initial` as the pose in that map.

        The map does not store where in its cell a beam ended: the centre of an occupied cell stands for it.
        """
        rows, columns = np.nonzero(grid.cells >= _OCCUPIED_THRESHOLD)
        origin = np.array([grid.origin_x, grid.origin_y])
        centres = origin + (np.column_stack([columns, rows]) + 0.5) * grid.resolution
        surfaces = SE2.of(self._poses[0]).inverse().apply(centres).astype(np.float32)
        self._grow_maps(float(np.hypot(surfaces[:, 0], surfaces[:, 1]).max(initial=0.0)))
        for level in self._levels:
            level.add(level.points(surfaces), self._poses[:1])
            level.maps.resample(np.zeros(len(self._poses), np.int64))
        self._common_map.initialize_from(grid)

    def relocate(self, pose: SE2, std_xy: float, std_yaw: float) -> None:
        """Continue the map with another drive, at whose next scan the robot is near `pose` in the map frame.

        std_xy, std_yaw: standard deviations of that pose, m and rad.
        """
        deviation = np.array([std_xy, std_xy, std_yaw])
        self._poses = pose.array() + self._random.normal(size=self._poses.shape) * deviation
        self._relocation = OdometryPrior(self._poses, deviation**2, np.zeros(len(self._poses)))
        self._odom, self._odometry_step = None, OdometryStep()

    def retune(self, params: GmappingParams) -> None:
        """Replace thresholds, ranges and noise from the next scan on; the map's geometry must not change."""
        self._params = params

    def update(
        self, angles: NDArray[np.float32], ranges: NDArray[np.float32], odom: SE2, range_max: float = math.inf
    ) -> bool:
        """Process a scan and return whether it was used: a scan is used after enough motion.

        angles: (n,) rad in the laser frame. ranges: (n,) m. odom: pose of the robot in the odom frame. +inf
        and ranges of at least `range_max` mean no return; NaN, -inf and ranges not above 0 are invalid
        (REP-117).

        Raise ScanError if the arrays differ in length, MapSizeError if the map would become too large, and
        OdometryError if the odometry is implausible or jumps; after a jump the robot keeps its pose in the map
        and the odom frame is taken as reset.
        """
        self._validate_input(angles, ranges, odom)
        if self._odom is not None and (jump := self._odom.distance(odom)) > _MAX_JUMP:
            # The odom frame was reset: keep the motion since the last processed scan
            self._processed_odom = odom @ self._odom.between(self._processed_odom)
            self._odom = odom
            raise OdometryError(
                f"odometry jumped by {jump:.6g} m between two scans: treated as an odometry reset"
            )
        if self._odom is not None:
            self._odometry_step.add(self._odom.between(odom))
        is_first, self._odom = self._odom is None, odom
        if not is_first and not self._odometry_step.is_enough(self._params):
            return False
        # REP-117: a range beyond the maximum is no return
        ranges = np.where(ranges >= range_max, np.float32(np.inf), ranges)
        beams = beams_of(angles, ranges, self._sensor, self._params.max_range, self._params.clear_range)
        self._process(beams, is_first)
        self._processed_odom = odom
        self._odometry_step = OdometryStep()
        return True

    @staticmethod
    def _validate_input(angles: NDArray[np.float32], ranges: NDArray[np.float32], odom: SE2) -> None:
        if not all(abs(v) < _MAX_COORDINATE for v in odom):
            raise OdometryError(f"odometry {tuple(odom)} is implausible: check the encoders and the log")
        if np.shape(angles) != np.shape(ranges) or np.ndim(ranges) != 1:
            raise ScanError(
                f"a scan has {np.shape(angles)} angles and {np.shape(ranges)} ranges: give one for each beam"
            )

    def _process(self, beams: Beams, is_first: bool) -> None:
        # Measurement: beam end points at the resolution of each level
        points = [level.points(beams.surfaces) for level in self._levels]
        # 1. Prediction: sample from the odometry motion model, or about the pose at which another drive begins
        before = self._poses
        prior, self._relocation = self._relocation if is_first else self._predict(), None
        if prior is not None:
            self._grow_maps(reach(beams))
            # 2. Scan matching and importance weighting: w *= p(z | m, x)
            self._match(points, prior)
        if not is_first and len(before) > 1:
            self._learn_odometry_noise(before)
        self._pending_scans.append(beams)
        # 3. Adaptive resampling when the effective number of particles is low
        if self.neff < self._params.resample_threshold * len(self._poses):
            self._resample()
        # 4. Map update: insert the scan into every particle's map
        self._ancestry.append(self._poses)
        self._grow_maps(reach(beams))
        for level, scan_points in zip(self._levels, points, strict=True):
            level.add(scan_points, self._poses)

    def _predict(self) -> OdometryPrior:
        """Propagate the particles with the odometry motion model and its noise."""
        variance = self._odometry_step.variance(self._params)
        # x' ~ p(x' | x, u): Gaussian noise on the odometry motion, one sample per particle. The particles spread as
        # far as this robot's odometry errs; the prior of the matcher stays wide, since wheels slip
        learned = variance * self._odometry_scale.factors
        noise = self._random.normal(size=self._poses.shape) * np.sqrt(learned)
        # The prior's covariance is diagonal in the frame of the old heading
        axes = self._poses[:, 2].copy()
        self._poses = compose(self._poses, self._odometry_step.motion.array() + noise)
        return OdometryPrior(self._poses, variance, axes)

    def _match(self, points: list[NDArray[np.float32]], prior: OdometryPrior) -> None:
        """Move each particle to its maximum a posteriori pose and weight it with the scan's likelihood.

        The noise has moved the centre of each particle's odometry prior. Maximizing the posterior about a
        randomly drawn centre samples from the prior where the scan carries no information, and finds the mode
        of the posterior where the scan is informative; this replaces the sampled proposal distribution of
        section IV of the paper.
        """
        for level, scan_points in zip(self._levels, points, strict=True):
            self._poses, log_likelihoods = level.match(scan_points, self._poses, prior)
        # Weights since the last resampling, likelihoods since the start
        self._log_weights += log_likelihoods
        self._path_log_likelihoods += log_likelihoods

    def _learn_odometry_noise(self, before: NDArray[np.float64]) -> None:
        """Learn from the motions that matching gave the particles, which agree where the scan determines them."""
        variance = self._odometry_step.variance(self._params)
        moved = relative(before, self._poses)
        certainty = 1.0 - moved.var(axis=0) / (variance * self._odometry_scale.factors)
        certainty = np.where(certainty >= _MIN_CERTAINTY, certainty, 0.0)
        motion = self._odometry_step.motion.array()
        self._odometry_scale.observe(motion, moved.mean(axis=0), variance, certainty)

    def _grow_maps(self, max_range: float) -> None:
        for level in self._levels:
            level.grow_to(self._poses, max_range)

    def _resample(self) -> None:
        # Low-variance resampling; maps are shared by reference until they are written to
        weights = normalized(self._log_weights)
        parents = low_variance(weights, len(weights), self._random.random())
        self._poses = self._poses[parents]
        self._path_log_likelihoods = self._path_log_likelihoods[parents]
        self._log_weights = np.zeros(len(parents))
        for level in self._levels:
            level.maps.resample(parents)
        self._ancestry.resample(parents)
        # Scans up to the common ancestor have final poses: insert them once for all particles
        for pose in self._ancestry.collapse_common_ancestors():
            self._common_map.add_scan(self._pending_scans.pop(0), pose)

    @property
    def _best(self) -> int:
        """Index of the particle with the highest likelihood accumulated along its trajectory."""
        return int(np.argmax(self._path_log_likelihoods))

    @property
    def neff(self) -> float:
        """Effective number of particles, 1 to `particles` (Grisetti et al. 2007, equation 20)."""
        return effective_number(normalized(self._log_weights))

    @property
    def map_T_odom(self) -> SE2:  # noqa: N802  REP-105's frames read left to right
        """Pose of the odom frame in the map frame, for the best particle; updated by processed scans only."""
        x, y, yaw = self._poses[self._best]
        return SE2(float(x), float(y), wrap(float(yaw))) @ self._processed_odom.inverse()

    @property
    def pose(self) -> SE2:
        """Pose of the robot in the map frame at the latest odometry, from the best particle."""
        return self.map_T_odom @ (IDENTITY if self._odom is None else self._odom)

    def trajectory(self) -> list[SE2]:
        """Return the poses of the robot in the map frame at all processed scans, for the best particle."""
        return [SE2(x, y, wrap(yaw)) for x, y, yaw in self._ancestry.path(self._best).tolist()]

    def map(self) -> Grid:
        """Return the occupancy grid of the best particle, cropped to the observed area.

        Scans before the common ancestor of all particles are drawn only once; each call draws only the later
        ones.
        """
        # Common part, then the scans since along the best particle's own path
        canvas = self._common_map.copy()
        for beams, pose in zip(self._pending_scans, self._ancestry.branch(self._best), strict=True):
            canvas.add_scan(beams, pose)
        return canvas.grid()


def create_levels(p: GmappingParams) -> list[MapLevel]:
    """Create the map levels, coarse first: coarse cells let matching converge from larger odometry errors."""
    searches = (
        (_COARSE_FACTOR, HillClimbParams(_COARSE_FACTOR * p.resolution, 0.1, 3)),
        (1.0, HillClimbParams(0.5 * p.resolution, 0.0125, p.iterations)),
    )
    return [
        MapLevel(
            p.particles,
            scale * p.resolution,
            scale * p.sigma,
            search,
            p.independent_beams / scale,
            p.max_cells,
        )
        for scale, search in searches
    ]
