"""Pose graph in the plane: poses and relative measurements between them.

Grisetti, Kuemmerle, Stachniss, Burgard: A Tutorial on Graph-Based SLAM, IEEE Intelligent Transportation Systems
Magazine 2 (4), 2010.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.slam.graph.edges import Edges
from chefbot.slam.graph.least_squares import edge_costs, linearized, solved

Array = NDArray[np.float64]
_MAX_ITERATIONS = 30
_STOP_LINEAR, _STOP_ANGULAR = 1e-4, 1e-5
"""Largest step in m and rad at which the optimization ends."""
_DAMPING, _MAX_DAMPING = 1e-6, 1e6


def optimized(poses: Array, edges: Edges, iterations: int = _MAX_ITERATIONS) -> Array:
    """Return the poses (n, 3) of least cost; the first pose is held.

    Levenberg-Marquardt with the Geman-McClure kernel, in the form of dynamic covariance scaling (Agarwal et al.,
    ICRA 2013).
    """
    if not len(edges) or len(poses) < 2:
        return poses.copy()
    poses, damping = poses.copy(), _DAMPING
    cost = edge_costs(poses, edges).sum()
    for _ in range(iterations):
        hessian, gradient = linearized(poses, edges)
        while True:
            step = solved(hessian, gradient, damping)
            trial = poses + step
            trial_cost = edge_costs(trial, edges).sum()
            if trial_cost <= cost * (1.0 + 1e-12) or damping >= _MAX_DAMPING:
                break
            damping = max(damping, 1e-4) * 10.0
        if trial_cost > cost * (1.0 + 1e-12):
            break
        poses, cost, damping = trial, trial_cost, max(damping * 0.1, _DAMPING)
        if np.abs(step[:, :2]).max() < _STOP_LINEAR and np.abs(step[:, 2]).max() < _STOP_ANGULAR:
            break
    return poses
