"""Adaptive Monte Carlo localization (Thrun, Burgard, Fox: Probabilistic Robotics, chapter 8)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.localization import (
    clusters,
    odometry_motion,
    recovery,
    refinement,
    resampling,
    roughening,
    tempering,
)
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.pose_bins import PoseBins
from chefbot.localization.recovery import Doubt
from chefbot.mapping.grid import Grid
from chefbot.maths.se2 import SE2

SCATTER_PER_M2 = 1500.0
"""Poses per free square metre when nothing is known: every 0.15 m and 10 degrees there is one."""
MAX_SCATTER = 400_000
FINE_BEAMS = 180
"""Beams that refine the reported pose; more add nothing but time."""
STAGES = 6
ONE_HUMP = 1.0
"""Metres: a cluster wider than this may hold several hypotheses."""
CONVERGED_SHARE = 0.8
CONVERGED_SPREAD = 0.3
CONVERGED_EXPLAINED = 0.5
"""The robot knows where it is when one cluster holds most of the weight, it is no wider than a doorway's
half, and it explains at least half of what the scanner sees."""


class Amcl:
    """Where on the map is the robot. Feed it scans with the odometry of their time; read `pose` and
    `confidence`.

    params: see there. grid: the map. laser: the scanner's frame in base_link, seen from above.
    Starts scattered over the whole map until `set_pose` is called. Same seed and same calls give the same
    bytes.
    """

    def __init__(self, params: AmclParams, grid: Grid, laser: SE2) -> None:
        if params.min_particles > params.max_particles:
            raise UserError("min_particles is above max_particles; lower it")
        self.params = params
        self.laser = laser
        self.field = LikelihoodField.of(grid, params)
        self._bins = PoseBins(grid)
        self._rng = np.random.default_rng(params.seed)
        self._doubt = Doubt(params.recovery_alpha_slow, params.recovery_alpha_fast)
        self._odom: SE2 | None = None
        self.scatter()

    def scatter(self) -> None:
        """Forgets everything: poses uniform over the free cells."""
        self._restart(self.field.scatter(self._scatter_size(), self._rng))

    def _scatter_size(self) -> int:
        wanted = int(min(MAX_SCATTER, self.field.free_area * SCATTER_PER_M2))
        return max(self.params.max_particles, wanted)

    def set_pose(self, pose: SE2, std_xy: float = 0.5, std_yaw: float = 0.26) -> None:
        """Starts from a pose known to so many metres and radians (standard deviations)."""
        if not all(map(math.isfinite, (*pose, std_xy, std_yaw))) or min(std_xy, std_yaw) < 0.0:
            raise UserError(f"start pose {pose} with spread {std_xy} m, {std_yaw} rad is not a finite pose")
        n = self._size_for(std_xy, std_yaw)
        particles = pose.array() + self._rng.normal(size=(n, 3)) * (std_xy, std_xy, std_yaw)
        particles[:, 2] = np.mod(particles[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        self._restart(particles)

    def _size_for(self, std_xy: float, std_yaw: float) -> int:
        """As dense as a scatter over the box of two standard deviations, within the limits."""
        box = (4.0 * std_xy) ** 2 * min(4.0 * std_yaw, 2.0 * math.pi) / (2.0 * math.pi)
        return int(np.clip(box * SCATTER_PER_M2 * 4.0, self.params.min_particles, self.params.max_particles))

    def _restart(self, particles: NDArray[np.float64]) -> None:
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))
        self._doubt.reset()
        self._fresh = True
        self._explained = 0.0
        self._cluster = clusters.heaviest(particles, self.weights, self._bins)
        self._estimate = self._cluster.mean
        self._odom_at_estimate = self._odom

    def update(
        self, angles: NDArray[np.floating], ranges: NDArray[np.floating], range_max: float, odom: SE2
    ) -> bool:
        """Takes in a scan and the odometry of its time; True when the filter was updated.

        angles, ranges: (n,) radians and metres, laser frame; inf, NaN and anything beyond range_max is no
        return. The filter updates when the robot has moved by update_min_d or update_min_a since the last
        time, and at once after `set_pose` or `scatter`. A scan without any return moves the particles only.
        """
        self._odom = odom
        if self._odom_at_estimate is None:
            self._odom_at_estimate = odom
        motion = self._odom_at_estimate.between(odom)
        if not self._fresh and not self._moved(motion):
            return False
        odometry_motion.move(self.particles, motion, self.params, self._rng)
        kept, points = self._beam_ends(angles, ranges, range_max)
        if points.shape[0] > 0:
            self._correct(kept, points)
            self._fresh = False
        self._cluster = clusters.heaviest(self.particles, self.weights, self._bins)
        self._estimate = self._cluster.mean
        if points.shape[0] > 0:
            self._refine(kept, points)
        self._odom_at_estimate = odom
        return True

    def _moved(self, motion: SE2) -> bool:
        far = math.hypot(motion.x, motion.y) >= self.params.update_min_d
        return far or abs(motion.yaw) >= self.params.update_min_a

    def _beam_ends(
        self, angles: NDArray[np.floating], ranges: NDArray[np.floating], range_max: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Angles (m,) of the beams that met something and their ends (m, 2) in the base frame."""
        with np.errstate(invalid="ignore"):
            met = np.isfinite(ranges) & (ranges > 0.0) & (ranges < range_max)
        a, r = np.asarray(angles, np.float64)[met], np.asarray(ranges, np.float64)[met]
        return a, self.laser.apply(np.stack([r * np.cos(a), r * np.sin(a)], axis=1))

    def _correct(self, angles: NDArray[np.float64], points: NDArray[np.float64]) -> None:
        """Weighs and resamples; where the last scans gave doubt, together with poses from the whole map.

        A scan too sharp for the population is believed in stages with a roughening after each, as the
        annealed particle filter does (Deutscher & Reid 2005). While there are several hypotheses each scan
        gets one stage only, for then the map's faults could outweigh the difference between rooms.
        """
        few = points[_thin(len(points), self.params.max_beams)]
        left = self._trust(angles, len(few))
        self._admit_strangers(few, left)
        spread = clusters.position_spread(self.covariance)
        one_hump = self._cluster.share >= CONVERGED_SHARE and spread <= ONE_HUMP
        for _ in range(STAGES if one_hump else 1):
            left -= self._believe(few, left)
            if left <= 0.0:
                break

    def _believe(self, points: NDArray[np.float64], limit: float) -> float:
        """One stage: weighs with an exponent up to `limit` and resamples; the exponent."""
        scores = self.field.weigh(self.particles, points)
        exponent = tempering.exponent_for(scores, self.weights, limit, tempering.EFFECTIVE_SHARE)
        weights = tempering.weights_of(scores, self.weights, exponent)
        self.particles = resampling.resample(self.particles, weights, self._bins, self.params, self._rng)
        self.weights = np.full(len(self.particles), 1.0 / len(self.particles))
        if exponent < limit:
            share = min(1.0, 1.0 / float(np.sum(weights**2)) / len(self.particles))
            roughening.roughen(self.particles, share, self._bins, self._rng)
        return exponent

    def _admit_strangers(self, points: NDArray[np.float64], limit: float) -> None:
        """Mixes in poses from the whole map, with doubt's share as their prior (table 8.3: a random pose
        with that probability), in the proportion in which the scan speaks for them and for the present
        particles.

        So many are drawn that some fall near the true pose; the few that fit are kept.
        """
        doubt = self._doubt.share
        if doubt == 0.0:
            return
        strangers = self.field.scatter(self._scatter_size(), self._rng)
        scores = self.field.weigh(strangers, points)
        ours = self.field.weigh(self.particles, points)
        share = recovery.posterior_share(doubt, limit * scores, limit * ours)
        count = round(share / (1.0 - share + 1e-9) * len(self.particles))
        count = min(count, self.params.max_particles)
        if count == 0:
            return
        even = np.full(len(strangers), 1.0 / len(strangers))
        exponent = tempering.exponent_for(scores, even, limit, count / len(strangers))
        weights = tempering.weights_of(scores, even, exponent)
        chosen = strangers[resampling.low_variance(weights, count, self._rng.random())]
        self.weights = np.concatenate([self.weights * (1.0 - share), np.full(count, share / count)])
        self.particles = np.concatenate([self.particles, chosen])

    def _trust(self, angles: NDArray[np.float64], beams: int) -> float:
        """The exponent that makes `beams` beams weigh as much as the independent ones among them."""
        return min(1.0, tempering.independent_beams(angles, self.params.beam_independence) / beams)

    def _refine(self, angles: NDArray[np.float64], points: NDArray[np.float64]) -> None:
        """Sharpens the estimate, and judges how the scan fits there; doubt sees it once there is one hump."""
        few = points[_thin(len(points), FINE_BEAMS)]
        sigma, trust = self.params.sigma_hit, self._trust(angles, len(few))
        mean, covariance, _ = self._cluster
        self._estimate = refinement.refine(mean, covariance, few, self.field, sigma, trust)
        self._explained = refinement.explained(self._estimate, few, self.field, 2.0 * sigma)
        if self._doubt.begun or clusters.position_spread(covariance) <= CONVERGED_SPREAD:
            score = self.field.weigh(self._estimate.array()[None, :], few)[0]
            self._doubt.see(math.exp(score / len(few)))

    @property
    def map_T_odom(self) -> SE2:  # noqa: N802 - the notation of transforms
        """The odometry's origin on the map; what the `map -> odom` transform carries."""
        if self._odom_at_estimate is None:
            return self._estimate
        return self._estimate @ self._odom_at_estimate.inverse()

    @property
    def pose(self) -> SE2:
        """base_link on the map at the last scan: the estimate of the last update moved on by odometry."""
        return self._estimate if self._odom is None else self.map_T_odom @ self._odom

    @property
    def covariance(self) -> NDArray[np.float64]:
        """(3, 3) of x, y, yaw of the cluster behind `pose`."""
        return self._cluster.covariance

    @property
    def confidence(self) -> float:
        """0..1: weight share of the reported cluster x share of the last scan that the map explains there x
        how far the cluster is from being too wide."""
        spread = clusters.position_spread(self.covariance)
        narrow = 1.0 if spread <= CONVERGED_SPREAD else CONVERGED_SPREAD / spread
        return self._cluster.share * self._explained * narrow

    @property
    def converged(self) -> bool:
        """Whether the robot may trust `pose`; see the CONVERGED_ constants."""
        return (
            self._cluster.share >= CONVERGED_SHARE
            and clusters.position_spread(self.covariance) <= CONVERGED_SPREAD
            and self._explained >= CONVERGED_EXPLAINED
        )


def _thin(n: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the indices 0..n-1, evenly spaced."""
    if n <= most:
        return np.arange(n)
    return np.linspace(0, n - 1, most).astype(np.int64)
