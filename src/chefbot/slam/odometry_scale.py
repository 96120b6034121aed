"""How good the robot's odometry is: the assumed noise of odometry, scaled by the errors that scan matching finds."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap

Floats = NDArray[np.float64]

_PRIOR_STEPS, _MEMORY = 10.0, 200.0
"""Number of steps that the assumed noise counts as, and that the estimate remembers."""
_MAX_SCALE = 4.0
"""Largest factor by which the assumed variance is scaled."""
_OUTLIER = 9.0
"""Largest share of one step in the estimate, in units of the variance: wheels slip."""


class OdometryScale:
    """Factors on the assumed variances of odometry: one for translation, one for heading.

    Only directions that a scan determines better than odometry count.

    minimum: lower limit of the factors. systematic_steps: number of steps without any correction, as along a
    corridor, over which the factors are to cover a systematic error too. Random errors of n steps add up to sqrt(n)
    times that of one, a systematic one to n times.
    """

    def __init__(self, minimum: float, systematic_steps: float = 0.0) -> None:
        self._minimum, self._systematic_steps = minimum, systematic_steps
        self._square, self._mean = np.ones(3), np.zeros(3)
        self._steps = _PRIOR_STEPS

    def observe(self, motion: Floats, matched: Floats, variance: Floats, certainty: Floats) -> None:
        """Learn from a motion that scan matching corrected.

        motion, matched: (3,) m and rad, in the frame of the pose that the motion starts from. variance: (3,) assumed.
        certainty: (3,) share of the result that comes from the scan and not from odometry, 0 to 1.
        """
        error = motion - matched
        error[2] = wrap(error[2])
        ratio = np.minimum(error**2 / variance, _OUTLIER * self._square)
        # Errors with their signs: along x, those of driving back are turned round
        signed = np.copysign(np.sqrt(ratio), error) * [math.copysign(1.0, motion[0]), 1.0, 1.0]
        # Translation errors along and across share one factor
        ratio[:2] = (certainty[:2] @ ratio[:2]) / max(float(certainty[:2].sum()), 1e-9)
        self._steps = min(self._steps + 1.0, _MEMORY)
        weight = np.array([certainty[:2].mean(), certainty[:2].mean(), certainty[2]]) / self._steps
        self._square = np.clip((1.0 - weight) * self._square + weight * ratio, self._minimum, _MAX_SCALE)
        self._mean += certainty / self._steps * (signed - self._mean)

    @property
    def factors(self) -> Floats:
        """Factors (3,) on the variances of x, y and heading."""
        # The mean of random errors is not zero either: its variance is theirs by the number of steps
        systematic = np.maximum(self._mean**2 - self._square / self._steps, 0.0)
        systematic[:2] = systematic[:2].max()
        return np.minimum(self._square + self._systematic_steps * systematic, _MAX_SCALE)
