"""Pairwise consistency of closures.

Mangelson, Dominic, Eustice, Vasudevan: Pairwise Consistent Measurement Set Maximization for Robust Multi-Robot Map
Merging, ICRA 2018: two closures and the path between them form a cycle, whose error must fit its covariance.
"""

from __future__ import annotations

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.closures import Closure
from chefbot.slam.graph.least_squares import inverse
from chefbot.slam.graph.pose_graph import Array
from chefbot.slam.graph.submap_graph import SubmapGraph, closure_information

MAX_CYCLE = 16.3
"""Largest squared Mahalanobis distance of a true cycle: 99.9 % of them, three degrees of freedom."""
_WEAK = 1e-3
"""Information of a closure in a direction that no surface faces, 1/m^2."""


class Consistency:
    """The cycles of all closures found so far, along the sequence of submaps."""

    def __init__(self) -> None:
        self._closures: list[Closure] = []
        self._consistent = np.zeros((0, 0), np.bool_)

    def add(self, closure: Closure, graph: SubmapGraph) -> None:
        """Compare a closure with all earlier ones."""
        total = accumulated(graph)
        row = np.array([_agree(closure, other, graph.chain, total) for other in self._closures], np.bool_)
        n = len(row)
        grown = np.ones((n + 1, n + 1), np.bool_)
        grown[:n, :n] = self._consistent
        grown[n, :n] = grown[:n, n] = row
        self._closures.append(closure)
        self._consistent = grown

    def consistent(self) -> list[Closure]:
        """Return a large set of closures that are all consistent with each other, in the order found.

        Greedy: closures are taken by the number of others that they agree with, the earlier first.
        """
        n = len(self._closures)
        order = sorted(range(n), key=lambda k: (-int(self._consistent[k].sum()), k))
        chosen: list[int] = []
        for k in order:
            if self._consistent[k, chosen].all():
                chosen.append(k)
        return [self._closures[k] for k in sorted(chosen)]


def accumulated(graph: SubmapGraph) -> Array:
    """Return the covariances (n, 3, 3) of the sequence's frames about the origin of the map, growing along it."""
    total = np.zeros((len(graph.chain), 3, 3))
    for k, covariance in enumerate(graph.covariances):
        total[k + 1] = total[k] + _moved(covariance, graph.chain[k + 1], graph.chain[k, 2])
    return total


def _agree(a: Closure, b: Closure, chain: Array, total: Array) -> bool:
    """Return whether the cycle a.of -> a.to -> b.to -> b.of -> a.of closes; all covariances in the frame a.of."""
    a_of, a_to, b_to, b_of = (SE2.of(chain[k]) for k in (a.of, a.to, b.to, b.of))
    at_a_to = SE2.of(a.measured)
    at_b_to = at_a_to @ a_to.between(b_to)
    at_b_of = at_b_to @ SE2.of(b.measured).inverse()
    error = (at_b_of @ b_of.between(a_of)).array()
    covariance = _moved(_covariance(a), at_a_to.array(), 0.0) + _moved(
        _covariance(b), at_b_to.array(), at_b_of.yaw
    )
    for begin, end, start in ((a.to, b.to, at_a_to @ a_to.inverse()), (b.of, a.of, at_b_of @ b_of.inverse())):
        part = total[max(begin, end)] - total[min(begin, end)]
        covariance = covariance + _moved(part, start.array(), start.yaw)
    return bool(error @ np.linalg.solve(covariance, error) <= MAX_CYCLE)


def _covariance(closure: Closure) -> Array:
    return inverse(closure_information(closure) + _WEAK * np.eye(3))


def _moved(covariance: Array, position: Array, yaw: float) -> Array:
    """Return a covariance (3, 3) of an error at `position` in axes turned by `yaw`, about the frame's origin.

    With position and yaw of one frame this is the adjoint of its pose (Barfoot & Furgale 2014).
    """
    c, s = np.cos(yaw), np.sin(yaw)
    move = np.array([[c, -s, position[1]], [s, c, -position[0]], [0.0, 0.0, 1.0]])
    return move @ covariance @ move.T
