"""Detection of localization failure and recovery (augmented MCL: Probabilistic Robotics, 8.3.5, table 8.3)."""

from __future__ import annotations

import math

from chefbot.localization.particle_filter import BeamEnds, ParticleFilter

LIKELIHOOD_DROP_FACTOR = 1.25
"""Factor nu by which the fast average must fall below the slow one (Gutmann & Fox 2002).

Some walls fit better than others. Gutmann & Fox: An experimental comparison of localization methods
continued.
"""


class RecoveryEstimator:
    """The short-term and long-term averages of the scans' likelihood, and the probability of recovery.

    The likelihood of a scan is the geometric mean over its beams, relative to a perfect hit, in (0, 1], so
    that it does not depend on the number of beams.
    """

    def __init__(self, slow: float, fast: float) -> None:
        self._alphas = (slow, fast)
        self.reset()

    def reset(self) -> None:
        """Reset the averages; the next scan initializes both."""
        self.slow = self.fast = math.nan

    def update(self, likelihood: float) -> None:
        """Update the averages with the likelihood of a scan at the estimated pose."""
        if not self.initialized:
            self.slow = self.fast = likelihood
        # w_slow += alpha_slow (w_avg - w_slow), likewise w_fast
        self.slow += self._alphas[0] * (likelihood - self.slow)
        self.fast += self._alphas[1] * (likelihood - self.fast)

    @property
    def initialized(self) -> bool:
        """Whether a scan has been processed since the last reset."""
        return not math.isnan(self.slow)

    @property
    def random_particle_probability(self) -> float:
        """Probability of a random particle, 0..1: max(0, 1 - w_fast / w_slow) of table 8.3, with the factor."""
        if not self.initialized or 0.0 in self._alphas:
            return 0.0
        return max(0.0, 1.0 - LIKELIHOOD_DROP_FACTOR * self.fast / self.slow)


MIN_TEST_UPDATES = 20
"""Number of updates over which the alternative must have been unimodal: at one place it can fit by
coincidence, but not along two metres of travel or half a turn.
"""
LOG_ODDS_THRESHOLD = 12.0
"""Log odds against a given pose out of the hundred thousand from which an alternative is selected."""


class HypothesisTest:
    """A sequential test of the current hypothesis against an alternative from global localization.

    The book adds random particles to the same particle set (table 8.3). There a single scan decides, and
    where people occlude half the walls the best of all poses in the map will often fit it better than the
    true one. Here the two particle filters stay separate, and their log likelihood ratio is summed over the
    scans once the alternative is unimodal (sequential probability ratio test, Wald 1945).
    """

    def __init__(self, alternative: ParticleFilter) -> None:
        self.alternative = alternative
        self.log_odds = 0.0
        self._update_count = 0

    def correct(self, current: ParticleFilter, beams: BeamEnds) -> None:
        """Update the alternative with the scan that `current` has already processed, and update the test."""
        self.alternative.correct(beams)
        if self.alternative.is_narrow:
            self._update_count += 1
            # Log likelihood ratio of the scan; correlated beams count once
            self.log_odds += beams.independent * (self.alternative.score - current.score)
        else:
            # Not unimodal yet: the test starts over
            self._update_count, self.log_odds = 0, 0.0

    @property
    def accepted(self) -> bool:
        """Whether the alternative is accepted and should replace the current hypothesis."""
        return self._update_count >= MIN_TEST_UPDATES and self.log_odds > LOG_ODDS_THRESHOLD

    @property
    def favoured(self) -> bool:
        """Whether the scans so far favour the alternative."""
        return self.log_odds > 0.0

    @property
    def outperforms(self) -> bool:
        """Whether it explains them so much better that the current hypothesis is not reliable.

        A small advantage is not enough: among people who stand about the robot some pose always fits a little better,
        and a robot that stops for it gets no scans from elsewhere that would decide.
        """
        return self.log_odds > LOG_ODDS_THRESHOLD / 2.0

    @property
    def rejected(self) -> bool:
        """Whether the alternative has converged to a worse pose, so that another one should be initialized."""
        return self.log_odds < -LOG_ODDS_THRESHOLD
