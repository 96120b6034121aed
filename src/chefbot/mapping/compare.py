"""Quality of a map compared with the ground-truth floor plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY, SE2

OCCUPIED_THRESHOLD = 65
"""Occupancy threshold in percent, as in map files."""
TOLERANCE = 1
"""Permitted offset of a wall in cells, including diagonals."""
_MAX_POINTS = 4000
"""Maximum number of occupied cells for the alignment; evenly subsampled if there are more."""


@dataclass(frozen=True)
class MapQuality:
    """Ratios from 0 to 1; NaN where the denominator is zero.

    precision: of the map's occupied cells, those with a true one within TOLERANCE.
    recall: of the true occupied cells that are visible, those with an occupied cell of the map within
    TOLERANCE.
    explored: of the explorable cells, those that are known in the map, free or occupied.
    """

    precision: float
    recall: float
    explored: float


@dataclass(frozen=True)
class Comparison:
    """The quality of a map before and after rigid alignment with the floor plan.

    alignment: truth_T_map, m and rad: the offset between the frames.
    """

    as_is: MapQuality
    alignment: SE2
    aligned: MapQuality


def compare(grid: Grid, truth: Grid, explorable: NDArray[np.bool_] | None = None) -> Comparison:
    """Return the quality of `grid`, unaligned and aligned.

    Size, origin and resolution of the grids may differ. explorable: (h, w) over the cells of `truth`, what
    the robot could observe as free; None for all free cells.
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
    """Return the quality of `grid` after it has been transformed by `truth_T_map`."""
    from scipy import ndimage  # imported late: it takes half a second

    mask = _mask_of(truth, explorable)
    # Precision in the frame of the truth, recall and coverage in the frame of the map
    map_T_truth = truth_T_map.inverse()
    mapped_points = truth_T_map.apply(_centres(grid, _occupied(grid)))
    # Only walls next to explorable cells can be seen
    visible = _occupied(truth) & ndimage.binary_dilation(mask, np.ones((3, 3)))
    visible_points = map_T_truth.apply(_centres(truth, visible))
    explorable_points = map_T_truth.apply(_centres(truth, mask))
    return MapQuality(
        _mean(_sample(_near_occupied(truth), truth, mapped_points, TOLERANCE)),
        _mean(_sample(_near_occupied(grid), grid, visible_points, TOLERANCE)),
        _mean(_sample(grid.cells != UNKNOWN, grid, explorable_points, 0)),
    )


def _mask_of(truth: Grid, explorable: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    mask = (truth.cells >= 0) & (truth.cells <= OCCUPIED_THRESHOLD) if explorable is None else explorable
    if mask.shape != truth.cells.shape:
        raise ValueError(f"a mask of {mask.shape} does not fit a plan of {truth.cells.shape}")
    return mask


def align(grid: Grid, truth: Grid, reach: float = 0.4, turn: float = math.radians(4.0)) -> SE2:
    """Return the truth_T_map within `reach` metres and `turn` radians that best aligns the occupied cells.

    Coarse-to-fine search over the distance transform (likelihood field, Thrun, Burgard & Fox 2005, 6.4),
    rotated about the centroid of the occupied cells. IDENTITY if either grid has no occupied cell.
    """
    points = _centres(grid, _occupied(grid))
    if len(points) == 0 or not _occupied(truth).any():
        return IDENTITY
    points = points[:: 1 + len(points) // _MAX_POINTS]
    centroid = points.mean(axis=0)
    # Distance transform of the true walls
    field, frame = _distances(truth, 2.0 * reach)
    best, step, n_steps = np.zeros(3), np.array([reach, reach, turn]) / 4.0, 4
    while step[0] > truth.resolution / 20.0:
        # Grid search about the best motion so far
        candidates = best + _offsets(n_steps) * step
        width = max(step[0], truth.resolution)
        scores = [_score(field, frame, points, centroid, candidate, width) for candidate in candidates]
        # Halve the step and search the neighbours only
        best, step, n_steps = candidates[int(np.argmax(scores))], step / 2.0, 1
    best = np.clip(best, [-reach, -reach, -turn], [reach, reach, turn])
    return _rotation_about(centroid, best)


def _offsets(n_steps: int) -> NDArray[np.int64]:
    """Return the offsets (n, 3) of a grid of `n_steps` to both sides of its middle, the smallest first."""
    axis = np.arange(-n_steps, n_steps + 1)
    offsets = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    # of equal scores the smallest motion wins
    return offsets[np.argsort(np.abs(offsets).sum(axis=1), kind="stable")]


def _rotation_about(centroid: NDArray[np.float64], motion: NDArray[np.float64]) -> SE2:
    """Return the rotation about `centroid`, followed by the translation."""
    moved = SE2(float(centroid[0] + motion[0]), float(centroid[1] + motion[1]), float(motion[2]))
    return moved @ SE2(-float(centroid[0]), -float(centroid[1]), 0.0)


def _score(
    field: NDArray[np.float64],
    frame: Grid,
    points: NDArray[np.float64],
    centroid: NDArray[np.float64],
    motion: NDArray[np.float64],
    width: float,
) -> float:
    """Return the mean of a Gaussian of `width` metres over the moved points' distances to the true walls."""
    from scipy import ndimage  # imported late: it takes half a second

    x, y = (
        _rotation_about(centroid, motion).apply(points) - (frame.origin_x, frame.origin_y)
    ).T / frame.resolution - 0.5
    distance = ndimage.map_coordinates(field, [y, x], order=1, mode="nearest")
    return float(np.mean(np.exp(-0.5 * (distance / width) ** 2)))


def _distances(truth: Grid, margin: float) -> tuple[NDArray[np.float64], Grid]:
    """Return the distances to the nearest occupied cell in m, on the plan with a margin around it."""
    from scipy import ndimage  # imported late: it takes half a second

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
    return grid.cells > OCCUPIED_THRESHOLD


def _near_occupied(grid: Grid) -> NDArray[np.bool_]:
    """Return the cells within TOLERANCE of an occupied one, on the grid padded by TOLERANCE on all sides."""
    from scipy import ndimage  # imported late: it takes half a second

    occupied = np.pad(_occupied(grid), TOLERANCE)
    if not occupied.any():
        return occupied
    return ndimage.distance_transform_cdt(~occupied, "chessboard") <= TOLERANCE


def _centres(grid: Grid, mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the centres (x, y) of the selected cells, (n, 2), metres."""
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
    """Return the mask (the grid padded by `padding` cells) at the points; False outside."""
    cells = np.floor((points - (grid.origin_x, grid.origin_y)) / grid.resolution).astype(np.int64) + padding
    column, row = cells.T
    inside = (row >= 0) & (row < mask.shape[0]) & (column >= 0) & (column < mask.shape[1])
    values = np.zeros(len(points), dtype=np.bool_)
    values[inside] = mask[row[inside], column[inside]]
    return values


def _mean(hits: NDArray[np.bool_]) -> float:
    return float(hits.mean()) if len(hits) else math.nan
