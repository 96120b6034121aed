"""The pose graph of the submaps' frames: where they are, and how well their relative poses are known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from chefbot.slam.graph.least_squares import linearized, squared_distances
from chefbot.slam.graph.pose_graph import Edges, optimized

Array = NDArray[np.float64]
_SEQUENCE_FLOOR = np.diag([0.03, 0.03, 0.008]) ** 2
"""Covariance added to a submap's pose in the one before: errors of matching that its covariance does not show."""
_CLOSURE_FLOOR = np.diag([0.02, 0.02, 0.004]) ** 2
_KERNEL = 9.0
"""Squared Mahalanobis distance at which the robust kernel halves a closure's influence."""
MAX_DISTANCE = 16.3
"""Largest squared Mahalanobis distance of an accepted closure: 99.9 % of true ones, three degrees of freedom."""


class SubmapGraph:
    """Frames of submaps, the edges between consecutive ones, and closures."""

    def __init__(self, origin: Array) -> None:
        self.origins = origin[None].copy()
        self._sequence = Edges.empty()
        self._closures = Edges.empty()

    def append(self, relative: Array, covariance: Array) -> None:
        """Append a frame at the pose `relative` (3,) in the last one, with covariance (3, 3)."""
        last = len(self.origins) - 1
        information = np.linalg.inv(4.0 * covariance + _SEQUENCE_FLOOR)
        self._sequence = Edges.concatenated([self._sequence, _edge(last, last + 1, relative, information, np.inf)])
        self.origins = np.vstack([self.origins, composed(self.origins[-1], relative)])

    def close(self, closures: list) -> None:
        """Replace the closures and optimize."""
        parts = [_edge(c.of, c.to, c.measured, softened(c.information, _CLOSURE_FLOOR), _KERNEL) for c in closures]
        self._closures = Edges.concatenated([Edges.empty(), *parts])
        self.origins = optimized(self.origins, self._edges)

    @property
    def _edges(self) -> Edges:
        return Edges.concatenated([self._sequence, self._closures])

    def closure_distances(self) -> Array:
        """Return the squared Mahalanobis distance (m,) of each closure."""
        return squared_distances(self.origins, self._closures)

    def relative_covariances(self, reference: int, others: list[int]) -> list[Array]:
        """Return the covariances (3, 3) of the poses of other frames relative to one, in the reference's axes."""
        hessian, _ = linearized(self.origins, self._edges)
        keep = np.r_[0 : 3 * reference, 3 * reference + 3 : 3 * len(self.origins)]
        factor = splu(hessian[keep][:, keep].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                      options={"SymmetricMode": True})  # fmt: skip
        c, s = np.cos(self.origins[reference, 2]), np.sin(self.origins[reference, 2])
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        covariances = []
        for other in others:
            at = 3 * (other if other < reference else other - 1)
            unit = np.zeros((len(keep), 3))
            unit[at : at + 3] = np.eye(3)
            covariances.append(turn @ factor.solve(unit)[at : at + 3] @ turn.T)
        return covariances


def softened(information: Array, floor: Array) -> Array:
    """Return the information (3, 3) after a covariance `floor` is added; directions without information stay so."""
    inverse = np.linalg.inv(floor)
    return inverse - inverse @ np.linalg.solve(inverse + information, inverse)


def composed(a: Array, b: Array) -> Array:
    """Return the pose (3,) of b, given in the frame of a, in the frame that a is given in."""
    c, s = np.cos(a[2]), np.sin(a[2])
    return np.array([a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]])


def _edge(of: int, to: int, measured: Array, information: Array, kernel: float) -> Edges:
    return Edges(np.array([of]), np.array([to]), measured[None], information[None], np.array([kernel]))
