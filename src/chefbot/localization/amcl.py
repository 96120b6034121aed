"""Adaptive Monte Carlo localization (Thrun, Burgard, Fox: Probabilistic Robotics, chapter 8)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import OdometryError
from chefbot.localization.errors import LocalizationError
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.particle_filter import (
    CONVERGED_EXPLAINED,
    BeamEnds,
    FilterModels,
    ParticleFilter,
)
from chefbot.localization.pose_bins import PoseBins
from chefbot.localization.pose_probability import PoseQuality
from chefbot.localization.recovery import HypothesisTest, RecoveryEstimator
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

GLOBAL_PARTICLE_DENSITY = 1500.0
"""Particles per square metre of free space for global localization: one every 0.15 m and 10 degrees."""
MAX_SCATTER_PARTICLES = 400_000
MAX_COORDINATE = 1e6
"""Limit of plausible odometry coordinates, m."""


class Amcl:
    """Adaptive Monte Carlo localization on an occupancy grid.

    grid: the map. laser: pose of the laser in base_link, projected onto the plane. Pass scans with the
    odometry at their stamp to `update`; read `pose` and `converged`. The filter starts with global
    localization until `set_pose` is called. The same seed and the same calls give bit-identical results.
    """

    def __init__(self, params: AmclParams, grid: Grid, laser: SE2) -> None:
        if params.min_particles > params.max_particles:
            raise LocalizationError("min_particles is above max_particles; lower it")
        self.params = params
        self.laser = laser
        self._rng = np.random.default_rng(params.seed)
        self._set_grid(grid)
        self._recovery = RecoveryEstimator(params.recovery_alpha_slow, params.recovery_alpha_fast)
        self._odom: SE2 | None = None
        self._estimate_odom: SE2 | None = None
        self.initialize_globally()

    def _set_grid(self, grid: Grid) -> None:
        self.field = LikelihoodField.of(grid, self.params)
        self._model = FilterModels(self.params, self.field, PoseBins(grid), self._rng)

    def replace_map(self, grid: Grid) -> None:
        """Continue on another map in the same frame, such as one that was edited, with the present particles."""
        self._set_grid(grid)
        odom = self._estimate_odom  # at which the particles were propagated last
        self._restart(ParticleFilter(self._filter.particles, self._model))
        self._estimate_odom = odom

    def initialize_globally(self) -> None:
        """Start global localization: distribute the particles uniformly over the free space."""
        self._restart(self._global_filter())

    def _global_filter(self) -> ParticleFilter:
        n = int(min(MAX_SCATTER_PARTICLES, self.field.free_area * GLOBAL_PARTICLE_DENSITY))
        return ParticleFilter(
            self.field.sample_free_space(max(self.params.max_particles, n), self._rng), self._model
        )

    def set_pose(self, pose: SE2, std_xy: float = 0.5, std_yaw: float = 0.26) -> None:
        """Start from a pose with the given standard deviations, metres and radians."""
        if not all(map(math.isfinite, (*pose, std_xy, std_yaw))) or min(std_xy, std_yaw) < 0.0:
            raise LocalizationError(
                f"start pose {pose} with spread {std_xy} m, {std_yaw} rad is not a finite pose"
            )
        n = self._size_for(std_xy, std_yaw)
        particles = pose.array() + self._rng.normal(size=(n, 3)) * (std_xy, std_xy, std_yaw)
        particles[:, 2] = np.mod(particles[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        self._restart(ParticleFilter(particles, self._model))

    def _size_for(self, std_xy: float, std_yaw: float) -> int:
        """Return the number of particles for such a prior, within the limits.

        Four times the density of global localization over a box of four standard deviations.
        """
        box = (4.0 * std_xy) ** 2 * min(4.0 * std_yaw, 2.0 * math.pi) / (2.0 * math.pi)
        return int(
            np.clip(box * GLOBAL_PARTICLE_DENSITY * 4.0, self.params.min_particles, self.params.max_particles)
        )

    def _restart(self, particle_filter: ParticleFilter) -> None:
        self._filter = particle_filter
        self._hypothesis_test: HypothesisTest | None = None
        self._recovery.reset()
        self._update_pending = True
        self._estimate_odom = self._odom

    def update(
        self, angles: NDArray[np.floating], ranges: NDArray[np.floating], range_max: float, odom: SE2
    ) -> bool:
        """Process a scan and the odometry at its stamp; return whether the filter was updated.

        angles, ranges: (n,) radians and metres, laser frame; inf, NaN and ranges of at least range_max are no
        returns. The filter is updated when the robot has moved by update_min_d or update_min_a since the last
        update, and at the first scan after `set_pose` or `initialize_globally`. A scan without
        any return only propagates the particles. Raise OdometryError if the odometry is implausible.
        """
        if not all(abs(value) < MAX_COORDINATE for value in odom):
            raise OdometryError(f"odometry {tuple(odom)} is implausible; check the encoders")
        self._odom = odom
        if self._estimate_odom is None:
            self._estimate_odom = odom
        motion = self._estimate_odom.between(odom)
        # Update only after enough motion (update_min_d, update_min_a)
        if not self._update_pending and not self._has_moved(motion):
            return False
        # Prediction with the odometry motion model
        self._propagate(motion)
        self._estimate_odom = odom
        valid_angles, ends = self._beam_ends(angles, ranges, range_max)
        # Measurement update, unless the scan has no returns
        if len(ends) > 0:
            extent = float(np.ptp(angles[np.isfinite(angles)]))
            self._correct(BeamEnds.of(valid_angles, ends, self.params, extent))
            self._update_pending = False
        return True

    def _has_moved(self, motion: SE2) -> bool:
        has_translated = math.hypot(motion.x, motion.y) >= self.params.update_min_d
        return has_translated or abs(motion.yaw) >= self.params.update_min_a

    def _beam_ends(
        self, angles: NDArray[np.floating], ranges: NDArray[np.floating], range_max: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angles (m,) of the beams with a return and their ends (m, 2) in the base frame."""
        with np.errstate(invalid="ignore"):
            valid = np.isfinite(ranges) & (ranges > 0.0) & (ranges < range_max) & np.isfinite(angles)
        a, r = np.asarray(angles, np.float64)[valid], np.asarray(ranges, np.float64)[valid]
        return a, self.laser.apply(np.stack([r * np.cos(a), r * np.sin(a)], axis=1))

    def _propagate(self, motion: SE2) -> None:
        self._filter.propagate(motion)
        if self._hypothesis_test is not None:
            self._hypothesis_test.alternative.propagate(motion)

    def _correct(self, beams: BeamEnds) -> None:
        # Measurement update of the current hypothesis
        self._filter.correct(beams)
        if self._recovery.initialized or self._filter.is_narrow:
            # Augmented MCL: short-term and long-term average of the likelihood
            self._recovery.update(math.exp(self._filter.score))
        alternative_favoured = self._hypothesis_test is not None and self._hypothesis_test.favoured
        # No sign of a localization failure: end the test
        if self._recovery.random_particle_probability == 0.0 and not alternative_favoured:
            self._hypothesis_test = None
            return
        if self._hypothesis_test is None or self._hypothesis_test.rejected:
            # Global localization runs next to the current hypothesis
            self._hypothesis_test = HypothesisTest(self._global_filter())
        self._hypothesis_test.correct(self._filter, beams)
        # Sequential likelihood ratio test: replace the current hypothesis
        if self._hypothesis_test.accepted:
            self._filter, self._hypothesis_test = self._hypothesis_test.alternative, None
            self._recovery.reset()

    @property
    def particles(self) -> NDArray[np.float64]:
        """Particles (n, 3): x, y, yaw in the map frame."""
        return self._filter.particles

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weights (n,) of the particles, summing to one."""
        return self._filter.weights

    @property
    def map_T_odom(self) -> SE2:  # noqa: N802 - the notation of transforms
        """Pose of the odom frame in the map frame: the `map -> odom` transform."""
        if self._estimate_odom is None:
            return self._filter.estimate
        return self._filter.estimate @ self._estimate_odom.inverse()

    @property
    def pose(self) -> SE2:
        """Pose of base_link in the map frame at the last scan: the last estimate propagated with odometry."""
        return self._filter.estimate if self._odom is None else self.map_T_odom @ self._odom

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance (3, 3) of x, y, yaw of the cluster that `pose` is the estimate of."""
        return self._filter.cluster.covariance

    @property
    def quality(self) -> PoseQuality:
        """What the filter knows of its estimate, with the probability that it is right."""
        covariance = self._filter.cluster.covariance
        return PoseQuality(
            self._filter.cluster.weight,
            self._filter.explained,
            self._filter.spread,
            math.sqrt(max(float(covariance[2, 2]), 0.0)),
            self._recovery.random_particle_probability,
            self._outperformed,
            self._filter.updates,
        )

    @property
    def _outperformed(self) -> bool:
        return self._hypothesis_test is not None and self._hypothesis_test.outperforms

    @property
    def converged(self) -> bool:
        """Whether `pose` is reliable: unimodal and narrow, consistent with the scan, and not outperformed.

        One narrow cluster (criteria: particle_filter.CONVERGED_...), the map explains the scan, and no alternative
        hypothesis explains the latest scans clearly better.
        """
        consistent = self._filter.explained >= CONVERGED_EXPLAINED
        return self._filter.is_narrow and consistent and not self._outperformed
