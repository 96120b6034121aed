"""Pairwise consistency of closures.

Mangelson, Dominic, Eustice, Vasudevan: Pairwise Consistent Measurement Set Maximization for Robust Multi-Robot Map
Merging, ICRA 2018: two closures and the path between them form a cycle, whose error must fit its covariance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.slam.graph.closures import Closure
from chefbot.slam.graph.edges import Array
from chefbot.slam.graph.least_squares import inverse
from chefbot.slam.graph.relative_poses import inverted, relative
from chefbot.slam.graph.submap_graph import SubmapGraph, closure_information
from chefbot.slam.motion_model import compose

MAX_CYCLE = 16.3
"""Largest squared Mahalanobis distance of a true cycle: 99.9 % of them, three degrees of freedom."""
_WEAK_INFORMATION = 1e-3
"""Information of a closure in a direction that no surface faces, 1/m^2."""


class Consistency:
    """The cycles of all closures found so far, along the sequence of submaps."""

    def __init__(self) -> None:
        self._closures: list[Closure] = []
        self._covariances = np.zeros((0, 3, 3))
        self._consistent = np.zeros((0, 0), np.bool_)

    def add(self, closure: Closure, graph: SubmapGraph) -> None:
        """Compare a closure with all earlier ones."""
        n = len(self._closures)
        covariance = inverse(closure_information(closure) + _WEAK_INFORMATION * np.eye(3))
        grown = np.ones((n + 1, n + 1), np.bool_)
        grown[:n, :n] = self._consistent
        if n:
            grown[n, :n] = grown[:n, n] = self._agree(closure, covariance, graph)
        self._closures.append(closure)
        self._covariances = np.concatenate([self._covariances, covariance[None]])
        self._consistent = grown

    def consistent(self) -> list[Closure]:
        """Return a large set of closures that are all consistent with each other, in the order found.

        Greedy: closures are taken by the number of others that they agree with, the earlier first.
        """
        order = np.argsort(-self._consistent.sum(axis=1), kind="stable")
        chosen: list[int] = []
        for k in order.tolist():
            if self._consistent[k, chosen].all():
                chosen.append(k)
        return [self._closures[k] for k in sorted(chosen)]

    def _agree(self, a: Closure, covariance: Array, graph: SubmapGraph) -> NDArray[np.bool_]:
        """Return for each closure b whether the cycle a.of -> a.to -> b.to -> b.of -> a.of closes."""
        n, chain, total = len(self._closures), graph.chain, accumulated(graph)
        b_of, b_to = (np.array(ends) for ends in zip(*((b.of, b.to) for b in self._closures), strict=True))
        a_of, a_to = np.full(n, a.of), np.full(n, a.to)
        # Frames of the cycle in the frame a.of
        at_a_to = np.tile(a.measured, (n, 1))
        at_b_to = compose(at_a_to, relative(chain[a_to], chain[b_to]))
        at_b_of = compose(at_b_to, inverted(np.array([b.measured for b in self._closures])))
        error = compose(at_b_of, relative(chain[b_of], chain[a_of]))
        error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
        # Covariances of all parts, moved to the frame a.of
        cycle = moved(covariance, at_a_to, np.zeros(n)) + moved(self._covariances, at_b_to, at_b_of[:, 2])
        for begin, end, at in ((a_to, b_to, at_a_to), (b_of, a_of, at_b_of)):
            origin = compose(at, inverted(chain[begin]))
            cycle += moved(
                total[np.maximum(begin, end)] - total[np.minimum(begin, end)], origin, origin[:, 2]
            )
        distance = (error * np.linalg.solve(cycle, error[:, :, None])[:, :, 0]).sum(axis=1)
        return np.asarray(distance <= MAX_CYCLE)


def accumulated(graph: SubmapGraph) -> Array:
    """Return the covariances (n, 3, 3) of the sequence's frames about the origin of the map, growing along it."""
    steps = moved(graph.covariances, graph.chain[1:], graph.chain[:-1, 2])
    return np.concatenate([np.zeros((1, 3, 3)), np.cumsum(steps, axis=0)])


def moved(covariances: Array, positions: Array, yaw: Array) -> Array:
    """Return covariances (n, 3, 3) of errors at `positions` (n, 2 or 3), in axes turned by `yaw` (n,), about 0.

    With position and yaw of one frame this is the adjoint of its pose (Barfoot & Furgale, Associating Uncertainty
    With Three-Dimensional Poses for Use in Estimation Problems, IEEE Transactions on Robotics 30 (3), 2014).
    """
    c, s = np.cos(yaw), np.sin(yaw)
    zero, one = np.zeros_like(c), np.ones_like(c)
    move = np.array([[c, -s, positions[:, 1]], [s, c, -positions[:, 0]], [zero, zero, one]]).transpose(
        2, 0, 1
    )
    return np.asarray(move @ covariances @ move.transpose(0, 2, 1), np.float64)
