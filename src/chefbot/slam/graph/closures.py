"""Loop closures between submaps: search, refinement and geometric verification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.branch_and_bound import SearchWindow, search
from chefbot.slam.graph.free_space import count_explained
from chefbot.slam.graph.refinement import refine
from chefbot.slam.graph.submap_view import SubmapView
from chefbot.slam.graph.surface_grid import CELL

Array = NDArray[np.float64]
_SIGMAS = 3.0
_MIN_LINEAR, _MAX_LINEAR = 0.3, 25.0
_MIN_ANGULAR, _MAX_ANGULAR = 0.05, 0.6
"""Limits of the search window's half widths, m and rad."""
_MIN_TURN, _MAX_TURN = 0.008, 0.03
_MIN_SCORE = 0.35
"""Lowest mean field value of a match in the search."""
MIN_EXPLAINED = 0.4
"""Smallest share of one submap's points that lie on surfaces of the other, of the better side."""
MIN_AGREEMENT = 0.85
"""Smallest ratio of points on surfaces to those on surfaces or in free space, of both sides."""
_BEAMS = 120.0
_NO_PRIOR = np.diag([1e-2, 1e-2, 1e-2])


class SubmapFit(NamedTuple):
    """How well two submaps fit at a pose: shares of explained points, and agreement, seen from each side."""

    explained: tuple[float, float]
    agreement: tuple[float, float]

    @property
    def is_good(self) -> bool:
        """Whether the match is accepted."""
        return max(self.explained) >= MIN_EXPLAINED and min(self.agreement) >= MIN_AGREEMENT


class ClosureResidual(NamedTuple):
    """A closure between two scans, by their numbers, and what is left of it at their final poses, m and rad."""

    of: int
    to: int
    linear: float
    angular: float


@dataclass(frozen=True, eq=False)
class Closure:
    """A measured pose (3,) of submap `to` in the frame of submap `of`, and its information (3, 3)."""

    of: int
    to: int
    measured: Array
    information: Array


def find_closure(
    of: int, to: int, target: SubmapView, query: SubmapView, predicted: Array, covariance: Array
) -> Closure | None:
    """Search for the pose of a submap in another one's frame; return None if nothing verified is found.

    predicted: (3,) pose of `to` in the frame of `of` by the graph; covariance: (3, 3).
    """
    linear = float(
        np.clip(_SIGMAS * np.sqrt(max(covariance[0, 0], covariance[1, 1])), _MIN_LINEAR, _MAX_LINEAR)
    )
    angular = float(np.clip(_SIGMAS * np.sqrt(covariance[2, 2]), _MIN_ANGULAR, _MAX_ANGULAR))
    turn = float(np.clip(CELL / max(query.reach, CELL), _MIN_TURN, _MAX_TURN))
    found = search(
        query.points,
        SearchWindow(predicted, linear, angular, turn),
        target.levels,
        target.grid.origin,
        _MIN_SCORE,
    )
    if found is None:
        return None
    pose, information, _ = refine(
        query.points, query.normals, found[0], found[0], _NO_PRIOR, _BEAMS, target.grid.slot, target.grid.totals,
        target.grid.origin,
    )  # fmt: skip
    fit = verify(target, query, pose)
    return Closure(of, to, pose, information) if fit.is_good else None


def verify(target: SubmapView, query: SubmapView, pose: Array) -> SubmapFit:
    """Compare two submaps at the pose (3,) of `query` in the frame of `target`, from both sides."""
    sides = (
        (query.points, pose, target),
        (target.points, SE2.of(pose).inverse().array(), query),
    )
    explained, agreement = [], []
    for points, at, view in sides:
        good, bad = count_explained(points, at, view.grid.field, view.free, view.grid.origin)
        explained.append(good / max(len(points), 1))
        agreement.append(good / max(good + bad, 1))
    return SubmapFit((explained[0], explained[1]), (agreement[0], agreement[1]))
