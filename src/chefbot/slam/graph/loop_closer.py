"""Closing of loops: which submaps are searched, which closures count, and which are taken back."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.closures import Closure, find_closure
from chefbot.slam.graph.consistency import Consistency
from chefbot.slam.graph.edges import Array
from chefbot.slam.graph.submap import ScanNode, Submap
from chefbot.slam.graph.submap_graph import SubmapGraph
from chefbot.slam.graph.submap_view import SubmapViews

_MIN_OVERLAP, _MAX_OVERLAP = 8.0, 20.0
"""Limits of the distance of the frames of submaps that may see the same surfaces, m: half their reach."""
_CERTAIN_STD = 1.0
"""Standard deviation in m up to which a relative position counts as known."""
_MAX_CERTAIN, _MAX_UNCERTAIN = 6, 12
"""Number of submaps at known and at uncertain relative positions that one is compared with."""
_MAX_DISTANCE = 16.3
"""Largest squared Mahalanobis distance of a closure after the optimization: 99.9 % of true ones."""


class LoopCloser:
    """Compares finished submaps with earlier ones and keeps the graph's closures."""

    def __init__(self, max_cells: int) -> None:
        self._views = SubmapViews(max_cells)
        self._queue: deque[tuple[int, int]] = deque()
        self._consistency = Consistency()
        self.closures: list[Closure] = []
        """The closures that are applied now."""
        self.found = 0
        """Number of verified closures, applied or not."""

    def enqueue(self, query: int, graph: SubmapGraph, submaps: Sequence[Submap]) -> None:
        """Note the earlier submaps that a finished one may overlap, the likeliest first."""
        offset = graph.origins[: max(query - 1, 0), :2] - graph.origins[query, :2]
        distance = np.hypot(offset[:, 0], offset[:, 1])
        reachable = np.flatnonzero(distance < _MAX_OVERLAP + graph.farthest())
        covariances = graph.relative_covariances(query, reachable.tolist())
        certain: list[tuple[float, int]] = []
        uncertain: list[tuple[float, int]] = []
        for other, covariance in zip(reachable.tolist(), covariances, strict=True):
            overlap = np.clip(
                0.5 * (submaps[other].reach + submaps[query].reach) / 2.0, _MIN_OVERLAP, _MAX_OVERLAP
            )
            deviation = math.sqrt(max(covariance[0, 0], covariance[1, 1]))
            share = float(distance[other]) / (overlap + 2.0 * deviation)
            if share < 1.0:
                (certain if deviation < _CERTAIN_STD else uncertain).append((share, other))
        chosen = sorted(certain)[:_MAX_CERTAIN] + sorted(uncertain)[:_MAX_UNCERTAIN]
        self._queue.extend((other, query) for _, other in chosen)

    def search(
        self, graph: SubmapGraph, submaps: Sequence[Submap], nodes: Sequence[ScanNode], limit: int
    ) -> bool:
        """Make at most `limit` searches of those noted; return whether the graph has changed."""
        pairs = [self._queue.popleft() for _ in range(min(limit, len(self._queue)))]
        closures = [self._find(of, to, graph, submaps, nodes) for of, to in pairs]
        verified = [closure for closure in closures if closure is not None]
        if verified:
            self.accept(verified, graph)
        return bool(verified)

    def accept(self, verified: Sequence[Closure], graph: SubmapGraph) -> None:
        """Add verified closures and apply those of all that are consistent: some may be taken back."""
        for closure in verified:
            self._consistency.add(closure, graph)
        self.found += len(verified)
        self._apply(graph)

    @property
    def pending(self) -> int:
        """Number of searches that have not been made yet."""
        return len(self._queue)

    def _find(
        self, of: int, to: int, graph: SubmapGraph, submaps: Sequence[Submap], nodes: Sequence[ScanNode]
    ) -> Closure | None:
        target, query = (self._views.get(k, submaps, nodes) for k in (of, to))
        predicted = SE2.of(graph.origins[of]).between(SE2.of(graph.origins[to])).array()
        # Relative to the later submap the earlier one's place is uncertain by the same amount
        (covariance,) = graph.relative_covariances(of, [to])
        return find_closure(of, to, target, query, predicted, covariance)

    def _apply(self, graph: SubmapGraph) -> None:
        """Apply the consistent closures; take back what does not fit the optimized graph."""
        closures = self._consistency.consistent()
        graph.close(closures)
        while closures:
            distances: Array = graph.closure_distances()
            # The worst go first: they may be what makes others look bad
            limit = max(_MAX_DISTANCE, 0.5 * float(distances.max()))
            if distances.max() <= _MAX_DISTANCE:
                break
            closures = [c for c, distance in zip(closures, distances, strict=True) if distance <= limit]
            graph.close(closures)
        self.closures = closures
