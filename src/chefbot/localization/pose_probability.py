"""Probability that the estimated pose is right: within POSITION_LIMIT and ANGLE_LIMIT of the true one.

A logistic regression (Bishop: Pattern Recognition and Machine Learning, section 4.3.2) on what the filter knows of
itself. `bench/bench_pose_probability.py` fits its weights on simulated drives and measures the calibration on others.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

POSITION_LIMIT, ANGLE_LIMIT = 0.25, math.radians(10.0)
"""Errors, m and rad, up to which a pose is right."""
MIN_ODDS_SHARE = 0.005
"""Added to both shares of a ratio, so that none is infinite."""
TYPICAL_SPREAD, TYPICAL_SPREAD_YAW = 0.1, 0.05
"""Standard deviations of a localized robot, m and rad, by which spreads are scaled."""
MAX_UPDATES = 100
"""Number of updates from which more say nothing new."""
WEIGHTS = np.array([-6.043, 0.041, 1.619, 6.022, -1.485, -0.647, -5.398, -2.049, -0.087])
"""Weights of `PoseQuality.features`, fitted on 224 drives with even seeds."""


class PoseQuality(NamedTuple):
    """What the filter knows of its estimate.

    weight: share of the weight in the cluster. explained: share of the last scan that the map explains at the pose.
    spread, spread_yaw: standard deviations of the cluster, m and rad. surprise: probability with which the recovery
    estimator would draw a random particle. outperformed: whether an alternative explains the scans better. updates:
    number of scans since the filter was started.
    """

    weight: float
    explained: float
    spread: float
    spread_yaw: float
    surprise: float
    outperformed: bool
    updates: int

    def features(self) -> NDArray[np.float64]:
        """Return the inputs (9,) of the regression, the first one constant."""
        odds = (self.weight + MIN_ODDS_SHARE) / (1.0 - self.weight + MIN_ODDS_SHARE)
        spread = min(max(math.log(max(self.spread, 1e-9) / TYPICAL_SPREAD), -3.0), 5.0)
        yaw = min(max(math.log(max(self.spread_yaw, 1e-9) / TYPICAL_SPREAD_YAW), -3.0), 5.0)
        experience = math.log1p(min(self.updates, MAX_UPDATES))
        alternative = float(self.outperformed)
        scan = self.explained, self.explained**2
        return np.array([1.0, math.log(odds), *scan, spread, yaw, self.surprise, alternative, experience])

    @property
    def probability(self) -> float:
        """Probability 0..1 that the pose is right."""
        return float(1.0 / (1.0 + math.exp(-float(WEIGHTS @ self.features()))))
