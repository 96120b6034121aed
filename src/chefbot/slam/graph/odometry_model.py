"""Odometry between scans: prediction and noise, both learned from the scan matches."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.edges import Edges
from chefbot.slam.graph.least_squares import inverse
from chefbot.slam.graph.params import GraphSlamParams
from chefbot.slam.motion_model import OdometryStep
from chefbot.slam.odometry_scale import OdometryScale

Array = NDArray[np.float64]
_KERNEL = 25.0
"""Squared Mahalanobis distance at which the robust kernel halves the influence of a step: wheels slip."""
_MIN_SCALE = 0.05
"""Smallest factor by which the assumed variance is scaled."""


def odometry_edges(motions: Array, covariances: Array) -> Edges:
    """Return the steps of odometry as edges between poses that follow each other.

    motions: (n, 3), m and rad. covariances: (n, 3, 3), in the axes of the pose that a step starts from.
    """
    index = np.arange(len(motions))
    return Edges(index, index + 1, motions, inverse(covariances), np.full(len(index), _KERNEL))


class OdometryModel:
    """Noise of odometry: the assumed one, scaled by the errors that scan matching finds."""

    def __init__(self, params: GraphSlamParams) -> None:
        self._params = params
        self._scale = OdometryScale(_MIN_SCALE)

    def retune(self, params: GraphSlamParams) -> None:
        """Replace the assumed noise; the scale that was learned stays."""
        self._params = params

    def covariance(self, step: OdometryStep) -> Array:
        """Return the covariance (3, 3) of a motion in the frame of the pose that it starts from."""
        return np.diag(step.variance(self._params) * self._scale.factors)

    def observe(self, step: OdometryStep, matched: SE2, certainty: Array) -> None:
        """Learn from a motion that scan matching found: `matched`, as a pose in the frame of the step's start.

        certainty: (3,) share of the result that comes from the scan and not from odometry, 0 to 1.
        """
        variance = step.variance(self._params)
        self._scale.observe(step.motion.array(), matched.array(), variance, certainty)

    @property
    def scale(self) -> tuple[float, float]:
        """Factors on the assumed standard deviations of translation and of heading."""
        along, _, heading = np.sqrt(self._scale.factors).tolist()
        return along, heading


def rotated(covariance: Array, yaw: float) -> Array:
    """Return the covariance (3, 3) of x, y, heading, expressed in a frame that is turned back by `yaw`."""
    c, s = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return rotation @ covariance @ rotation.T
