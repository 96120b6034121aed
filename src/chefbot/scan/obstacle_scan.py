"""Obstacle detection in depth images, at any height that the robot could hit.

A scan of one row misses table tops, seats and low boxes. Here every pixel is projected by the camera's height
and pitch and classified as floor, obstacle, or above the robot; each angular bin then gives its nearest
obstacle, the height interval in which it was seen, and the interval of visible free floor. A drop-off of the floor is
an obstacle below the floor.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta
from numba import njit
from numpy.typing import NDArray

from chefbot.errors import ScanError
from chefbot.robot.section import Mount
from chefbot.scan.camera import CameraModel, Depth
from chefbot.scan.drop_offs import PITCH_TOLERANCE, DropOffs, FloorLimits, find_drop_offs

Floats = NDArray[np.float32]
COLUMNS_PER_BIN = 2
"""Image columns per bin; with 2, no bin is empty up to a field of view of 130 degrees: tan(a) < 2 a."""
MAX_FLOOR_GAP = 0.1
MAX_FLOOR_GAP_ROWS = 4.0
"""Maximum gap in continuous floor: the next floor pixel is within 0.1 m plus four rows' distance of the last
one."""

OBSTACLE_DEPTH, OBSTACLE_DEPTH_GROWTH = 0.08, 0.008
"""Depth behind an obstacle's nearest return, m, and its growth per squared range, 1/m, within which returns
belong to the same obstacle: for its own shape, and four standard deviations of a structured-light camera's
noise."""
NEIGHBOUR_BINS = 2
"""Number of bins on each side that show the same obstacle if their ranges agree: an edge gives few pixels, at
random heights, and the rest of the obstacle is in the bins beside it."""
MIN_PIXEL_FRACTION = 0.4
"""Minimum fraction of the pixels between an obstacle's lowest and highest that must show it. An obstacle
nearer than the camera's minimum range shows in few scattered pixels only, whose heights do not give its
height."""


class ObstacleScanParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The parameters of the `ObstacleScanner`."""

    min_height: Annotated[
        float, Meta(ge=0.005, le=0.5, description="minimum height of an obstacle above the floor, m")
    ] = 0.03
    pitch_tolerance: Annotated[
        float,
        Meta(
            ge=0.0,
            le=0.2,
            description="maximum pitch of the camera when braking, rad; raises min_height with distance",
        ),
    ] = PITCH_TOLERANCE


class ObstaclePoints(NamedTuple):
    """The nearest obstacle and the free floor in each bin of `ObstacleScanner.angles`, float32.

    obstacles: distance of the nearest obstacle along the floor from the point below the camera, m; inf for
    none.
    clear_from, clear_to: interval of continuous free floor before the obstacle, m from the same point. The
    floor nearer than clear_from is outside the image and unknown. Without visible floor clear_from is inf and
    clear_to 0.
    bottom, top: heights above the floor between which the nearest obstacle was seen, m; inf and -inf for
    none. They are close together for a table top, and as far apart as the image reaches for a leg. With too
    few pixels they are 0 and the maximum height. Of a drop-off, bottom is negative and top 0; without floor
    before it, its edge is nearer than the image shows.
    lower_to: distance up to which the ground behind the edge of a drop-off is lower, m; 0 for other obstacles.
    """

    obstacles: Floats
    clear_from: Floats
    clear_to: Floats
    bottom: Floats
    top: Floats
    lower_to: Floats


@njit(cache=True, nogil=True)
def _project_row(
    depth: Depth,
    scale: float,
    limits: tuple[float, float],
    heights: tuple[float, float, float, float],
    slope: float,
    stretch: Floats,
    obstacle: Floats,
    ground: Floats,
    height: Floats,
) -> None:
    """Project one row of an image (w,) to distance along the floor and height above it, without branches.

    scale: m per unit of depth. limits: valid depths, m. heights: of the camera, floor tolerance, top of the
    robot, m, and growth of the tolerance per metre. slope: height per depth of the row. stretch (w,): distance
    along the floor per depth of each pixel. Fills obstacle and ground (w,) with the distance of pixels that show
    an obstacle or the floor, m, inf for others, and height (w,), m.
    """
    mount, floor, top, growth = heights
    nothing = np.float32(np.inf)
    for u in range(len(depth)):
        z = np.float32(depth[u]) * scale
        r = z * stretch[u]
        h = mount + z * slope
        tolerance = growth * r
        valid = (z >= limits[0]) & (z <= limits[1])
        above = h > floor + tolerance
        obstacle[u] = r if valid & above & (h < top + tolerance) else nothing
        ground[u] = r if valid & (not above) & (h > -floor - tolerance) else nothing
        height[u] = h


