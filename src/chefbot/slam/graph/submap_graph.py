"""The pose graph of the submaps' frames: where they are, and how well their relative poses are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from chefbot.slam.graph.closures import Closure
from chefbot.slam.graph.edges import Array, Edges, edge
from chefbot.slam.graph.least_squares import factorized, inverse, linearized, squared_distances
from chefbot.slam.graph.pose_graph import optimized
from chefbot.slam.motion_model import compose

_SEQUENCE_FACTOR = 4.0
_SEQUENCE_FLOOR = np.diag([0.03, 0.03, 0.008]) ** 2
"""Factor on and summand to the covariance of a submap in the one before: errors that scan matching does not see."""
_CLOSURE_FLOOR = np.diag([0.02, 0.02, 0.004]) ** 2
"""Summand to the covariance of a closure, m^2 and rad^2."""
KERNEL = 9.0
"""Squared Mahalanobis distance at which the robust kernel halves the influence of a closure."""


class SubmapGraph:
    """Frames of submaps, the edges between consecutive ones, and closures."""

    def __init__(self, origin: Array) -> None:
        self.origins = origin[None].copy()
        self.chain = origin[None].copy()
        """Frames (n, 3) by the sequence alone, without closures."""
        self.covariances = np.zeros((0, 3, 3))
        """Covariances (n - 1, 3, 3) of each frame in the one before, in the axes of that."""
        self._sequence = Edges.empty()
        self._closures = Edges.empty()

    def append(self, relative: Array, covariance: Array) -> None:
        """Append a frame at the pose `relative` (3,) in the last one, with covariance (3, 3)."""
        last = len(self.origins) - 1
        covariance = _SEQUENCE_FACTOR * covariance + _SEQUENCE_FLOOR
        added = edge(last, last + 1, relative, inverse(covariance), np.inf)
        self._sequence = Edges.concatenated([self._sequence, added])
        self.covariances = np.concatenate([self.covariances, covariance[None]])
        self.origins = np.vstack([self.origins, compose(self.origins[-1:], relative)])
        self.chain = np.vstack([self.chain, compose(self.chain[-1:], relative)])

    def close(self, closures: Sequence[Closure]) -> None:
        """Replace all closures by these and optimize."""
        parts = [edge(c.of, c.to, c.measured, closure_information(c), KERNEL) for c in closures]
        self._closures = Edges.concatenated([Edges.empty(), *parts])
        self.origins = optimized(self.origins, self._edges)

    @property
    def _edges(self) -> Edges:
        return Edges.concatenated([self._sequence, self._closures])

    def farthest(self) -> float:
        """Return the distance in m by which a frame may be off at most: what the sequence alone adds up to."""
        deviation = np.sqrt(self.covariances[:, [0, 2], [0, 2]].sum(axis=0))
        lengths = np.hypot(*np.diff(self.chain[:, :2], axis=0).T)
        return float(3.0 * (deviation[0] + deviation[1] * lengths.sum())) if len(lengths) else 0.0

    def closure_distances(self) -> Array:
        """Return the squared Mahalanobis distance (m,) of each closure."""
        return squared_distances(self.origins, self._closures)

    def relative_covariances(self, reference: int, others: Sequence[int]) -> list[Array]:
        """Return the covariances (3, 3) of other frames relative to one, in the map's axes."""
        hessian, _ = linearized(self.origins, self._edges)
        # Held at the reference, the graph's inverse Hessian is the covariance relative to it
        kept = np.r_[0 : 3 * reference, 3 * reference + 3 : 3 * len(self.origins)]
        factor = factorized(hessian[kept][:, kept])
        covariances = []
        for other in others:
            at = 3 * (other if other < reference else other - 1)
            unit = np.zeros((len(kept), 3))
            unit[at : at + 3] = np.eye(3)
            covariances.append(factor.solve(unit)[at : at + 3])
        return covariances


def closure_information(closure: Closure) -> Array:
    """Return the information (3, 3) of a closure with the errors that its surfaces do not show."""
    return softened(closure.information, _CLOSURE_FLOOR)


def softened(information: Array, floor: Array) -> Array:
    """Return the information (3, 3) after a covariance `floor` is added; directions without information stay so."""
    known = inverse(floor)
    return known - known @ np.linalg.solve(known + information, known)
