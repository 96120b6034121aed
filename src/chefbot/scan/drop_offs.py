"""Detection of drop-offs in depth images: steps down, stairs and holes, from a depth of 3 cm on.

From the lowest row up, each angular bin follows the floor along its rays. A ray that passes the last point of
the floor and meets nothing as high as a permitted slope from there on shows a drop-off. The comparison with the
floor just before the edge, instead of with the height 0, makes the test independent of the camera's pitch; it
allows for ramps up to the robot's maximum slope. What limits it is the distance of the rows on the floor, which
grows with the square of the distance: see `drop_range`.

A bin in which even the nearest visible floor is too low has its edge in the blind zone between robot and image.
The bottom must be within the camera's range: where nothing at all is measured, the floor is unknown but no
drop-off, as dark carpets and people who stand too near show nothing either.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.robot.sensors import DepthCamera
from chefbot.robot.spec import Robot
from chefbot.scan.camera import Depth

Floats = NDArray[np.float32]

DROP_HEIGHT = 0.03
"""Minimum depth of a drop-off, m: a wheel of the Chefbot that goes over it does not come back up."""
PITCH_TOLERANCE = 0.0175
"""Maximum pitch of the camera when braking, by default, rad."""
STEP_FRACTION = 2.0 / 3.0
"""Fraction of that depth from which a step down counts, relative to the floor before it; the rest is for noise."""
MIN_STEP = STEP_FRACTION * DROP_HEIGHT
UNSEEN_FRACTION = 0.5
"""Fraction of that depth from which the nearest visible floor counts as lower than the robot's own floor."""
MIN_ROWS = 2
"""Number of image rows of one bin that must show a drop-off: a single one is often an artefact."""
GRADIENT_BASE = 0.15
"""Length of floor, m, over which the gradient of the nearest visible floor is measured."""
MIN_RAY_MARGIN = 0.01
"""Minimum gradient of a ray beyond the steepest ramp's; flatter rays may run along a ramp."""
NOISE_DEVIATIONS = 3.0
"""Number of standard deviations of a measured height by which a drop-off must exceed its threshold."""


def slope_limit(robot: Robot, pitch_tolerance: float) -> float:
    """Return the gradient of the steepest floor that is not a drop-off, for a camera pitched by up to the tolerance,
    rad."""
    return math.tan(robot.drive.max_slope) + pitch_tolerance


def drop_range(robot: Robot, pitch_tolerance: float = PITCH_TOLERANCE) -> float:
    """Return the distance along the floor, m, from the point below the camera, up to which it detects DROP_HEIGHT.

    0 without a depth camera. Beyond, the next row of the image meets the floor so far behind that a ramp could lead
    there, or the noise of the height exceeds the margin of the threshold. The camera may pitch up or down.
    """
    camera = robot.sensors.depth_camera
    if camera is None:
        return 0.0
    slope = slope_limit(robot, pitch_tolerance) + pitch_tolerance
    distance = np.arange(0.1, camera.range_max, 0.01)
    fits = _ramp_behind(camera, distance, slope) + _noise_margin(camera) * distance <= (
        DROP_HEIGHT * (1.0 - STEP_FRACTION)
    )
    return float(distance[np.argmin(fits)]) if not fits.all() else camera.range_max


def _ramp_behind(camera: DepthCamera, distance: NDArray[np.float64], slope: float) -> NDArray[np.float64]:
    """Return by how much a ramp falls between a point of the floor and the next row of the image, m."""
    height = camera.mount.z
    ray = height / distance
    row = (distance**2 + height**2) / (height * camera.focal_length_px)
    # a ramp meets the next ray farther away than a level floor does
    return np.where(ray > slope + MIN_RAY_MARGIN, slope * row * ray / np.maximum(ray - slope, 1e-9), np.inf)


def _noise_margin(camera: DepthCamera) -> float:
    """Return the margin for the noise of the floor's height, m per metre of distance."""
    return NOISE_DEVIATIONS * camera.noise * camera.mount.z


class FloorLimits(NamedTuple):
    """What still counts as floor.

    steepest: gradient of the steepest ramp. front: distance from the point below the camera to the robot's front, m.
    noise: margin for the noise of a height, m per metre of distance.
    """

    steepest: float
    front: float
    noise: float

    @staticmethod
    def of(robot: Robot, camera: DepthCamera, pitch_tolerance: float) -> FloorLimits:
        """Return the limits for a robot's depth camera that pitches by up to the tolerance, rad."""
        return FloorLimits(
            slope_limit(robot, pitch_tolerance),
            max(robot.footprint.front - camera.mount.x, 0.0),
            _noise_margin(camera),
        )


