"""Colour shading of a rendered depth image: light from above, fading with distance, a tiled floor."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.sim.cameras.depth_raycast import FLOOR, Depths, Floats, Numbers
from chefbot.sim.world.shapes import BOX, CAPSULE

LIGHT = (0.36, 0.25, 0.90)  # direction towards the light source, in the world frame
AMBIENT, DIFFUSE = 0.55, 0.45
FADE = 0.035  # 1/m
TILE = 0.5  # m
SKY = (188, 208, 226)


@njit(cache=True, nogil=True, error_model="numpy")
def shade(
    kind: NDArray[np.int8],
    centre: Floats,
    half: Floats,
    yaw: Floats,
    colour: NDArray[np.uint8],
    position: Floats,
    rotation: Floats,
    focal: float,
    depth: Depths,
    number: Numbers,
    picture: NDArray[np.uint8],
) -> None:
    """Fill picture (h, w, 3) from depth and shape numbers (h, w); the other arguments are as in `draw`."""
    rows, columns = depth.shape
    point = np.empty(3)
    for v in range(rows):
        y = (v - 0.5 * (rows - 1)) / focal
        for u in range(columns):
            x, t, i = (u - 0.5 * (columns - 1)) / focal, depth[v, u], number[v, u]
            for j in range(3):
                # World point of the pixel: p + t R (x, y, 1).
                point[j] = position[j] + t * (rotation[j, 0] * x + rotation[j, 1] * y + rotation[j, 2])
            if i >= 0:
                # Solid: Lambert shading, attenuated with distance.
                light = lambert(kind[i], centre[i], half[i], yaw[i], point) / (1.0 + FADE * t)
                for j in range(3):
                    picture[v, u, j] = min(255.0, light * colour[i, j])
            elif i == FLOOR:
                # Floor: checkerboard tiles.
                tile = (math.floor(point[0] / TILE) + math.floor(point[1] / TILE)) % 2
                light = (0.86 if tile else 0.94) / (1.0 + FADE * t)
                picture[v, u, 0], picture[v, u, 1], picture[v, u, 2] = 205 * light, 186 * light, 158 * light
            else:
                picture[v, u, 0], picture[v, u, 1], picture[v, u, 2] = SKY


@njit(cache=True, nogil=True, error_model="numpy")
def lambert(kind: int, centre: Floats, half: Floats, yaw: float, point: Floats) -> float:
    """Return the brightness of a surface point of a solid (Lambert's cosine law plus ambient light)."""
    dx, dy, dz = point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]
    if kind == BOX:
        # Box: face normal in the box frame, rotated to the world.
        c, s = math.cos(yaw), math.sin(yaw)
        nx, ny, nz = box_normal(half, c * dx + s * dy, -s * dx + c * dy, dz)
        nx, ny = c * nx - s * ny, s * nx + c * ny
    else:
        # Cylinder and capsule: radial normal; vertical on a cylinder's caps.
        nx, ny, nz = dx, dy, 0.0
        if kind == CAPSULE:
            nz = dz - min(max(dz, -half[2]), half[2])
        elif abs(dz) > half[2] - 1e-4:
            nx, ny, nz = 0.0, 0.0, dz
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / length, ny / length, nz / length
    return AMBIENT + DIFFUSE * (0.5 + 0.5 * (nx * LIGHT[0] + ny * LIGHT[1] + nz * LIGHT[2]))


@njit(cache=True, nogil=True, error_model="numpy")
def box_normal(half: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return the outward normal of the face nearest to a point on a box, in the box frame."""
    ax, ay, az = half[0] - abs(x), half[1] - abs(y), half[2] - abs(z)
    if ax <= ay and ax <= az:
        return math.copysign(1.0, x), 0.0, 0.0
    if ay <= az:
        return 0.0, math.copysign(1.0, y), 0.0
    return 0.0, 0.0, math.copysign(1.0, z)
