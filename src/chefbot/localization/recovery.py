"""When to doubt everything: augmented MCL (Probabilistic Robotics, 8.3.5, table 8.3)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

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
        """Of the particles to draw from the whole map, 0..1."""
        if not self.begun or 0.0 in self._decay:
            return 0.0
        return max(0.0, 1.0 - CARELESSNESS * self.fast / self.slow)


def posterior_share(prior: float, theirs: NDArray[np.float64], ours: NDArray[np.float64]) -> float:
    """Bayes' rule for two hypotheses by the mean likelihood of their samples; theirs (m,) and ours (n,) are
    logarithms."""
    top = max(float(theirs.max()), float(ours.max()))
    strange = prior * float(np.mean(np.exp(theirs - top)))
    known = (1.0 - prior) * float(np.mean(np.exp(ours - top)))
    return strange / (strange + known)
