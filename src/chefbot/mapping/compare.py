"""How good a map is, against the true floor plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY, SE2

OCCUPIED_ABOVE = 65
"""Percent; as map files have it."""
TOLERANCE = 1
"""Cells, diagonals included, by which a wall may be off."""
_POINTS = 4000
"""Occupied cells that an alignment looks at; evenly chosen if there are more."""


@dataclass(frozen=True)
class MapQuality:
    """Shares from 0 to 1; NaN where there is nothing to take a share of.

    precision: of the map's occupied cells, those with a true one within TOLERANCE.
    recall: of the true occupied cells that can be seen, those with one of the map within TOLERANCE.
    explored: of the explorable cells, those that the map knows, free or occupied.
    """

    precision: float
    recall: float
    explored: float


@dataclass(frozen=True)
class Comparison:
    """The map as it stands, and after the small motion that fits it best onto the plan.

    alignment: truth_T_map, m and rad: how far the frames are apart.
    """

    as_is: MapQuality
    alignment: SE2
    aligned: MapQuality


def compare(grid: Grid, truth: Grid, explorable: NDArray[np.bool_] | None = None) -> Comparison:
    """Quality of `grid`, as it is and aligned. Size, origin and resolution of both may differ.

    explorable: (h, w) over the cells of `truth`, what the robot could see as free; None for all free ones.
    """
    alignment = align(grid, truth)
    as_is = quality(grid, truth, explorable)
    return Comparison(as_is, alignment, quality(grid, truth, explorable, alignment))


def quality(
    grid: Grid,
    truth: Grid,
    explorable: NDArray[np.bool_] | None = None,
    truth_T_map: SE2 = IDENTITY,
) -> MapQuality:
    """Quality of `grid` after it has been moved by `truth_T_map`."""
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    mask = (truth.cells >= 0) & (truth.cells <= OCCUPIED_ABOVE) if explorable is None else explorable
    if mask.shape != truth.cells.shape:
        raise ValueError(f"a mask of {mask.shape} does not fit a plan of {truth.cells.shape}")
    map_T_truth = truth_T_map.inverse()
    claimed = truth_T_map.apply(_centres(grid, _occupied(grid)))
    seen = _occupied(truth) & ndimage.binary_dilation(mask, np.ones((3, 3)))
    asked = map_T_truth.apply(_centres(truth, seen))
    visited = map_T_truth.apply(_centres(truth, mask))
    return MapQuality(
        _share(_sample(_near_occupied(truth), truth, claimed, TOLERANCE)),
        _share(_sample(_near_occupied(grid), grid, asked, TOLERANCE)),
        _share(_sample(grid.cells != UNKNOWN, grid, visited, 0)),
    )


def align(grid: Grid, truth: Grid, reach: float = 0.4, turn: float = math.radians(4.0)) -> SE2:
    """truth_T_map within `reach` metres and `turn` radians that lays occupied cells on occupied cells best.

    Coarse to fine over the distance transform (likelihood field, Thrun, Burgard & Fox 2005, 6.4); turned
    about the middle of the occupied cells. IDENTITY if either has no occupied cell.
    """
    points = _centres(grid, _occupied(grid))
    if len(points) == 0 or not _occupied(truth).any():
        return IDENTITY
    points = points[:: 1 + len(points) // _POINTS]
    middle = points.mean(axis=0)
    field, frame = _distances(truth, 2.0 * reach)
    best, step = np.zeros(3), np.array([reach, reach, turn]) / 4.0
    spread = 4
    while step[0] > truth.resolution / 20.0:
        offsets = np.stack(np.meshgrid(*[np.arange(-spread, spread + 1)] * 3, indexing="ij"), -1).reshape(
            -1, 3
        )
        offsets = offsets[
            np.argsort(np.abs(offsets).sum(axis=1), kind="stable")
        ]  # of equals the least motion
        candidates = best + offsets * step
        width = max(step[0], truth.resolution)
        scores = [_score(field, frame, points, middle, candidate, width) for candidate in candidates]
        best, step, spread = candidates[int(np.argmax(scores))], step / 2.0, 1
    best = np.clip(best, [-reach, -reach, -turn], [reach, reach, turn])
    return _about(middle, best)


def _about(middle: NDArray[np.float64], motion: NDArray[np.float64]) -> SE2:
    """Turn about `middle`, then shift."""
    there = SE2(float(middle[0] + motion[0]), float(middle[1] + motion[1]), float(motion[2]))
    return there @ SE2(-float(middle[0]), -float(middle[1]), 0.0)


def _score(
    field: NDArray[np.float64],
    frame: Grid,
    points: NDArray[np.float64],
    middle: NDArray[np.float64],
    motion: NDArray[np.float64],
    width: float,
) -> float:
    """Mean of a Gaussian of `width` metres over the distances of the moved points to the true walls."""
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    x, y = (
        _about(middle, motion).apply(points) - (frame.origin_x, frame.origin_y)
    ).T / frame.resolution - 0.5
    distance = ndimage.map_coordinates(field, [y, x], order=1, mode="nearest")
    return float(np.mean(np.exp(-0.5 * (distance / width) ** 2)))


def _distances(truth: Grid, margin: float) -> tuple[NDArray[np.float64], Grid]:
    """Metres to the nearest occupied cell, on the plan with a margin about it."""
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    cells = math.ceil(margin / truth.resolution)
    occupied = np.pad(_occupied(truth), cells)
    frame = Grid(
        occupied.astype(np.int8) * OCCUPIED,
        truth.resolution,
        truth.origin_x - cells * truth.resolution,
        truth.origin_y - cells * truth.resolution,
    )
    return ndimage.distance_transform_edt(~occupied, sampling=truth.resolution), frame


def _occupied(grid: Grid) -> NDArray[np.bool_]:
    return grid.cells > OCCUPIED_ABOVE


def _near_occupied(grid: Grid) -> NDArray[np.bool_]:
    """Cells within TOLERANCE of an occupied one, on the grid widened by TOLERANCE on all sides."""
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    occupied = np.pad(_occupied(grid), TOLERANCE)
    if not occupied.any():
        return occupied
    return ndimage.distance_transform_cdt(~occupied, "chessboard") <= TOLERANCE


def _centres(grid: Grid, mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(x, y) of the middles of the chosen cells, (n, 2), metres."""
    row, column = np.nonzero(mask)
    return np.column_stack(
        [
            grid.origin_x + (column + 0.5) * grid.resolution,
            grid.origin_y + (row + 0.5) * grid.resolution,
        ]
    )


def _sample(
    mask: NDArray[np.bool_], grid: Grid, points: NDArray[np.float64], padding: int
) -> NDArray[np.bool_]:
    """The mask, which is the grid with `padding` cells about it, at the points; False outside."""
    at = np.floor((points - (grid.origin_x, grid.origin_y)) / grid.resolution).astype(np.int64) + padding
    column, row = at.T
    inside = (row >= 0) & (row < mask.shape[0]) & (column >= 0) & (column < mask.shape[1])
    values = np.zeros(len(points), dtype=np.bool_)
    values[inside] = mask[row[inside], column[inside]]
    return values


def _share(hits: NDArray[np.bool_]) -> float:
    return float(hits.mean()) if len(hits) else math.nan
