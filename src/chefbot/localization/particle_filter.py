"""A belief about the pose as particles, and what one scan does to it: the core of table 8.4 of the book."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.localization import clusters, odometry_motion, pose_refinement, resampling, roughening, tempering
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.pose_bins import PoseBins
from chefbot.maths.se2 import SE2

STAGES = 6
FINE_BEAMS = 180
"""Beams that refine the reported pose; more add nothing but time."""
DOMINANT = 0.8
ONE_HUMP = 1.0
"""A cluster of less weight or wider than so many metres means that there may be several hypotheses."""
CONVERGED_SHARE = 0.9
CONVERGED_SPREAD = 0.3
CONVERGED_EXPLAINED = 0.5
"""A belief knows a pose when one cluster holds most of the weight, it is no wider than a doorway's half, and
it explains at least half of what the scanner sees."""


@dataclass(frozen=True, eq=False)
class Model:
    """What all beliefs of one filter share."""

    params: AmclParams
    field: LikelihoodField
    bins: PoseBins
    rng: np.random.Generator


class Beams(NamedTuple):
    """The ends of a scan's beams in the base frame, metres: those that weigh (m, 2), those that refine (k,
    2), and how many of them count as independent."""

    coarse: NDArray[np.float64]
    fine: NDArray[np.float64]
    independent: float

    @staticmethod
    def of(angles: NDArray[np.float64], ends: NDArray[np.float64], params: AmclParams) -> Beams:
        """Of the angles (n,) and ends (n, 2) of the beams that met something."""
        coarse, fine = ends[thin(len(ends), params.max_beams)], ends[thin(len(ends), FINE_BEAMS)]
        independent = tempering.independent_beams(angles, params.beam_independence)
        return Beams(coarse, fine, independent)

    def trust(self, beams: int) -> float:
        """The exponent that makes `beams` beams weigh as much as the independent ones among them."""
        return min(1.0, self.independent / beams)


class Belief:
    """Particles (n, 3) with weights (n,) that sum to one, their heaviest cluster, and the pose it stands for.

    explained: share of the last scan that the map explains at `estimate`. score: mean log-likelihood of its
    beams.
    """

    def __init__(self, particles: NDArray[np.float64], model: Model) -> None:
        self._model = model
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))
        self.explained = 0.0
        self.score = -math.inf
        self._gather()

    def _gather(self) -> None:
        self.cluster = clusters.heaviest(self.particles, self.weights, self._model.bins)
        self.estimate = self.cluster.mean

    @property
    def spread(self) -> float:
        """Of the cluster along its worst direction, metres."""
        return clusters.position_spread(self.cluster.covariance)

    @property
    def is_narrow(self) -> bool:
        """Whether it is one hump that stands for one pose."""
        return self.cluster.share >= CONVERGED_SHARE and self.spread <= CONVERGED_SPREAD

    def move(self, motion: SE2) -> None:
        """Moves by odometry's motion since the last time."""
        odometry_motion.move(self.particles, motion, self._model.params, self._model.rng)
        self._gather()

    def correct(self, beams: Beams) -> None:
        """Takes in a scan.

        A scan too sharp for the population is believed in stages with a roughening after each, as the
        annealed particle filter does (Deutscher & Reid 2005). While there may be several hypotheses each
        scan gets one stage only, for then the map's faults could outweigh the difference between rooms.
        """
        one_hump = self.cluster.share >= DOMINANT and self.spread <= ONE_HUMP
        left = beams.trust(len(beams.coarse))
        p = self._model.params
        least = p.min_particles if one_hump else max(p.min_particles, p.max_particles // 4)
        for _ in range(STAGES if one_hump else 1):
            left -= self._believe(beams.coarse, left, least)
            if left <= 0.0:
                break
        self._gather()
        self._refine(beams)

    def _believe(self, points: NDArray[np.float64], limit: float, least: int) -> float:
        """One stage: weighs with an exponent up to `limit` and resamples; the exponent."""
        m = self._model
        scores = m.field.weigh(self.particles, points)
        exponent = tempering.exponent_for(scores, self.weights, limit, tempering.EFFECTIVE_SHARE)
        weights = tempering.weights_of(scores, self.weights, exponent)
        self.particles = resampling.resample(self.particles, weights, m.bins, m.params, m.rng, least)
        self.weights = np.full(len(self.particles), 1.0 / len(self.particles))
        if exponent < limit:
            share = min(1.0, 1.0 / float(np.sum(weights**2)) / len(self.particles))
            roughening.roughen(self.particles, share, m.bins, m.rng)
        return exponent

    def _refine(self, beams: Beams) -> None:
        """Sharpens the estimate, and judges how the scan fits there."""
        field, sigma = self._model.field, self._model.params.sigma_hit
        mean, covariance, _ = self.cluster
        trust = beams.trust(len(beams.fine))
        self.estimate = pose_refinement.refine(mean, covariance, beams.fine, field, sigma, trust)
        self.explained = pose_refinement.explained(self.estimate, beams.fine, field, 2.0 * sigma)
        self.score = float(field.weigh(self.estimate.array()[None, :], beams.fine)[0]) / len(beams.fine)


def thin(n: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the indices 0..n-1, evenly spaced."""
    if n <= most:
        return np.arange(n)
    return np.linspace(0, n - 1, most).astype(np.int64)
