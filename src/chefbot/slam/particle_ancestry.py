"""The trajectories of the particles, stored as an ancestry tree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class ParticleAncestry:
    """Poses of all particles at every processed scan, with the index of each one's parent at the scan before.

    Resampling removes most lineages, so that all particles share a recent common ancestor. The trajectory up to it is
    final and is stored once, as `common_path`: memory does not grow with particles times time.
    """

    def __init__(self, particles: int) -> None:
        self.common_path: list[NDArray[np.float64]] = []
        """Poses (3,) shared by all particles, oldest first."""
        self._poses: list[NDArray[np.float64]] = []
        self._parents: list[NDArray[np.int64]] = []
        self._pending = np.arange(particles)

    def resample(self, parents: NDArray[np.int64]) -> None:
        """Make particle i a descendant of particle `parents[i]`."""
        self._pending = self._pending[parents]

    def append(self, poses: NDArray[np.float64]) -> None:
        """Append the poses (p, 3) at the scan just processed."""
        self._poses.append(poses.copy())
        self._parents.append(self._pending)
        self._pending = np.arange(len(poses))

    def branch(self, particle: int) -> NDArray[np.float64]:
        """Return the poses (n, 3) of the particle's ancestors since the common ancestor, oldest first."""
        path = np.empty((len(self._poses), 3))
        i = int(self._pending[particle])
        for k in range(len(path) - 1, -1, -1):
            path[k] = self._poses[k][i]
            i = int(self._parents[k][i])
        return path

    def path(self, particle: int) -> NDArray[np.float64]:
        """Return the poses (n, 3) of the particle at all processed scans, oldest first."""
        return np.vstack([np.array(self.common_path).reshape(-1, 3), self.branch(particle)])

    def collapse_common_ancestors(self) -> NDArray[np.float64]:
        """Move the poses that all particles share to the common part and return them, (n, 3)."""
        # Follow the distinct ancestors back until a single one is left
        ancestors = np.unique(self._pending)
        k = len(self._poses)
        while k > 0 and len(ancestors) > 1:
            k -= 1
            ancestors = np.unique(self._parents[k][ancestors])
        shared = self._shared(k, int(ancestors[0])) if len(ancestors) == 1 else np.empty((0, 3))
        self.common_path.extend(shared)
        del self._poses[: len(shared)], self._parents[: len(shared)]
        return shared

    def _shared(self, k: int, ancestor: int) -> NDArray[np.float64]:
        """Return the trajectory to the common ancestor at step k - 1."""
        path = np.empty((k, 3))
        for j in range(k - 1, -1, -1):
            path[j] = self._poses[j][ancestor]
            ancestor = int(self._parents[j][ancestor])
        return path
