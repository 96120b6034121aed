"""Which stands saw the same walls, and how they lie to each other by that.

Pairs of scans are matched point to line (Chen & Medioni 1991; Censi, An ICP variant using a point-to-line metric,
ICRA 2008) and become links of a graph that is solved as a whole, as Lu & Milios (Globally consistent range scan
alignment for environment mapping, Autonomous Robots 4, 1997) did. A map that grows scan by scan would keep what the
odometry believed when its first scans were added: the very error that is sought.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2

Array = NDArray[np.float64]
NEIGHBOURHOOD = 0.12
"""m about an end of a beam from which its wall's direction is taken."""
LEAST_NEIGHBOURS = 4
THICK = 0.15
"""A neighbourhood broader than this share of its length is a corner, not a wall."""
REACHES = (0.3, 0.15, 0.08, 0.05)
"""m within which a point looks for its wall, from the first guess to the last step."""
END = 0.01
"""m: standard deviation of a mean beam's end about the wall that it is matched with."""
FEWEST = 25
"""Points that two scans must share."""
OVERLAP = 0.35
"""Share of one's points that the other saw as well."""
PARTNERS = 8
"""Links of one stand to earlier ones, spread over the drive."""
MOST_MOVED = (0.15, 0.1)
"""m and rad that a match may lie from its first guess."""
DAMPING = np.array([1.0 / 0.03**2, 1.0 / 0.03**2, 1.0 / 0.03**2])
"""Where the walls do not hold the match it stays near where it began; this is no information."""
THINNED = 4


class Link(NamedTuple):
    """Two stands: `first_T_second` by their scans, and its inverse covariance (3, 3) of x, y m and yaw rad."""

    first: int
    second: int
    pose: SE2
    information: Array


class Surface:
    """The walls of one stand: points on them and their normals, in the sensor's frame."""

    def __init__(self, walls: Array) -> None:
        apart = np.hypot(*(walls[:, None] - walls[None]).transpose(2, 0, 1))
        near = (apart < NEIGHBOURHOOD).astype(np.float64)
        count = near.sum(axis=1)
        self.points = near @ walls / count[:, None]
        xx, yy = (near @ walls[:, k] ** 2 / count - self.points[:, k] ** 2 for k in (0, 1))
        xy = near @ (walls[:, 0] * walls[:, 1]) / count - self.points[:, 0] * self.points[:, 1]
        direction = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        self.normals = np.column_stack([-np.sin(direction), np.cos(direction)])
        middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        broad, long = np.sqrt(np.maximum(middle - radius, 0.0)), np.sqrt(middle + radius)
        self.flat = (count >= LEAST_NEIGHBOURS) & (broad < np.maximum(THICK * long, 0.0) + END)
        self.walls = walls

    @cached_property
    def tree(self) -> Any:
        """For the nearest point."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points)


def links(poses: Sequence[SE2], surfaces: Sequence[Surface]) -> list[Link]:
    """Of all pairs that share enough, from the `poses` as a first guess."""
    found = []
    for second in range(1, len(surfaces)):
        for first in _partners(second, poses, surfaces):
            link = match(first, second, poses[first].between(poses[second]), surfaces)
            if link is not None:
                found.append(link)
    return found


def _partners(second: int, poses: Sequence[SE2], surfaces: Sequence[Surface]) -> list[int]:
    """Earlier stands that saw the same, spread evenly."""
    seen = poses[second].apply(surfaces[second].walls[::THINNED])
    if len(seen) * THINNED < FEWEST:
        return []
    able = []
    for first in range(second):
        if len(surfaces[first].walls) < FEWEST:
            continue
        apart, _ = surfaces[first].tree.query(
            poses[first].inverse().apply(seen), distance_upper_bound=REACHES[0]
        )
        if np.isfinite(apart).mean() > OVERLAP:
            able.append(first)
    if len(able) <= PARTNERS:
        return able
    return [able[k] for k in np.linspace(0, len(able) - 1, PARTNERS).round().astype(int)]


def match(first: int, second: int, guess: SE2, surfaces: Sequence[Surface]) -> Link | None:
    """The link of two stands, None where too little is shared."""
    target, points = surfaces[first], surfaces[second].walls
    at = guess
    information = np.zeros((3, 3))
    for reach in np.repeat(REACHES, 3):
        apart, nearest = target.tree.query(at.apply(points), distance_upper_bound=reach)
        kept = np.isfinite(apart)
        kept[kept] = target.flat[nearest[kept]]
        if kept.sum() < FEWEST:
            return None
        error, J = _point_to_line(at, points[kept], target, nearest[kept])
        information = J.T @ J / END**2
        step = np.linalg.solve(information + np.diag(DAMPING), J.T @ error / END**2)
        at = SE2.of(at.array() - step)
    moved = guess.between(at)
    if math.hypot(moved.x, moved.y) > MOST_MOVED[0] or abs(moved.yaw) > MOST_MOVED[1]:
        return None  # it slid along a wall to another one that looks alike
    return Link(first, second, at, information)


def _point_to_line(
    at: SE2, points: Array, target: Surface, nearest: NDArray[np.int64]
) -> tuple[Array, Array]:
    placed = at.apply(points)
    normals = target.normals[nearest]
    error = ((placed - target.points[nearest]) * normals).sum(axis=1)
    arm = placed - (at.x, at.y)
    return error, np.column_stack([normals, normals[:, 1] * arm[:, 0] - normals[:, 0] * arm[:, 1]])