@njit(cache=True, nogil=True)
def _classify(
    depth: Depth,
    scale: float,
    limits: tuple[float, float],
    heights: tuple[float, float, float, float],
    slope: Floats,
    stretch: Floats,
    bins: NDArray[np.int16],
    row_gap: float,
    nearest: Floats,
    second: Floats,
    clear_from: Floats,
    clear_to: Floats,
) -> None:
    """Classify the pixels of an image (h, w) as floor or obstacle, from the lowest row up (nearest first).

    The obstacle is the second nearest pixel of a bin: a single one is often an artefact between two depths.

    scale, limits, heights: as in `_project_row`. slope (h,), stretch (h, w): likewise, of all rows. bins (h, w):
    bin of each pixel. row_gap: growth of the allowed floor gap per squared distance, 1/m. Fills nearest, second,
    clear_from and clear_to (bins,), m.
    """
    rows, columns = depth.shape
    obstacle, ground = np.empty(columns, np.float32), np.empty(columns, np.float32)
    height = np.empty(columns, np.float32)
    max_gap = np.float32(MAX_FLOOR_GAP)
    for above_lowest in range(rows):
        row = rows - 1 - above_lowest
        _project_row(depth[row], scale, limits, heights, slope[row], stretch[row], obstacle, ground, height)
        for u in range(columns):
            k = bins[row, u]
            # Obstacle: keep the two nearest pixels of the bin
            r = obstacle[u]
            if r < second[k]:
                second[k] = max(r, nearest[k])
                nearest[k] = min(r, nearest[k])
            # Floor: extend the continuous interval
            r = ground[u]
            if r < np.inf:
                start, end = clear_from[k], clear_to[k]
                continues = (end < r) & (r <= end + max_gap + row_gap * r * r)
                clear_to[k] = r if continues | (start == np.inf) else end
                clear_from[k] = min(start, r)


@njit(cache=True, nogil=True)
def _find_height_interval(
    depth: Depth,
    scale: float,
    limits: tuple[float, float],
    heights: tuple[float, float, float, float],
    slope: Floats,
    stretch: Floats,
    bins: NDArray[np.int16],
    max_distance: Floats,
    bottom: Floats,
    top: Floats,
    pixel_count: NDArray[np.int32],
) -> None:
    """Find the lowest and the highest pixel of each bin's obstacle, once its range is known.

    Arguments as in `_classify`; max_distance (bins,): distance up to which a pixel belongs to the bin's
    obstacle, m, 0 for none. bottom, top (bins,): heights above the floor, m, extended in place. pixel_count
    (bins,): number of pixels between them.
    """
    rows, columns = depth.shape
    obstacle, ground = np.empty(columns, np.float32), np.empty(columns, np.float32)
    height = np.empty(columns, np.float32)
    for row in range(rows):
        _project_row(depth[row], scale, limits, heights, slope[row], stretch[row], obstacle, ground, height)
        for u in range(columns):
            k = bins[row, u]
            # Pixels farther than the obstacle do not belong to it
            if obstacle[u] <= max_distance[k]:
                bottom[k] = min(bottom[k], height[u])
                top[k] = max(top[k], height[u])
                pixel_count[k] += 1


def _merge_neighbours(ranges: Floats, heights: Floats, extend: np.ufunc) -> Floats:
    """Return heights (bins,) extended by those of the neighbouring bins that show the same obstacle."""
    merged = heights.copy()
    for shift in range(1, NEIGHBOUR_BINS + 1):
        left, right = slice(None, -shift), slice(shift, None)
        with np.errstate(invalid="ignore"):  # inf - inf: neither shows anything
            same = (
                np.abs(ranges[left] - ranges[right])
                <= OBSTACLE_DEPTH + OBSTACLE_DEPTH_GROWTH * ranges[left] ** 2
            )
        extend(merged[left], heights[right], out=merged[left], where=same)
        extend(merged[right], heights[left], out=merged[right], where=same)
    return merged


