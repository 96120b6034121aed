"""Ranges in any directions as those of the evenly spaced beams of a planar scan."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FULL_TURN = 2.0 * math.pi
GAP = 1.5
"""Angle without a sample from which a beam has no range, as a multiple of the larger of the angle between beams and
that between samples."""


def beams_of(
    bearings: NDArray[np.float64], ranges: NDArray[np.float64], start: float, step: float, count: int
) -> NDArray[np.float32]:
    """Return the range of each of `count` beams (count,), m, in the directions start, start + step, ..., rad.

    bearings, ranges: (n,) rad and m, in any order; NaN: not measured. A beam has the shortest range of the samples
    whose nearest beam it is, without one that of the nearest sample, and NaN if there is none near it.
    """
    if not len(bearings):
        return np.full(count, math.nan, np.float32)
    at = np.mod((bearings - start) * math.copysign(1.0, step), FULL_TURN) / abs(step)
    turn = FULL_TURN / abs(step)
    nearest = np.rint(at)
    at, nearest = np.where(nearest >= turn - 0.5, at - turn, at), nearest.astype(np.int64)
    nearest[nearest >= turn - 0.5] = 0
    measured = (nearest < count) & ~np.isnan(ranges)
    found = np.full(count, math.nan)
    np.fmin.at(found, nearest[measured], ranges[measured])
    gap = GAP * max(1.0, turn / len(bearings)) / 2.0
    empty = np.flatnonzero(np.isnan(found))
    if len(empty):
        found[empty] = _nearest(at, ranges, empty, turn, gap)
    return found.astype(np.float32)


def _nearest(
    at: NDArray[np.float64], ranges: NDArray[np.float64], beams: NDArray[np.int64], turn: float, gap: float
) -> NDArray[np.float64]:
    """Return the range (m,) of the sample nearest to each beam (m,), NaN if it is farther than `gap` beams."""
    order = np.argsort(at, kind="stable")
    around = np.concatenate(([at[order[-1]] - turn], at[order], [at[order[0]] + turn]))
    values = ranges[np.concatenate((order[-1:], order, order[:1]))]
    after = np.searchsorted(around, beams).clip(1, len(around) - 1)
    chosen = np.where(beams - around[after - 1] <= around[after] - beams, after - 1, after)
    near: NDArray[np.float64] = np.where(np.abs(around[chosen] - beams) <= gap, values[chosen], math.nan)
    return near
