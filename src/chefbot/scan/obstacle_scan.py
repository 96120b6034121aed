"""What stands on the floor before a depth camera, at any height the robot could hit.

A scan of one row misses table tops, seats and low boxes. Here every pixel is placed in space by the camera's
height and pitch and counted as floor, obstacle, or out of the robot's way (above it); each sector of angle
then tells its nearest obstacle, between which heights it was seen there, and where its floor was seen bare.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta
from numba import njit
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.robot.section import Mount
from chefbot.scan.camera import CameraModel, Depth

COLUMNS_PER_BIN = 2
"""Then every bin holds a column up to a field of view of 130 degrees: tan(a) < 2 a."""
GAP = 0.1
GAP_ROWS = 4.0
"""Floor counts as seen on if the next floor pixel is within 0.1 m and four rows' distance of the last one."""

DEPTH, SPREAD = 0.08, 0.008
"""Metres, and metres per square metre of range, behind an obstacle's nearest return within which other returns are of
the same obstacle: its own shape, and four standard deviations of a structured-light camera's noise."""
NEIGHBOURS = 2
"""Bins beside a bin that show the same obstacle where their ranges agree: an edge gives few pixels, at chance
heights, and the whole of it stands beside them."""
DENSE = 0.4
"""Share of the pixels between an obstacle's lowest and highest that must show it. Of what is nearer than the camera
measures only a sliver shows, in scattered pixels; that these are low says nothing of its height."""


class ObstacleScanParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of `ObstacleScanner`."""

    min_height: Annotated[
        float, Meta(ge=0.005, le=0.5, description="what rises less than this above the floor is floor, m")
    ] = 0.03
    pitch_tolerance: Annotated[
        float,
        Meta(
            ge=0.0,
            le=0.2,
            description="the camera may nod by this when braking; raises min_height with distance, rad",
        ),
    ] = 0.0175


class ObstacleScan(NamedTuple):
    """Per bin of `ObstacleScanner.angles`, float32 metres along the floor from the camera's foot.

    obstacles: nearest obstacle; inf for none within range.
    clear_from, clear_to: the stretch of bare floor seen without a break, ending before the obstacle. Nothing
    is known of the floor nearer than clear_from, which the image does not show. Without floor in sight
    clear_from is inf and clear_to 0.
    bottom, top: metres above the floor between which the nearest obstacle was seen; inf and -inf for none. A table
    top has both close together, a leg has them as far apart as the image reaches. Where too few pixels show it
    to tell they are 0 and the greatest height.
    """

    obstacles: NDArray[np.float32]
    clear_from: NDArray[np.float32]
    clear_to: NDArray[np.float32]
    bottom: NDArray[np.float32]
    top: NDArray[np.float32]


@njit(cache=True, nogil=True)
def _classify(
    depth: Depth,
    scale: float,
    limits: tuple[float, float],
    heights: tuple[float, float, float, float],
    slope: NDArray[np.float32],
    stretch: NDArray[np.float32],
    bins: NDArray[np.int16],
    row_gap: float,
    nearest: NDArray[np.float32],
    second: NDArray[np.float32],
    clear_from: NDArray[np.float32],
    clear_to: NDArray[np.float32],
) -> None:
    """One pass over the image (h, w) from the lowest row up, so that the floor comes by nearest first.

    The obstacle is the second nearest pixel of a bin: a lone one is often the smear between two depths.

    heights: of the camera, floor's tolerance, robot's top, growth of tolerance per metre. slope: rise per
    depth of each row. stretch: distance along the floor per depth of each pixel.
    """
    mount, floor, top, growth = heights
    for row in range(depth.shape[0] - 1, -1, -1):
        for u in range(depth.shape[1]):
            z = depth[row, u] * scale
            if not limits[0] <= z <= limits[1]:
                continue
            r = np.float32(z * stretch[row, u])
            height = mount + z * slope[row]
            slack = growth * r
            k = bins[row, u]
            if height > floor + slack:
                if height < top + slack and r < second[k]:
                    second[k] = max(r, nearest[k])
                    nearest[k] = min(r, nearest[k])
            elif height > -floor - slack:
                if clear_from[k] == np.inf:
                    clear_from[k] = r
                    clear_to[k] = r
                elif clear_to[k] < r <= clear_to[k] + GAP + row_gap * r * r:
                    clear_to[k] = r
                elif r < clear_from[k]:
                    clear_from[k] = r


@njit(cache=True, nogil=True)
def _extend(
    depth: Depth,
    scale: float,
    limits: tuple[float, float],
    heights: tuple[float, float, float, float],
    slope: NDArray[np.float32],
    stretch: NDArray[np.float32],
    bins: NDArray[np.int16],
    deepest: NDArray[np.float32],
    bottom: NDArray[np.float32],
    top: NDArray[np.float32],
    shown: NDArray[np.int32],
) -> None:
    """The lowest and the highest pixel of each bin's obstacle, once its range is known.

    Arguments as of `_classify`; deepest: (bins,) metres from the camera's foot up to which a pixel shows the bin's
    obstacle, 0 where there is none. bottom, top: (bins,) metres above the floor, widened in place. shown: (bins,)
    how many pixels lie between them.
    """
    mount, floor, robot_top, growth = heights
    for row in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            z = depth[row, u] * scale
            k = bins[row, u]
            # only what is no farther than the obstacle can belong to it
            if not limits[0] <= z <= min(limits[1], deepest[k]):
                continue
            r = np.float32(z * stretch[row, u])
            if r > deepest[k]:
                continue
            # neither floor nor above the robot
            height = np.float32(mount + z * slope[row])
            slack = growth * r
            if floor + slack < height < robot_top + slack:
                bottom[k] = min(bottom[k], height)
                top[k] = max(top[k], height)
                shown[k] += 1


def _with_neighbours(
    ranges: NDArray[np.float32], heights: NDArray[np.float32], widen: np.ufunc
) -> NDArray[np.float32]:
    """Heights (bins,) widened by those of the bins beside that show the same obstacle."""
    wider = heights.copy()
    for shift in range(1, NEIGHBOURS + 1):
        left, right = slice(None, -shift), slice(shift, None)
        with np.errstate(invalid="ignore"):  # inf - inf: neither shows anything
            same = np.abs(ranges[left] - ranges[right]) <= DEPTH + SPREAD * ranges[left] ** 2
        widen(wider[left], heights[right], out=wider[left], where=same)
        widen(wider[right], heights[left], out=wider[right], where=same)
    return wider


class ObstacleScanner:
    """Finds obstacles in depth images of one camera.

    camera, mount: of the camera (its z and pitch count; positive pitch looks down). max_height: metres, what
    is higher is out of the robot's way. angles: (n,) float64 radians, right to left, about the camera's foot
    on the floor, x forward.
    """

    def __init__(
        self, camera: CameraModel, mount: Mount, max_height: float, params: ObstacleScanParams
    ) -> None:
        if max_height <= params.min_height:
            raise UserError(f"max_height {max_height:g} m must be above min_height {params.min_height:g} m")
        self.camera = camera
        self._heights = (mount.z, params.min_height, max_height, params.pitch_tolerance)
        self._row_gap = GAP_ROWS / (mount.z * camera.fy)
        across = (camera.cx - np.arange(camera.width)) / camera.fx
        down = (np.arange(camera.height) - camera.cy) / camera.fy
        ahead = math.cos(mount.pitch) - down * math.sin(mount.pitch)
        if ahead.min() <= 0.0:
            raise UserError(
                f"camera pitch {mount.pitch:g} rad: part of the image looks back; mount it flatter"
            )
        self._slope = (-math.sin(mount.pitch) - down * math.cos(mount.pitch)).astype(np.float32)
        self._stretch = np.hypot(ahead[:, None], across[None, :]).astype(np.float32)
        self._set_bins(np.arctan2(across[None, :], ahead[:, None]))

    def _set_bins(self, angles: NDArray[np.float64]) -> None:
        """Equal bins between the outermost angles of all pixels (h, w)."""
        count = max(1, self.camera.width // COLUMNS_PER_BIN)
        low, high = float(angles.min()), float(angles.max())
        self.angle_increment = (high - low) / count
        self.angles = low + self.angle_increment * (np.arange(count) + 0.5)
        self.angle_min, self.angle_max = float(self.angles[0]), float(self.angles[-1])
        numbers = np.floor((angles - low) / self.angle_increment).astype(np.int16)
        self._bins = np.clip(numbers, 0, count - 1).astype(np.int16)
        self._columns = np.bincount(self._bins.reshape(-1), minlength=count) / self.camera.height

    def scan(self, depth: Depth) -> ObstacleScan:
        """Of an image (h, w) of uint16 mm or float32 m; UserError for another size or type."""
        self.camera.check(depth)
        count = self.angles.size
        nearest, second = np.full(count, np.inf, np.float32), np.full(count, np.inf, np.float32)
        clear_from, clear_to = np.full(count, np.inf, np.float32), np.zeros(count, np.float32)
        bottom, top = np.full(count, np.inf, np.float32), np.full(count, -np.inf, np.float32)
        image = (
            depth,
            0.001 if depth.dtype == np.uint16 else 1.0,
            (self.camera.range_min, self.camera.range_max),
            self._heights,
            self._slope,
            self._stretch,
            self._bins,
        )
        _classify(*image, self._row_gap, nearest, second, clear_from, clear_to)
        if np.isfinite(second).any():
            self._find_heights(image, second, bottom, top)
            bottom = _with_neighbours(second, bottom, np.minimum)
            top = _with_neighbours(second, top, np.maximum)
        hidden = clear_from >= second
        clear_from[hidden], clear_to[hidden] = np.inf, 0.0
        return ObstacleScan(second, clear_from, np.minimum(clear_to, second), bottom, top)

    def _find_heights(
        self,
        image: tuple[Any, ...],
        ranges: NDArray[np.float32],
        bottom: NDArray[np.float32],
        top: NDArray[np.float32],
    ) -> None:
        """Fill bottom and top, (bins,); all that the robot could hit where the pixels are too few to tell."""
        found = np.isfinite(ranges)
        shown = np.zeros(len(ranges), np.int32)
        deepest = np.where(found, ranges + DEPTH + SPREAD * ranges**2, 0.0).astype(np.float32)
        _extend(*image, deepest, bottom, top, shown)
        rows = (top[found] - bottom[found]) * self.camera.fy / ranges[found] + 1.0
        sparse = np.flatnonzero(found)[shown[found] < DENSE * self._columns[found] * rows]
        bottom[sparse], top[sparse] = 0.0, self._heights[2]