class ObstacleScanner:
    """A detector of obstacles in the depth images of one camera.

    camera: its model. mount: its pose, of which z and pitch are used; positive pitch looks down. max_height:
    height above which an obstacle does not matter, m. floor: what still counts as floor. angles: (n,)
    float64 angles of the bins, rad, right to left, about the point on the floor below the camera, x forward.
    """

    def __init__(
        self,
        camera: CameraModel,
        mount: Mount,
        max_height: float,
        floor: FloorLimits,
        params: ObstacleScanParams,
    ) -> None:
        if max_height <= params.min_height:
            raise ScanError(f"max_height {max_height:g} m must be above min_height {params.min_height:g} m")
        self.camera = camera
        self._heights = (mount.z, params.min_height, max_height, params.pitch_tolerance)
        self._floor = tuple(np.float32(limit) for limit in (params.pitch_tolerance, *floor))
        self._row_gap = MAX_FLOOR_GAP_ROWS / (mount.z * camera.fy)
        across = (camera.cx - np.arange(camera.width)) / camera.fx
        down = (np.arange(camera.height) - camera.cy) / camera.fy
        ahead = math.cos(mount.pitch) - down * math.sin(mount.pitch)
        if ahead.min() <= 0.0:
            raise ScanError(
                f"camera pitch {mount.pitch:g} rad: part of the image looks back; mount it flatter"
            )
        self._slope = (-math.sin(mount.pitch) - down * math.cos(mount.pitch)).astype(np.float32)
        self._stretch = np.hypot(ahead[:, None], across[None, :]).astype(np.float32)
        self._set_bins(np.arctan2(across[None, :], ahead[:, None]))

    def _set_bins(self, angles: NDArray[np.float64]) -> None:
        """Set equal bins between the outermost angles of all pixels (h, w), rad."""
        count = max(1, self.camera.width // COLUMNS_PER_BIN)
        low, high = float(angles.min()), float(angles.max())
        self.angle_increment = (high - low) / count
        self.angles = low + self.angle_increment * (np.arange(count) + 0.5)
        self.angle_min, self.angle_max = float(self.angles[0]), float(self.angles[-1])
        indices = np.floor((angles - low) / self.angle_increment).astype(np.int16)
        self._bins = np.clip(indices, 0, count - 1).astype(np.int16)
        self._columns = np.bincount(self._bins.reshape(-1), minlength=count) / self.camera.height

    def scan(self, depth: Depth) -> ObstaclePoints:
        """Detect obstacles in an image (h, w) of uint16 mm or float32 m; raise ScanError for another size or
        type."""
        self.camera.check(depth)
        count = self.angles.size
        nearest, second = np.full(count, np.inf, np.float32), np.full(count, np.inf, np.float32)
        clear_from, clear_to = np.full(count, np.inf, np.float32), np.zeros(count, np.float32)
        bottom, top = np.full(count, np.inf, np.float32), np.full(count, -np.inf, np.float32)
        image = (
            depth,
            np.float32(0.001 if depth.dtype == np.uint16 else 1.0),
            (np.float32(self.camera.range_min), np.float32(self.camera.range_max)),
            tuple(np.float32(height) for height in self._heights),
            self._slope,
            self._stretch,
            self._bins,
        )
        # Nearest obstacle and free floor per bin
        _classify(*image, np.float32(self._row_gap), nearest, second, clear_from, clear_to)
        # Height interval of each obstacle, shared between neighbouring bins
        if np.isfinite(second).any():
            self._find_heights(image, second, bottom, top)
            bottom = _merge_neighbours(second, bottom, np.minimum)
            top = _merge_neighbours(second, top, np.maximum)
        drops = self._find_drop_offs(image, second)
        nearer = drops.edges < second
        second[nearer], bottom[nearer], top[nearer] = drops.edges[nearer], drops.bottom[nearer], 0.0
        clear_from[drops.blind] = np.inf
        lower_to = np.where(nearer, drops.ends, np.float32(0.0))
        # Floor behind an obstacle does not count
        hidden = clear_from >= second
        clear_from[hidden], clear_to[hidden] = np.inf, 0.0
        return ObstaclePoints(second, clear_from, np.minimum(clear_to, second), bottom, top, lower_to)

    def _find_drop_offs(self, image: tuple[Any, ...], obstacles: Floats) -> DropOffs:
        """Return the drop-offs before the obstacles (bins,), m."""
        depth, scale, limits, heights, slope, stretch, bins = image
        drops = DropOffs.none(len(obstacles))
        find_drop_offs(depth, scale, limits, heights[0], self._floor, slope, stretch, bins, obstacles, *drops)
        return drops

    def _find_heights(self, image: tuple[Any, ...], ranges: Floats, bottom: Floats, top: Floats) -> None:
        """Fill bottom and top (bins,), m; 0 and the maximum height where the pixels are too few."""
        found = np.isfinite(ranges)
        pixel_count = np.zeros(len(ranges), np.int32)
        max_distance = np.where(
            found, ranges + OBSTACLE_DEPTH + OBSTACLE_DEPTH_GROWTH * ranges**2, 0.0
        ).astype(np.float32)
        _find_height_interval(*image, max_distance, bottom, top, pixel_count)
        # Expected pixel rows of the height interval; too few pixels in it give no height
        rows = (top[found] - bottom[found]) * self.camera.fy / ranges[found] + 1.0
        sparse = np.flatnonzero(found)[pixel_count[found] < MIN_PIXEL_FRACTION * self._columns[found] * rows]
        bottom[sparse], top[sparse] = 0.0, self._heights[2]


def without_floor_gaps(
    ranges: Floats,
    angles: NDArray[np.floating[Any]],
    points: ObstaclePoints,
    bins: NDArray[np.floating[Any]],
) -> Floats:
    """Return ranges (n,) of a flat scan at angles (n,), rad, without those that pass over a drop-off: NaN.

    Such a beam measures a surface behind the drop-off, and would call the floor before it free. points: obstacle scan
    of the same image at the angles `bins`, rad.
    """
    is_drop = points.bottom < 0.0
    if not is_drop.any():
        return ranges
    nearest = np.rint((angles - bins[0]) / (bins[1] - bins[0])).astype(np.int64).clip(0, len(bins) - 1)
    passes_over = is_drop[nearest] & ~(ranges < points.obstacles[nearest])
    return np.where(passes_over, np.float32(np.nan), ranges)
