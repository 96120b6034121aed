"""Adaptive Monte Carlo localization (Thrun, Burgard, Fox: Probabilistic Robotics, chapter 8)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.particle_filter import CONVERGED_EXPLAINED, CONVERGED_SPREAD, Beams, Belief, Model
from chefbot.localization.pose_bins import PoseBins
from chefbot.localization.recovery import Contest, Doubt
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

SCATTER_PER_M2 = 1500.0
"""Poses per free square metre when nothing is known: every 0.15 m and 10 degrees there is one."""
MAX_SCATTER = 400_000
FARTHEST = 1e6
"""Metres; odometry beyond is broken."""


class Amcl:
    """Where on the map is the robot. Feed it scans with the odometry of their time; read `pose`, `converged`.

    params: see there. grid: the map. laser: the scanner's frame in base_link, seen from above. Starts
    scattered over the whole map until `set_pose` is called. Same seed and same calls give the same bytes.
    """

    def __init__(self, params: AmclParams, grid: Grid, laser: SE2) -> None:
        if params.min_particles > params.max_particles:
            raise UserError("min_particles is above max_particles; lower it")
        self.params = params
        self.laser = laser
        self.field = LikelihoodField.of(grid, params)
        self._rng = np.random.default_rng(params.seed)
        self._model = Model(params, self.field, PoseBins(grid), self._rng)
        self._doubt = Doubt(params.recovery_alpha_slow, params.recovery_alpha_fast)
        self._odom: SE2 | None = None
        self.scatter()

    def scatter(self) -> None:
        """Forgets everything: poses uniform over the free cells."""
        self._restart(self._scattered())

    def _scattered(self) -> Belief:
        wanted = int(min(MAX_SCATTER, self.field.free_area * SCATTER_PER_M2))
        return Belief(self.field.scatter(max(self.params.max_particles, wanted), self._rng), self._model)

    def set_pose(self, pose: SE2, std_xy: float = 0.5, std_yaw: float = 0.26) -> None:
        """Starts from a pose known to so many metres and radians (standard deviations)."""
        if not all(map(math.isfinite, (*pose, std_xy, std_yaw))) or min(std_xy, std_yaw) < 0.0:
            raise UserError(f"start pose {pose} with spread {std_xy} m, {std_yaw} rad is not a finite pose")
        n = self._size_for(std_xy, std_yaw)
        particles = pose.array() + self._rng.normal(size=(n, 3)) * (std_xy, std_xy, std_yaw)
        particles[:, 2] = np.mod(particles[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        self._restart(Belief(particles, self._model))

    def _size_for(self, std_xy: float, std_yaw: float) -> int:
        """Four times as dense as a scatter, over a box of four standard deviations, within the limits."""
        box = (4.0 * std_xy) ** 2 * min(4.0 * std_yaw, 2.0 * math.pi) / (2.0 * math.pi)
        return int(np.clip(box * SCATTER_PER_M2 * 4.0, self.params.min_particles, self.params.max_particles))

    def _restart(self, belief: Belief) -> None:
        self._belief = belief
        self._contest: Contest | None = None
        self._doubt.reset()
        self._fresh = True
        self._odom_at_estimate = self._odom

    def update(
        self, angles: NDArray[np.floating], ranges: NDArray[np.floating], range_max: float, odom: SE2
    ) -> bool:
        """Takes in a scan and the odometry of its time; True when the filter was updated.

        angles, ranges: (n,) radians and metres, laser frame; inf, NaN and anything beyond range_max is no
        return. The filter updates when the robot has moved by update_min_d or update_min_a since the last
        time, and at once after `set_pose` or `scatter`. A scan without any return moves the particles only.
        UserError if the odometry is absurd.
        """
        if not all(abs(value) < FARTHEST for value in odom):
            raise UserError(f"odometry {tuple(odom)} is not a place; check the encoders")
        self._odom = odom
        if self._odom_at_estimate is None:
            self._odom_at_estimate = odom
        motion = self._odom_at_estimate.between(odom)
        if not self._fresh and not self._moved(motion):
            return False
        self._move(motion)
        self._odom_at_estimate = odom
        kept, ends = self._beam_ends(angles, ranges, range_max)
        if len(ends) > 0:
            self._correct(Beams.of(kept, ends, self.params))
            self._fresh = False
        return True

    def _moved(self, motion: SE2) -> bool:
        far = math.hypot(motion.x, motion.y) >= self.params.update_min_d
        return far or abs(motion.yaw) >= self.params.update_min_a

    def _beam_ends(
        self, angles: NDArray[np.floating], ranges: NDArray[np.floating], range_max: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Angles (m,) of the beams that met something and their ends (m, 2) in the base frame."""
        with np.errstate(invalid="ignore"):
            met = np.isfinite(ranges) & (ranges > 0.0) & (ranges < range_max) & np.isfinite(angles)
        a, r = np.asarray(angles, np.float64)[met], np.asarray(ranges, np.float64)[met]
        return a, self.laser.apply(np.stack([r * np.cos(a), r * np.sin(a)], axis=1))

    def _move(self, motion: SE2) -> None:
        self._belief.move(motion)
        if self._contest is not None:
            self._contest.challenger.move(motion)

    def _correct(self, beams: Beams) -> None:
        self._belief.correct(beams)
        if self._doubt.begun or self._belief.is_narrow:
            self._doubt.see(math.exp(self._belief.score))
        leads = self._contest is not None and self._contest.leads
        if self._doubt.share == 0.0 and not leads:
            self._contest = None
            return
        if self._contest is None or self._contest.lost:
            self._contest = Contest(self._scattered())
        self._contest.correct(self._belief, beams)
        if self._contest.won:
            self._belief, self._contest = self._contest.challenger, None
            self._doubt.reset()

    @property
    def particles(self) -> NDArray[np.float64]:
        """(n, 3) x, y, yaw on the map."""
        return self._belief.particles

    @property
    def weights(self) -> NDArray[np.float64]:
        """(n,), summing to one."""
        return self._belief.weights

    @property
    def map_T_odom(self) -> SE2:  # noqa: N802 - the notation of transforms
        """The odometry's origin on the map; what the `map -> odom` transform carries."""
        if self._odom_at_estimate is None:
            return self._belief.estimate
        return self._belief.estimate @ self._odom_at_estimate.inverse()

    @property
    def pose(self) -> SE2:
        """base_link on the map at the last scan: the estimate of the last update moved on by odometry."""
        return self._belief.estimate if self._odom is None else self.map_T_odom @ self._odom

    @property
    def covariance(self) -> NDArray[np.float64]:
        """(3, 3) of x, y, yaw of the cluster behind `pose`."""
        return self._belief.cluster.covariance

    @property
    def confidence(self) -> float:
        """0..1: weight share of the reported cluster x share of the last scan that the map explains there x
        how far the cluster is from being too wide x how far doubt is from being complete."""
        narrow = min(1.0, CONVERGED_SPREAD / max(self._belief.spread, 1e-9))
        return self._belief.cluster.share * self._belief.explained * narrow * (1.0 - self._doubt.share)

    @property
    def converged(self) -> bool:
        """Whether the robot may trust `pose`: one narrow cluster (see belief.CONVERGED_...), the map
        explains the scan, and no other pose explains the last scans better."""
        challenged = self._contest is not None and self._contest.leads
        explains = self._belief.explained >= CONVERGED_EXPLAINED
        return self._belief.is_narrow and explains and not challenged
