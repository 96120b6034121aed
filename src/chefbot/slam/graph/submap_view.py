"""What a loop search needs of a finished submap, drawn again from its nodes and kept only as long as it is used."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chefbot.slam.graph.field_pyramid import field_pyramid
from chefbot.slam.graph.free_space import mark_free
from chefbot.slam.graph.submap import ScanNode, Submap
from chefbot.slam.graph.surface_grid import SurfaceGrid, transformed

_MAX_POINTS = 400
"""Number of points that stand for a submap in a search."""
_CAPACITY = 8
"""Number of submaps that are kept drawn."""


class SubmapView:
    """A finished submap: grid and free space of all its scans, points and normals of its own ones."""

    def __init__(self, submap: Submap, nodes: Sequence[ScanNode], max_cells: int) -> None:
        own = [(k, nodes[k].pose) for k in submap.nodes]
        self._placed = submap.overlap + own
        self._nodes = nodes
        self.grid = SurfaceGrid(max_cells)
        for k, pose in self._placed:
            self.grid.add(nodes[k].features.outline, pose)
        points = np.concatenate([transformed(nodes[k].features.points, pose) for k, pose in own])
        normals = np.concatenate([_turned(nodes[k].features.normals, pose[2]) for k, pose in own])
        # Every n-th point: all parts of the submap stay
        kept = np.linspace(0, len(points) - 1, min(len(points), _MAX_POINTS)).astype(np.int64)
        self.points, self.normals = points[kept].astype(np.float32), normals[kept].astype(np.float32)
        distance = np.sort(np.hypot(self.points[:, 0], self.points[:, 1]))
        self.reach = float(distance[int(0.9 * (len(distance) - 1))]) if len(distance) else 0.0

    @cached_property
    def levels(self) -> NDArray[np.uint8]:
        """Upper bounds of the field for branch and bound."""
        return field_pyramid(self.grid.field)

    @cached_property
    def free(self) -> NDArray[np.uint8]:
        """Cells (height, width) uint8 that rays crossed, 1 or 0."""
        free = np.zeros(self.grid.field.shape, np.uint8)
        for k, pose in self._placed:
            beams = self._nodes[k].beams
            mark_free(free, self.grid.origin, beams.sensor, beams.ends, pose)
        return free


class SubmapViews:
    """A cache of the views of finished submaps; it keeps the most recently used ones."""

    def __init__(self, max_cells: int) -> None:
        self._max_cells = max_cells
        self._views: OrderedDict[int, SubmapView] = OrderedDict()

    def get(self, index: int, submaps: Sequence[Submap], nodes: Sequence[ScanNode]) -> SubmapView:
        """Return the view of a finished submap, drawn if it is not kept."""
        if index not in self._views:
            self._views[index] = SubmapView(submaps[index], nodes, self._max_cells)
            if len(self._views) > _CAPACITY:
                self._views.popitem(last=False)
        self._views.move_to_end(index)
        return self._views[index]


def _turned(normals: NDArray[np.float32], yaw: float) -> NDArray[np.float64]:
    return transformed(normals, np.array([0.0, 0.0, yaw]))
