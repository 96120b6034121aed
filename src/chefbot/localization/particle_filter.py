"""A particle filter for the pose: prediction with odometry, update with a scan (table 8.4 of the book)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.localization import clusters, odometry_motion, pose_refinement, resampling, roughening, tempering
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.pose_bins import PoseBins
from chefbot.localization.view_evidence import ViewEvidence
from chefbot.maths.se2 import SE2

MAX_STAGES = 6
GLOBAL_FACTOR = 10
"""Ratio of the maximum number of particles while several places are possible to that of one place: with fewer it
would be chance which of them have a particle near enough to survive the first scans."""
FINE_BEAMS = 180
"""Number of beams for the refinement of the reported pose; more only cost time."""
MIN_UNIMODAL_SHARE = 0.97
MAX_UNIMODAL_SPREAD = 1.0
"""Limits of a unimodal posterior: minimum weight of the cluster, maximum standard deviation in m."""
CONVERGED_SHARE = 0.97
CONVERGED_SPREAD = 0.3
CONVERGED_EXPLAINED = 0.5
"""Criteria of convergence: minimum weight of the cluster, its maximum standard deviation (half a doorway, m),
and the minimum share of the scan that the map explains.
"""


@dataclass(frozen=True, eq=False)
class FilterModels:
    """The models and the random generator that all particle filters of one localization share."""

    params: AmclParams
    field: LikelihoodField
    bins: PoseBins
    rng: np.random.Generator

    @cached_property
    def tolerant_field(self) -> LikelihoodField:
        """The field by which places that are far apart are compared."""
        return self.field.tolerant(self.params)


class BeamEnds(NamedTuple):
    """The ends of a scan's beams in the base frame, metres.

    coarse: (m, 2) for weighting the particles. fine: (k, 2) for refining the estimate. independent: the
    number of independent beams among them. field_of_view: of all beams, rad.
    """

    coarse: NDArray[np.float64]
    fine: NDArray[np.float64]
    independent: float
    field_of_view: float = 2.0 * math.pi

    @staticmethod
    def of(
        angles: NDArray[np.float64],
        ends: NDArray[np.float64],
        params: AmclParams,
        field_of_view: float = 2.0 * math.pi,
    ) -> BeamEnds:
        """Select from angles (n,) and ends (n, 2) of the beams with a return; field_of_view: of all beams, rad."""
        coarse, fine = ends[thin(len(ends), params.max_beams)], ends[thin(len(ends), FINE_BEAMS)]
        independent = tempering.independent_beams(angles, params.beam_independence)
        return BeamEnds(coarse, fine, independent, field_of_view)

    def tempering_exponent(self, beams: int) -> float:
        """Return the tempering exponent that gives `beams` beams the weight of the independent ones."""
        return min(1.0, self.independent / beams)


class ParticleFilter:
    """Particles (n, 3) with weights (n,) that sum to one, their heaviest cluster and the pose estimate.

    explained: share of the last scan that the map explains at `estimate`. score: mean log likelihood of its
    beams there. updates: number of scans.
    """

    def __init__(self, particles: NDArray[np.float64], model: FilterModels) -> None:
        self._model = model
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))
        self.explained, self.updates = 0.0, 0
        self.score = -math.inf
        self._evidence, self._field_of_view = ViewEvidence(), 2.0 * math.pi
        self._update_cluster()

    def _update_cluster(self) -> None:
        self.cluster = clusters.heaviest(self.particles, self.weights, self._model.bins)
        self.estimate = self.cluster.mean

    @property
    def spread(self) -> float:
        """Standard deviation of the cluster along its worst direction, metres."""
        return clusters.position_spread(self.cluster.covariance)

    @property
    def is_narrow(self) -> bool:
        """Whether the posterior is unimodal and narrow enough for one pose."""
        return self.cluster.weight >= CONVERGED_SHARE and self.spread <= CONVERGED_SPREAD

    def propagate(self, motion: SE2) -> None:
        """Propagate the particles with the odometry motion since the last call."""
        odometry_motion.move(self.particles, motion, self._model.params, self._model.rng)
        self._evidence.move(motion, self._field_of_view)
        self._update_cluster()

    def correct(self, beams: BeamEnds) -> None:
        """Update the particles with a scan.

        A likelihood too peaked for the particle set is applied in tempered stages with a roughening after
        each, as in the annealed particle filter (Deutscher & Reid 2005). While the posterior may be
        multimodal each scan gets a single stage and the evidence that is left for its viewpoint, since otherwise
        errors of the map could outweigh the difference between rooms.
        """
        # A multimodal posterior gets one stage and more particles
        unimodal = self.cluster.weight >= MIN_UNIMODAL_SHARE and self.spread <= MAX_UNIMODAL_SPREAD
        # Correlated beams: p(z | x)^(independent / beams)
        whole = remaining_exponent = beams.tempering_exponent(len(beams.coarse))
        if not unimodal:
            remaining_exponent *= self._evidence.left
        p = self._model.params
        limits = p.min_particles, p.max_particles
        if not unimodal:
            limits = p.max_particles, GLOBAL_FACTOR * p.max_particles
        for _ in range(MAX_STAGES if unimodal else 1):
            field = self._model.field if unimodal else self._model.tolerant_field
            used = self._tempering_step(field, beams.coarse, remaining_exponent, limits)
            self._evidence.use(used / whole)
            remaining_exponent -= used
            if remaining_exponent <= 0.0:
                break
        self._field_of_view, self.updates = beams.field_of_view, self.updates + 1
        self._update_cluster()
        self._refine(beams)

    def _tempering_step(
        self,
        field: LikelihoodField,
        points: NDArray[np.float64],
        max_exponent: float,
        limits: tuple[int, int],
    ) -> float:
        """Weight with an exponent of at most `max_exponent`, resample, and return the exponent."""
        m = self._model
        # log p(z | x, m) of every particle
        scores = field.log_likelihoods(self.particles, points)
        # Largest exponent that keeps enough effective particles
        exponent = tempering.exponent_for(scores, self.weights, max_exponent, tempering.EFFECTIVE_SHARE)
        weights = tempering.weights_of(scores, self.weights, exponent)
        # KLD sampling decides on the number of particles
        self.particles = resampling.resample(self.particles, weights, m.bins, m.params, m.rng, *limits)
        self.weights = np.full(len(self.particles), 1.0 / len(self.particles))
        # Copies are spread by a kernel before the next stage (regularized particle filter)
        if exponent < max_exponent:
            distinct_share = min(1.0, 1.0 / float(np.sum(weights**2)) / len(self.particles))
            roughening.roughen(self.particles, distinct_share, m.bins, m.rng)
        return exponent

    def _refine(self, beams: BeamEnds) -> None:
        """Refine the estimate by scan matching, and evaluate the scan's likelihood there."""
        field, sigma = self._model.field, self._model.params.sigma_hit
        # Gauss-Newton with the cluster's Gaussian as prior
        mean, covariance, _ = self.cluster
        exponent = beams.tempering_exponent(len(beams.fine))
        self.estimate = pose_refinement.refine(mean, covariance, beams.fine, field, sigma, exponent)
        self.explained = pose_refinement.explained(self.estimate, beams.fine, field, 2.0 * sigma)
        # Mean log likelihood per beam at the refined pose, for the recovery estimator
        self.score = float(field.log_likelihoods(self.estimate.array()[None, :], beams.fine)[0]) / len(
            beams.fine
        )


def thin(n: int, max_count: int) -> NDArray[np.int64]:
    """Return at most `max_count` of the indices 0..n-1, evenly spaced."""
    if n <= max_count:
        return np.arange(n)
    return np.linspace(0, n - 1, max_count).astype(np.int64)
