"""The belief's heaviest hump: what a filter with several hypotheses should report."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.localization.pose_bins import BIN_YAWS, PoseBins
from chefbot.maths.se2 import SE2


class Cluster(NamedTuple):
    """A connected hump of the belief: mean, covariance (3, 3) of (x, y, yaw), share of the whole weight."""

    mean: SE2
    covariance: NDArray[np.float64]
    share: float


@njit(cache=True, nogil=True)
def _connect(
    occupied: NDArray[np.int32], shape: tuple[int, int, int], labels: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Number of the connected component of each occupied bin; neighbours are the 26 about it, yaw closes a
    circle."""
    count = occupied.size
    component = np.full(count, -1, np.int32)
    stack = np.empty(count, np.int32)
    found = 0
    for start in range(count):
        if component[start] >= 0:
            continue
        component[start] = found
        stack[0], depth = start, 1
        while depth > 0:
            depth -= 1
            depth = _spread(stack, depth, component, occupied, shape, labels)
        found += 1
    return component


@njit(cache=True, nogil=True)
def _spread(
    stack: NDArray[np.int32],
    depth: int,
    component: NDArray[np.int32],
    occupied: NDArray[np.int32],
    shape: tuple[int, int, int],
    labels: NDArray[np.int32],
) -> int:
    """Puts the unseen neighbours of stack[depth] on the stack; its new depth."""
    at, number = occupied[stack[depth]], component[stack[depth]]
    turn, cell = at % BIN_YAWS, at // BIN_YAWS
    row, col = cell // shape[1], cell % shape[1]
    for r in range(max(row - 1, 0), min(row + 2, shape[0])):
        for c in range(max(col - 1, 0), min(col + 2, shape[1])):
            for t in range(turn - 1, turn + 2):
                near = labels[(r * shape[1] + c) * BIN_YAWS + t % BIN_YAWS]
                if near >= 0 and component[near] < 0:
                    component[near] = number
                    stack[depth] = near
                    depth += 1
    return depth


@njit(cache=True, nogil=True)
def _moments(
    particles: NDArray[np.float64], weights: NDArray[np.float64], members: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weighted sums of x, y, cos yaw, sin yaw, 1 (5,), and covariance (3, 3) about their mean; no BLAS,
    whose threads would leave the order of the sums open."""
    sums = np.zeros(5)
    for i in range(particles.shape[0]):
        if members[i]:
            w, yaw = weights[i], particles[i, 2]
            sums[0] += w * particles[i, 0]
            sums[1] += w * particles[i, 1]
            sums[2] += w * math.cos(yaw)
            sums[3] += w * math.sin(yaw)
            sums[4] += w
    mean = np.empty(3)
    mean[0], mean[1], mean[2] = sums[0] / sums[4], sums[1] / sums[4], math.atan2(sums[3], sums[2])
    covariance = np.zeros((3, 3))
    off = np.empty(3)
    for i in range(particles.shape[0]):
        if members[i]:
            for a in range(3):
                off[a] = particles[i, a] - mean[a]
            off[2] -= 2.0 * math.pi * round(off[2] / (2.0 * math.pi))
            for a in range(3):
                for b in range(3):
                    covariance[a, b] += weights[i] / sums[4] * off[a] * off[b]
    return mean, covariance


def moments(
    particles: NDArray[np.float64], weights: NDArray[np.float64], members: NDArray[np.bool_]
) -> tuple[SE2, NDArray[np.float64]]:
    """Weighted mean (circular in yaw) and covariance (3, 3) of those of the particles (n, 3) that are
    members (n,)."""
    mean, covariance = _moments(particles, weights, members)
    return SE2.of(mean), covariance


def heaviest(particles: NDArray[np.float64], weights: NDArray[np.float64], bins: PoseBins) -> Cluster:
    """The heaviest cluster of particles (n, 3) with weights (n,) that sum to one."""
    labelled, occupied = bins.label(particles)
    component = _connect(occupied, bins.shape, bins.labels)
    bins.clear(occupied)
    mass = np.bincount(component[labelled], weights=weights)
    best = int(np.argmax(mass))
    mean, covariance = moments(particles, weights, component[labelled] == best)
    return Cluster(mean, covariance, min(1.0, float(mass[best]) / float(weights.sum())))


def position_spread(covariance: NDArray[np.float64]) -> float:
    """Standard deviation in metres along the worst direction."""
    return math.sqrt(max(0.0, float(np.linalg.eigvalsh(covariance[:2, :2])[-1])))