class DropOffs(NamedTuple):
    """The nearest drop-off in each bin, (bins,).

    edges: distance along the floor from the point below the camera, m, inf for none: where the first ray beyond
    the edge passes the height of the floor. bottom: lowest point seen there, m, inf for none. blind: whether no
    floor was seen before it. ends: distance up to which lower ground was seen behind the edge, m, 0 for none.
    """

    edges: Floats
    bottom: Floats
    blind: NDArray[np.bool_]
    ends: Floats

    @staticmethod
    def none(bins: int) -> DropOffs:
        """Return no drop-off in any bin."""
        edges, bottom = np.full((2, bins), np.inf, np.float32)
        return DropOffs(edges, bottom, np.zeros(bins, np.bool_), np.zeros(bins, np.float32))


@njit(cache=True, nogil=True)
def _row_means(
    depth: Depth,
    scale: float,
    limits: tuple[float, float],
    mount_z: float,
    slope: float,
    stretch: Floats,
    bins: NDArray[np.int16],
    obstacles: Floats,
    unsure: float,
    distance: NDArray[np.float64],
    height: NDArray[np.float64],
    pixels: NDArray[np.int32],
) -> None:
    """Fill distance and height (bins,) with the means of a row's pixels of the floor, m.

    These are the pixels before the obstacle of their bin, and those below the floor whose ray passes the height of
    the floor before it: the far side of a hole that ends at a wall. depth, stretch, bins: (w,) of the row. unsure:
    the uncertainty of a height, m per metre of distance. pixels (bins,): number of these pixels.
    """
    distance[:], height[:], pixels[:] = 0.0, 0.0, 0
    for u in range(len(depth)):
        z = depth[u] * scale
        if not limits[0] <= z <= limits[1]:
            continue
        k = bins[u]
        r = z * stretch[u]
        h = mount_z + z * slope
        is_below = h < -UNSEEN_FRACTION * DROP_HEIGHT - unsure * r
        if r < obstacles[k] or (is_below and r * mount_z / (mount_z - h) < obstacles[k]):
            distance[k] += r
            height[k] += h
            pixels[k] += 1
    for k in range(len(pixels)):
        if pixels[k] > 0:
            distance[k] /= pixels[k]
            height[k] /= pixels[k]


@njit(cache=True, nogil=True)
def _lowest_ramp(mount_z: float, ray: float, steepest: float, floor_r: float, floor_h: float) -> float:
    """Return the height, m, at which a ray of gradient `ray` meets the steepest ramp down from a floor point."""
    at = (mount_z - floor_h - steepest * floor_r) / (ray - steepest)
    return min(mount_z - ray * at, floor_h)


@njit(cache=True, nogil=True)
def _is_ramp(
    floor: tuple[float, float, float, float], first_r: float, first_h: float, r: float, h: float
) -> bool:
    """Return whether the floor from one point to another, (distance, height) in m, continues to the robot's front.

    Then it is a ramp that begins in the blind zone, at the front or beyond.
    """
    tolerance, steepest, front, noise = floor
    gradient = (h - first_h) / (r - first_r)
    at_front = first_h - gradient * (first_r - front)
    lowest = -UNSEEN_FRACTION * DROP_HEIGHT - (tolerance + noise) * first_r
    return gradient >= -steepest - noise * r / GRADIENT_BASE and at_front >= lowest


class FloorProfile(NamedTuple):
    """What the rows so far show of the floor in each bin, (bins,), lengths in m.

    seen: whether floor was seen. floor_r, floor_h: distance and height of its last point, at first under the robot's
    front. lower: number of rows below it since then. first_r, first_h: the first of them. found: whether they are a
    drop-off. ended: whether floor was seen behind that.
    """

    seen: NDArray[np.bool_]
    floor_r: NDArray[np.float64]
    floor_h: NDArray[np.float64]
    lower: NDArray[np.int32]
    first_r: NDArray[np.float64]
    first_h: NDArray[np.float64]
    found: NDArray[np.bool_]
    ended: NDArray[np.bool_]


