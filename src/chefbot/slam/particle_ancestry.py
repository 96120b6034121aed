"""Who descends from whom: the paths of the particles as a tree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Ancestry:
    """Poses of all particles at every processed scan, with each one's parent at the scan before.

    Resampling lets most lines die out, so the particles of today share an ancestor a while ago. What lies
    before is kept once, as the `trunk`: it cannot change any more, and memory does not grow with particles
    times time.
    """

    def __init__(self, particles: int) -> None:
        self.trunk: list[NDArray[np.float64]] = []
        """Poses (3,) shared by all particles, oldest first."""
        self._poses: list[NDArray[np.float64]] = []
        self._parents: list[NDArray[np.int64]] = []
        self._pending = np.arange(particles)

    def resample(self, parents: NDArray[np.int64]) -> None:
        """Particle i goes on from particle `parents[i]`."""
        self._pending = self._pending[parents]

    def append(self, poses: NDArray[np.float64]) -> None:
        """The poses (p, 3) at the scan just processed."""
        self._poses.append(poses.copy())
        self._parents.append(self._pending)
        self._pending = np.arange(len(poses))

    def branch(self, particle: int) -> NDArray[np.float64]:
        """Poses (n, 3) of the particle's ancestors after the trunk, oldest first."""
        path = np.empty((len(self._poses), 3))
        i = int(self._pending[particle])
        for k in range(len(path) - 1, -1, -1):
            path[k] = self._poses[k][i]
            i = int(self._parents[k][i])
        return path

    def path(self, particle: int) -> NDArray[np.float64]:
        """Poses (n, 3) of the particle at all processed scans, oldest first."""
        return np.vstack([np.array(self.trunk).reshape(-1, 3), self.branch(particle)])

    def settle(self) -> NDArray[np.float64]:
        """Move to the trunk what all particles share by now; returns those poses, (n, 3)."""
        alive = np.unique(self._pending)
        k = len(self._poses)
        while k > 0 and len(alive) > 1:
            k -= 1
            alive = np.unique(self._parents[k][alive])
        shared = self._shared(k, int(alive[0])) if len(alive) == 1 else np.empty((0, 3))
        self.trunk.extend(shared)
        del self._poses[: len(shared)], self._parents[: len(shared)]
        return shared

    def _shared(self, k: int, ancestor: int) -> NDArray[np.float64]:
        """The path to the one ancestor that is left at step k - 1."""
        path = np.empty((k, 3))
        for j in range(k - 1, -1, -1):
            path[j] = self._poses[j][ancestor]
            ancestor = int(self._parents[j][ancestor])
        return path
