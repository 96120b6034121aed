"""When to doubt everything, after augmented MCL (Probabilistic Robotics, 8.3.5, table 8.3), and who is right
then."""

from __future__ import annotations

import math

from chefbot.localization.particle_filter import Beams, Belief

CARELESSNESS = 1.25
"""The fast mean must fall a fifth below the slow one before doubt sets in: one wall fits better than another
(the factor nu of Gutmann & Fox 2002, An experimental comparison of localization methods continued)."""


class Doubt:
    """Two running means of how well scans fit; the share of particles to draw anew when the fast one falls
    off.

    The fit of a scan is the geometric mean of a beam's likelihood relative to a perfect hit, in (0, 1], so
    that it does not depend on the number of beams.
    """

    def __init__(self, slow: float, fast: float) -> None:
        self._decay = (slow, fast)
        self.reset()

    def reset(self) -> None:
        """Forgets; the next scan sets both means."""
        self.slow = self.fast = math.nan

    def see(self, fit: float) -> None:
        """Takes in how one scan fits the reported pose."""
        if not self.begun:
            self.slow = self.fast = fit
        self.slow += self._decay[0] * (fit - self.slow)
        self.fast += self._decay[1] * (fit - self.fast)

    @property
    def begun(self) -> bool:
        """Whether it has seen a scan since the last reset."""
        return not math.isnan(self.slow)

    @property
    def share(self) -> float:
        """How much to doubt, 0..1: the book's probability of a random particle."""
        if not self.begun or 0.0 in self._decay:
            return 0.0
        return max(0.0, 1.0 - CARELESSNESS * self.fast / self.slow)


PROOF = 20
"""Updates over which a challenger must have been one hump: what stands about one spot can fit elsewhere by
chance, but not along two metres of way or half a turn."""
ODDS = 12.0
"""Logarithm of the odds against a given pose out of the hundred thousand that a challenger is chosen from."""


class Contest:
    """A second belief that starts scattered over the map while the first one is in doubt, and must outdo it.

    The book draws random particles into the one population (table 8.3). There a single scan decides, and
    where people hide half the walls the best of all poses of the map will often fit it better than the true
    one. Here the two stay apart, and the logarithm of their likelihoods' ratio is summed over the scans once
    the challenger stands for one pose (the sequential test of Wald 1945).
    """

    def __init__(self, challenger: Belief) -> None:
        self.challenger = challenger
        self.lead = 0.0
        self._scans = 0

    def correct(self, holder: Belief, beams: Beams) -> None:
        """Gives the challenger the scan that the holder has taken in, and compares."""
        self.challenger.correct(beams)
        if self.challenger.is_narrow:
            self._scans += 1
            self.lead += beams.independent * (self.challenger.score - holder.score)
        else:
            self._scans, self.lead = 0, 0.0

    @property
    def won(self) -> bool:
        """Whether the challenger should replace the holder."""
        return self._scans >= PROOF and self.lead > ODDS

    @property
    def leads(self) -> bool:
        """Whether the challenger has explained the scans better so far."""
        return self.lead > 0.0

    @property
    def lost(self) -> bool:
        """Whether the challenger stands for a pose that is worse, so that another should be sought."""
        return self.lead < -ODDS
