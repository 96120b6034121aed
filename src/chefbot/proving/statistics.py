"""Statistics of runs: shares with Wilson intervals, and paired differences by bootstrap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

CONFIDENCE = 0.95
Z = 1.959963984540054
"""Quantile of the standard normal distribution for a two-sided interval of CONFIDENCE."""
RESAMPLES = 10_000
MIN_PAIRS = 5
"""Pairs below which no difference counts as significant."""


class Share(NamedTuple):
    """A share of successes with its interval."""

    successes: int
    total: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The share itself, NaN of none."""
        return self.successes / self.total if self.total else math.nan


def wilson(successes: int, total: int) -> Share:
    """Return a share with its 95 % score interval (Wilson 1927, eq. 4); from 0 to 1 without any run."""
    if total == 0:
        return Share(0, 0, 0.0, 1.0)
    p, z2 = successes / total, Z * Z
    centre = (p + z2 / (2 * total)) / (1 + z2 / total)
    half = Z / (1 + z2 / total) * math.sqrt(p * (1 - p) / total + z2 / (4 * total * total))
    low, high = max(0.0, centre - half), min(1.0, centre + half)
    return Share(successes, total, min(low, p), max(high, p))  # of none or all, rounding leaves out the share


class Difference(NamedTuple):
    """Mean of paired differences with its interval."""

    mean: float
    low: float
    high: float
    pairs: int

    @property
    def is_significant(self) -> bool:
        """Whether the interval excludes zero; of fewer than MIN_PAIRS pairs nothing is."""
        return self.pairs >= MIN_PAIRS and (self.low > 0.0 or self.high < 0.0)


def paired_difference(old: Sequence[float], new: Sequence[float], seed: int = 0) -> Difference:
    """Return the mean of new - old with a 95 % percentile bootstrap interval over the pairs (Efron 1979)."""
    differences: NDArray[np.float64] = np.asarray(new, float) - np.asarray(old, float)
    n = len(differences)
    if n == 0:
        return Difference(math.nan, math.nan, math.nan, 0)
    rng = np.random.default_rng(seed)
    means = differences[rng.integers(n, size=(RESAMPLES, n))].mean(axis=1)
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]).tolist()
    return Difference(float(differences.mean()), low, high, n)
