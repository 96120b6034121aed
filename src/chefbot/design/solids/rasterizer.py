"""Triangles to pixels with a depth buffer, in numpy: all triangles' rows at once, then all rows' pixels.

A triangle covers a pixel whose middle it contains (Pineda, A Parallel Algorithm for Polygon Rasterization,
SIGGRAPH 1988: three half-planes); here they are solved for the first and last pixel of each row.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

BATCH = 500_000
"""Rows or pixels of a batch; it bounds the memory."""
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class RasterizedView(NamedTuple):
    """For each pixel (h, w): depth (inf for none) and number of the nearest triangle (-1 for none)."""

    depth: NDArray[np.float32]
    triangle: NDArray[np.int32]


class _Rows(NamedTuple):
    """Pieces of triangles one pixel high: triangle, row, first column and how many columns long."""

    triangle: Ints
    row: Ints
    first: Ints
    long: Ints


def rasterize(corners: Floats, width: int, height: int) -> RasterizedView:
    """Return the view of corners (n, 3, 3): triangle, corner, (x, y, depth).

    Pixel (row i, column j) has its middle at (j+.5, i+.5); y is down and smaller depth is nearer. Triangles
    are drawn from the side where they are counter-clockwise.
    """
    depth = np.full(width * height, np.inf, np.float32)
    nearest = np.full(width * height, -1, np.int32)
    front = np.flatnonzero(_area(corners) < 0.0)
    corners = corners[front]
    for rows in _all_rows(corners, width, height):
        for piece in _batches(rows):
            _draw(corners, piece, width, depth, nearest)
    triangle = np.append(front, -1)[nearest].astype(np.int32)
    return RasterizedView(depth.reshape(height, width), triangle.reshape(height, width))


def _all_rows(corners: Floats, width: int, height: int) -> Iterator[_Rows]:
    """In groups of triangles."""
    low = np.clip(np.ceil(corners[:, :, 1].min(axis=1) - 0.5), 0, height).astype(np.int64)
    high = np.clip(np.ceil(corners[:, :, 1].max(axis=1) - 0.5), 0, height).astype(np.int64)
    heights = high - low
    for part in _groups(heights):
        triangle = np.repeat(np.arange(part.start, part.stop), heights[part])
        row = np.repeat(low[part], heights[part]) + _counting(heights[part])
        yield _spans(corners, triangle, row, width)


def _spans(corners: Floats, triangle: Ints, row: Ints, width: int) -> _Rows:
    """Where the middles of a row's pixels are inside all three edges."""
    first, last = np.zeros(len(row)), np.full(len(row), float(width))
    y = row + 0.5
    for i in range(3):
        a, b = corners[triangle, i, :2], corners[triangle, (i + 1) % 3, :2]
        slope = b[:, 1] - a[:, 1]  # of the half-plane's value along x
        with np.errstate(divide="ignore", invalid="ignore"):
            border = a[:, 0] + (b[:, 0] - a[:, 0]) * (y - a[:, 1]) / slope
        first = np.where(slope > 0, np.maximum(first, border), first)
        last = np.where(slope < 0, np.minimum(last, border), last)
    start = np.ceil(np.clip(first, 0, width) - 0.5).astype(np.int64)
    count = np.ceil(np.clip(last, 0, width) - 0.5).astype(np.int64) - start
    full = count > 0
    return _Rows(triangle[full], row[full], start[full], count[full])


def _draw(
    corners: Floats, rows: _Rows, width: int, depth: NDArray[np.float32], nearest: NDArray[np.int32]
) -> None:
    """Keep the nearest triangle; among equal depths, the last one."""
    triangle = np.repeat(rows.triangle, rows.long)
    column = np.repeat(rows.first, rows.long) + _counting(rows.long)
    row = np.repeat(rows.row, rows.long)
    z = _depth(corners, triangle, column + 0.5, row + 0.5).astype(np.float32)
    pixel = row * width + column
    np.minimum.at(depth, pixel, z)
    won = z == depth[pixel]
    nearest[pixel[won]] = triangle[won]


def _depth(corners: Floats, triangle: Ints, x: NDArray[Any], y: NDArray[Any]) -> Floats:
    """Depth of the triangle's plane, limited to the depths of its corners."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    dx = (u[:, 2] * v[:, 1] - v[:, 2] * u[:, 1]) / _area(corners)
    dy = (v[:, 2] * u[:, 0] - u[:, 2] * v[:, 0]) / _area(corners)
    plane = a[triangle, 2] + dx[triangle] * (x - a[triangle, 0]) + dy[triangle] * (y - a[triangle, 1])
    return np.clip(plane, corners[:, :, 2].min(axis=1)[triangle], corners[:, :, 2].max(axis=1)[triangle])


def _area(corners: Floats) -> Floats:
    """Twice the signed area, (n,)."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def _batches(rows: _Rows) -> Iterator[_Rows]:
    for part in _groups(rows.long):
        yield _Rows(*(column[part] for column in rows))


def _groups(sizes: Ints) -> Iterator[slice]:
    """Slices with a total of at most BATCH, or of a single larger item."""
    ends = np.cumsum(sizes)
    start = 0
    while start < len(sizes):
        done = ends[start] - sizes[start]
        stop = max(int(np.searchsorted(ends, done + BATCH, "right")), start + 1)
        yield slice(start, stop)
        start = stop


def _counting(counts: Ints) -> Ints:
    """Concatenation of 0, 1, ... n-1 for every n of counts."""
    starts = np.cumsum(counts) - counts
    return np.arange(int(counts.sum())) - np.repeat(starts, counts)