@njit(cache=True, nogil=True)
def _add_row(
    profile: FloorProfile,
    distance: NDArray[np.float64],
    height: NDArray[np.float64],
    pixels: NDArray[np.int32],
    mount_z: float,
    floor: tuple[float, float, float, float],
    edges: Floats,
    bottom: Floats,
    ends: Floats,
) -> None:
    """Add a row's points, (bins,), to the profile; arguments as of `_row_means` and `find_drop_offs`."""
    # all bins in one call: passing the arrays takes longer than the work on a bin
    seen, floor_r, floor_h, lower, first_r, first_h, found, ended = profile
    tolerance, steepest, _, noise = floor
    for k in range(len(edges)):
        if ended[k] or pixels[k] == 0:
            continue
        r, h = distance[k], height[k]
        if found[k]:
            # behind the edge: the ground is lower up to the next floor at the height of that before the edge
            level = (floor_h[k] if seen[k] else 0.0) - MIN_STEP - (tolerance + noise) * r
            ended[k] = h >= level
            ends[k] = ends[k] if ended[k] else max(ends[k], r)
            continue
        ray = (mount_z - h) / r
        if ray <= steepest + MIN_RAY_MARGIN:
            continue
        lowest = -UNSEEN_FRACTION * DROP_HEIGHT - tolerance * r
        if seen[k]:
            lowest = _lowest_ramp(mount_z, ray, steepest, floor_r[k], floor_h[k]) - MIN_STEP
        is_floor = is_level = h >= lowest - noise * r
        if not is_floor:
            if lower[k] == 0:
                first_r[k], first_h[k], bottom[k] = r, h, h
                edges[k] = (mount_z - (floor_h[k] if seen[k] else 0.0)) / ray
            lower[k] += 1
            ends[k] = r
            bottom[k] = min(bottom[k], h)
            if seen[k]:
                found[k] = lower[k] >= MIN_ROWS
            elif r - first_r[k] >= GRADIENT_BASE:
                is_floor = _is_ramp(floor, first_r[k], first_h[k], r, h)
                found[k] = not is_floor
        if is_level and not seen[k] and lower[k] >= MIN_ROWS:
            found[k] = ended[k] = True  # floor at the robot's height behind a hole
        elif is_floor:
            # The floor rises by no more than the pitch of the camera: behind a doorstep it is not lower
            floor_h[k] = min(h, floor_h[k] + tolerance * max(r - floor_r[k], 0.0)) if seen[k] else h
            floor_r[k], seen[k], lower[k] = max(r, floor_r[k]), True, 0


@njit(cache=True, nogil=True)
def _complete(
    found: NDArray[np.bool_],
    seen: NDArray[np.bool_],
    lower: NDArray[np.int32],
    edges: Floats,
    bottom: Floats,
    blind: NDArray[np.bool_],
    ends: Floats,
) -> None:
    """Fill blind (bins,), and remove the other results of the bins where no drop-off was found.

    A drop-off that a single bin shows, and none beside it, is an artefact: the edge of a door post may look so.
    """
    for k in range(len(edges)):
        # A strip of lower floor too short for a gradient is a drop-off as well
        found[k] = found[k] or (not seen[k] and lower[k] >= MIN_ROWS)
    for k in range(len(edges)):
        beside = (k > 0 and found[k - 1]) or (k + 1 < len(edges) and found[k + 1])
        blind[k] = found[k] and beside and not seen[k]
        if not (found[k] and beside):
            edges[k], bottom[k], ends[k] = np.inf, np.inf, 0.0


@njit(cache=True, nogil=True)
def find_drop_offs(
    depth: Depth,
    scale: float,
    limits: tuple[float, float],
    mount_z: float,
    floor: tuple[float, float, float, float],
    slope: Floats,
    stretch: Floats,
    bins: NDArray[np.int16],
    obstacles: Floats,
    edges: Floats,
    bottom: Floats,
    blind: NDArray[np.bool_],
    ends: Floats,
) -> None:
    """Find the nearest drop-off of each bin in an image (h, w), from the lowest row up.

    scale: m per unit of depth. limits: valid depths, m. mount_z: height of the camera, m. floor: its pitch tolerance,
    rad, and the `FloorLimits`. slope (h,), stretch (h, w): height, and distance along the floor, per depth. bins
    (h, w): bin of each pixel. obstacles (bins,): distance of the nearest obstacle, m, behind which nothing is
    searched. edges, bottom, blind, ends (bins,): filled, see `DropOffs`.
    """
    count = len(edges)
    distance, height, pixels = np.zeros(count), np.zeros(count), np.zeros(count, np.int32)
    profile = FloorProfile(
        np.zeros(count, np.bool_),
        np.full(count, floor[2]),
        np.zeros(count),
        np.zeros(count, np.int32),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count, np.bool_),
        np.zeros(count, np.bool_),
    )
    for row in range(len(slope) - 1, -1, -1):
        if slope[row] >= 0.0:
            break
        image_row = depth[row], scale, limits, mount_z, slope[row], stretch[row], bins[row]
        _row_means(*image_row, obstacles, floor[0] + floor[3], distance, height, pixels)
        _add_row(profile, distance, height, pixels, mount_z, floor, edges, bottom, ends)
    _complete(profile.found, profile.seen, profile.lower, edges, bottom, blind, ends)
