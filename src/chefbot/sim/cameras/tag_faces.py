"""AprilTags on the walls of a simulated building, drawn into the pictures of its cameras."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.buildings.world_file import WallTag
from chefbot.sim.cameras.depth_raycast import Depths, Floats
from chefbot.tags.family import tag_image

SUBPIXELS = 8
"""Rays across a pixel, and as many down it: edges become as soft as those of a real camera."""
ON_FACE = 0.005
"""Distance along the optical axis up to which a depth is that of the tag, m; its board is 3 mm thick."""
NEAR = 0.02
"""Depth of a corner below which its pixel is far outside the picture, m."""


class TagFace(NamedTuple):
    """The front of a tag.

    squares: (n, n) brightness from above, left first as its viewer sees it, with the white border. centre: (3,) m.
    yaw: direction that it faces, rad. half: half of its side, m.
    """

    squares: NDArray[np.uint8]
    centre: NDArray[np.float64]
    yaw: float
    half: float


@lru_cache(maxsize=4)  # for every picture
def tag_faces(tags: tuple[WallTag, ...]) -> tuple[TagFace, ...]:
    """Return the fronts of a world's tags. UserError if OpenCV is not installed."""
    return tuple(_face(tag) for tag in tags)


def _face(tag: WallTag) -> TagFace:
    squares = np.pad(tag_image(tag.family, tag.id), 1, constant_values=255)
    return TagFace(squares, np.array([tag.x, tag.y, tag.z]), tag.yaw, tag.board_size / 2.0)


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tag(
    squares: NDArray[np.uint8],
    centre: Floats,
    yaw: float,
    half: float,
    position: Floats,
    rotation: Floats,
    focal: float,
    depth: Depths,
    picture: NDArray[np.uint8],
) -> None:
    """Draw a tag over the pixels of picture (h, w, 3) whose depth (h, w) is that of its front; see `draw`."""
    rows, columns = depth.shape
    n = len(squares)
    c, s = math.cos(yaw), math.sin(yaw)
    # Distance of the camera before the front, which faces along (c, s, 0).
    before = c * (position[0] - centre[0]) + s * (position[1] - centre[1])
    if before <= 0.0:
        return
    low_u, high_u, low_v, high_v = _window(centre, (c, s), half, position, rotation, focal, (rows, columns))
    for v in range(low_v, high_v):
        for u in range(low_u, high_u):
            light, rays = 0.0, 0
            for k in range(SUBPIXELS * SUBPIXELS):
                # Ray of a part of the pixel, scaled to depth 1 along the optical axis.
                du = (k % SUBPIXELS + 0.5) / SUBPIXELS - 0.5
                dv = (k // SUBPIXELS + 0.5) / SUBPIXELS - 0.5
                x = (u + du - 0.5 * (columns - 1)) / focal
                y = (v + dv - 0.5 * (rows - 1)) / focal
                rx = rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2]
                ry = rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2]
                approach = -(c * rx + s * ry)
                if approach <= 0.0:
                    break
                # Depth at which it meets the plane of the front.
                t = before / approach
                if abs(t - depth[v, u]) > ON_FACE + 0.02 * t:
                    break
                # Point of the front: to the right as its viewer sees it, and down.
                right = -s * (position[0] + t * rx - centre[0]) + c * (position[1] + t * ry - centre[1])
                rz = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2]
                down = centre[2] - position[2] - t * rz
                column = math.floor((right + half) / (2.0 * half) * n)
                row = math.floor((down + half) / (2.0 * half) * n)
                if 0 <= column < n and 0 <= row < n:
                    light += squares[row, column]
                    rays += 1
            if rays == SUBPIXELS * SUBPIXELS:
                # Brightness as of the other solids: a little dark, and never quite black.
                grey = 25.0 + 0.8 * light / rays
                picture[v, u, 0], picture[v, u, 1], picture[v, u, 2] = grey, grey, grey


@njit(cache=True, nogil=True, error_model="numpy")
def _window(
    centre: Floats,
    facing: tuple[float, float],
    half: float,
    position: Floats,
    rotation: Floats,
    focal: float,
    size: tuple[int, int],
) -> tuple[int, int, int, int]:
    """Return the columns and rows, from and to, in which the front of a tag may be seen; size: rows and columns."""
    rows, columns = size
    low_u, high_u, low_v, high_v = columns, 0, rows, 0
    point = np.empty(3)
    for k in range(4):
        # Corner of the board relative to the camera, and in its optical frame: R^T d.
        right, up = (half if k & 1 else -half), (half if k & 2 else -half)
        point[0] = centre[0] - facing[1] * right - position[0]
        point[1] = centre[1] + facing[0] * right - position[1]
        point[2] = centre[2] + up - position[2]
        x = rotation[0, 0] * point[0] + rotation[1, 0] * point[1] + rotation[2, 0] * point[2]
        y = rotation[0, 1] * point[0] + rotation[1, 1] * point[1] + rotation[2, 1] * point[2]
        z = rotation[0, 2] * point[0] + rotation[1, 2] * point[1] + rotation[2, 2] * point[2]
        if z < NEAR:
            return 0, columns, 0, rows  # it reaches beside or behind the camera
        u, v = focal * x / z + 0.5 * (columns - 1), focal * y / z + 0.5 * (rows - 1)
        low_u, high_u = min(low_u, math.floor(u)), max(high_u, math.ceil(u) + 1)
        low_v, high_v = min(low_v, math.floor(v)), max(high_v, math.ceil(v) + 1)
    return max(low_u, 0), min(high_u, columns), max(low_v, 0), min(high_v, rows)
