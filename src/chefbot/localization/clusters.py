"""The heaviest cluster of particles: the estimate that a multimodal particle filter reports."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.pose_bins import BIN_YAWS, PoseBins
from chefbot.maths.se2 import SE2


class Cluster(NamedTuple):
    """One mode of the posterior: mean, covariance (3, 3) of (x, y, yaw), share of the total weight."""

    mean: SE2
    covariance: NDArray[np.float64]
    weight: float


@njit(cache=True, nogil=True)
def _connect(
    occupied: NDArray[np.int32], shape: tuple[int, int, int], labels: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Return the connected component of each occupied bin, with 26 neighbours per bin and periodic yaw."""
    count = occupied.size
    component = np.full(count, -1, np.int32)
    stack = np.empty(count, np.int32)
    component_count = 0
    for start in range(count):
        if component[start] >= 0:
            continue
        # Flood fill with an explicit stack
        component[start] = component_count
        stack[0], depth = start, 1
        while depth > 0:
            depth -= 1
            depth = _push_neighbours(stack, depth, component, occupied, shape, labels)
        component_count += 1
    return component


@njit(cache=True, nogil=True)
def _push_neighbours(
    stack: NDArray[np.int32],
    depth: int,
    component: NDArray[np.int32],
    occupied: NDArray[np.int32],
    shape: tuple[int, int, int],
    labels: NDArray[np.int32],
) -> int:
    """Push the unvisited neighbours of stack[depth] onto the stack; return its new depth."""
    bin_index, label = occupied[stack[depth]], component[stack[depth]]
    yaw_bin, cell = bin_index % BIN_YAWS, bin_index // BIN_YAWS
    row, col = cell // shape[1], cell % shape[1]
    for r in range(max(row - 1, 0), min(row + 2, shape[0])):
        for c in range(max(col - 1, 0), min(col + 2, shape[1])):
            for t in range(yaw_bin - 1, yaw_bin + 2):
                neighbour = labels[(r * shape[1] + c) * BIN_YAWS + t % BIN_YAWS]
                if neighbour >= 0 and component[neighbour] < 0:
                    component[neighbour] = label
                    stack[depth] = neighbour
                    depth += 1
    return depth


@njit(cache=True, nogil=True)
def _moments(
    particles: NDArray[np.float64], weights: NDArray[np.float64], members: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the weighted mean (3,) and the covariance (3, 3) of the members.

    Without BLAS, whose threads would leave the order of summation open.
    """
    totals = np.zeros(5)
    for i in range(particles.shape[0]):
        if members[i]:
            w, yaw = weights[i], particles[i, 2]
            totals[0] += w * particles[i, 0]
            totals[1] += w * particles[i, 1]
            totals[2] += w * math.cos(yaw)
            totals[3] += w * math.sin(yaw)
            totals[4] += w
    mean = np.empty(3)
    # Circular mean of the yaw
    mean[0], mean[1], mean[2] = totals[0] / totals[4], totals[1] / totals[4], math.atan2(totals[3], totals[2])
    covariance = np.zeros((3, 3))
    deviation = np.empty(3)
    for i in range(particles.shape[0]):
        if members[i]:
            for j in range(3):
                deviation[j] = particles[i, j] - mean[j]
            # Shortest angular difference
            deviation[2] -= 2.0 * math.pi * round(deviation[2] / (2.0 * math.pi))
            for j in range(3):
                for k in range(3):
                    covariance[j, k] += weights[i] / totals[4] * deviation[j] * deviation[k]
    return mean, covariance


def moments(
    particles: NDArray[np.float64], weights: NDArray[np.float64], members: NDArray[np.bool_]
) -> tuple[SE2, NDArray[np.float64]]:
    """Return the weighted mean (circular in yaw) and the covariance (3, 3).

    Only the particles (n, 3) that are members (n,) count.
    """
    mean, covariance = _moments(particles, weights, members)
    return SE2.of(mean), covariance


def heaviest(particles: NDArray[np.float64], weights: NDArray[np.float64], bins: PoseBins) -> Cluster:
    """Return the heaviest cluster of particles (n, 3) with weights (n,) that sum to one."""
    particle_bins, occupied = bins.label(particles)
    # Connected components of the occupied bins, as Nav2's amcl clusters its kd-tree
    component = _connect(occupied, bins.shape, bins.labels)
    bins.clear(occupied)
    # Heaviest component by total weight
    component_weights = np.bincount(component[particle_bins], weights=weights)
    best = int(np.argmax(component_weights))
    mean, covariance = moments(particles, weights, component[particle_bins] == best)
    return Cluster(mean, covariance, min(1.0, float(component_weights[best]) / float(weights.sum())))


def position_spread(covariance: NDArray[np.float64]) -> float:
    """Return the largest standard deviation of the position over all directions, metres."""
    return math.sqrt(max(0.0, float(np.linalg.eigvalsh(covariance[:2, :2])[-1])))
