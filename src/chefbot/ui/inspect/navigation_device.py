"""Base of the web UI's device: how the navigation decides, for engineers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.control.trajectory import predicted_trajectories
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.navigation import CostmapCell, CostmapMark, TrajectoryCandidates
from chefbot.msgs.geometry_msgs import Point, PointStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import In, Out, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.ui.display.message_conversion import cost_image
from chefbot.ui.display.views import CandidatesView, CellView, PlacedGrid
from chefbot.ui.inspect.inspect_device import InspectDevice

SHOWN_STEPS = 3
"""Every so many poses of a trajectory are shown."""


class NavigationDevice(InspectDevice):
    """Shows the local costmap, the trajectories that the controller compares, and cells of the global costmap."""

    local_costmap: In[OccupancyGrid] = topic("local_costmap/costmap")
    trajectory_candidates: In[TrajectoryCandidates]
    costmap_cell: In[CostmapCell]
    clicked_point: Out[PointStamped]

    def on_local_costmap(self, message: OccupancyGrid) -> None:
        """Display the local costmap, which is in the odom frame."""
        pose = self._lookup("map", message.header.frame_id)
        if pose is not None:
            self._server.set_layer("local_costmap", PlacedGrid(cost_image(message.grid), pose))

    def on_trajectory_candidates(self, message: TrajectoryCandidates) -> None:
        """Display the trajectories that the controller compared."""
        pose = self._lookup("map", message.header.frame_id)
        if pose is not None:
            self._server.set_layer("candidates", candidates_view(message, pose, Limits.of(self.robot)))

    def on_costmap_cell(self, message: CostmapCell) -> None:
        """Display a cell of the global costmap."""
        self._server.set_layer("cell", cell_view(message))

    def _inspect_cell(self, x: float, y: float) -> None:
        """Request the cell of the global costmap at a point in the map frame."""
        self.clicked_point.publish(PointStamped(Header.of(self.now_ns, "map"), Point(x, y, 0.0)))

    def _lookup(self, target: str, source: str) -> SE2 | None:
        try:
            return self.tf.lookup(target, source)
        except TransformError:
            return None


def candidates_view(message: TrajectoryCandidates, frame: SE2, limits: Limits) -> CandidatesView:
    """Return the trajectories in the map; `frame` is the pose of the message's frame in it."""
    if not len(message.scores):
        return CandidatesView()
    present = message.present.linear.x, message.present.angular.z
    targets = np.column_stack([message.linear, message.angular])
    poses = predicted_trajectories(
        frame @ message.pose.se2, present, targets, limits, float(message.duration)
    )
    points = np.round(poses[:, ::SHOWN_STEPS, :2].reshape(len(targets), -1), 2)
    return CandidatesView(
        trajectories=tuple(map(tuple, points.tolist())), badness=tuple(_badness(message.scores))
    )


def _badness(scores: NDArray[np.float64]) -> list[float | None]:
    """Return 0 for the best score to 1 for the worst; None for one that is not finite."""
    finite = scores[np.isfinite(scores)]
    if not len(finite):
        return [None] * len(scores)
    low, span = float(finite.min()), float(np.ptp(finite)) or 1.0
    return [round((score - low) / span, 2) if np.isfinite(score) else None for score in scores.tolist()]


def cell_view(message: CostmapCell) -> CellView:
    """Return a cell as it is displayed."""
    now_ns = message.header.stamp.ns

    def age(mark: CostmapMark) -> float | None:
        return round((now_ns - mark.marked_at.ns) / 1e9, 1) if mark.marked_at.ns else None

    return CellView(
        x=message.point.x,
        y=message.point.y,
        size=round(message.resolution, 4),
        cost=int(message.cost) if message.inside else None,
        marks=tuple((mark.source, age(mark)) for mark in message.marks),
    )
