"""Kernels that draw solids into a depth image: exact intersection of each pixel's ray, nearest solid wins.

Rays are scaled so that their third component in the optical frame (z forward, x right, y down) is 1: then a
ray's parameter is the depth along the optical axis. Solids are drawn front to back, each only within the
rectangle of pixels that it can cover (z-buffer: Foley et al., Computer Graphics, 15.4; slabs: Kay & Kajiya,
Ray tracing complex scenes, 1986).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.sim.world.shapes import BOX, CAPSULE, CYLINDER

NEAR = 0.01
"""Metres before the lens at which the world begins."""
NOTHING, FLOOR = -1, -2
"""What an image of shape numbers holds where no solid is seen."""

Floats = NDArray[np.float64]
Depths = NDArray[np.float32]
Numbers = NDArray[np.int32]


@njit(cache=True, nogil=True, error_model="numpy")
def draw(
    kind: NDArray[np.int8],
    centre: Floats,
    half: Floats,
    yaw: Floats,
    position: Floats,
    rotation: Floats,
    focal: float,
    depth: Depths,
    number: Numbers,
) -> None:
    """Fill depth (h, w) with metres along the optical axis, inf for nothing, and number (h, w) with indices.

    rotation: (3, 3) from the optical frame to the world; focal in pixels, axis through the middle.
    """
    draw_floor(position, rotation, focal, depth, number)
    count = len(kind)
    frame = np.empty((count, 5))
    for i in range(count):
        outline(kind[i], centre[i], half[i], yaw[i], position, rotation, focal, depth.shape, frame[i])
    order = np.empty(count, np.int64)
    for n in range(front_to_back(frame, order)):
        i = order[n]
        eye, ray = local_rays(centre[i], yaw[i], position, rotation)
        u0, u1, v0, v1 = int(frame[i, 0]), int(frame[i, 1]), int(frame[i, 2]), int(frame[i, 3])
        window = (u0, u1, v0, v1)
        if kind[i] == BOX:
            draw_box(i, half[i], eye, ray, focal, window, frame[i, 4], depth, number)
        else:
            draw_round(i, kind[i], half[i], eye, ray, focal, window, frame[i, 4], depth, number)


@njit(cache=True, nogil=True, error_model="numpy")
def front_to_back(frame: Floats, order: NDArray[np.int64]) -> int:
    """Into order the numbers of the solids in view, nearest first; how many they are.

    By insertion: few are in view, and `np.argsort` takes seconds to compile.
    """
    seen = 0
    for i in range(len(frame)):
        if frame[i, 4] < np.inf:
            at = seen
            while at > 0 and frame[order[at - 1], 4] > frame[i, 4]:
                order[at] = order[at - 1]
                at -= 1
            order[at] = i
            seen += 1
    return seen


@njit(cache=True, nogil=True, error_model="numpy")
def draw_floor(position: Floats, rotation: Floats, focal: float, depth: Depths, number: Numbers) -> None:
    """Start the image: the plane z = 0 below the horizon, nothing above it."""
    rows, columns = depth.shape
    for v in range(rows):
        y = (v - 0.5 * (rows - 1)) / focal
        for u in range(columns):
            x = (u - 0.5 * (columns - 1)) / focal
            down = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2]
            t = -position[2] / down
            if t > NEAR:
                depth[v, u], number[v, u] = t, FLOOR
            else:
                depth[v, u], number[v, u] = np.inf, NOTHING


@njit(cache=True, nogil=True, error_model="numpy")
def local_rays(centre: Floats, yaw: float, position: Floats, rotation: Floats) -> tuple[Floats, Floats]:
    """The camera in the frame of a solid: its place (3,) and its rotation (3, 3)."""
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = position[0] - centre[0], position[1] - centre[1]
    eye, ray = np.empty(3), np.empty((3, 3))
    eye[0], eye[1], eye[2] = c * dx + s * dy, -s * dx + c * dy, position[2] - centre[2]
    for j in range(3):
        ray[0, j] = c * rotation[0, j] + s * rotation[1, j]
        ray[1, j] = -s * rotation[0, j] + c * rotation[1, j]
        ray[2, j] = rotation[2, j]
    return eye, ray


@njit(cache=True, nogil=True, error_model="numpy")
def outline(
    kind: int,
    centre: Floats,
    half: Floats,
    yaw: float,
    position: Floats,
    rotation: Floats,
    focal: float,
    size: tuple[int, int],
    out: Floats,
) -> None:
    """Into out: columns u0..u1 and rows v0..v1 (ends left out) that the solid's box can cover, nearest depth.

    A solid that cannot be seen gets the depth inf. Edges that cross the near plane are cut there.
    """
    corner = corners(kind, centre, half, yaw, position, rotation)
    u0, u1, v0, v1, near = np.inf, -np.inf, np.inf, -np.inf, np.inf
    for i in range(8):
        if corner[i, 2] >= NEAR:
            u, v = corner[i, 0] / corner[i, 2], corner[i, 1] / corner[i, 2]
            u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
            near = min(near, corner[i, 2])
        for bit in (1, 2, 4):
            j = i ^ bit
            if corner[i, 2] < NEAR < corner[j, 2]:
                t = (NEAR - corner[i, 2]) / (corner[j, 2] - corner[i, 2])
                u = (corner[i, 0] + t * (corner[j, 0] - corner[i, 0])) / NEAR
                v = (corner[i, 1] + t * (corner[j, 1] - corner[i, 1])) / NEAR
                u0, u1, v0, v1, near = min(u0, u), max(u1, u), min(v0, v), max(v1, v), NEAR
    pixels(u0, u1, v0, v1, near, focal, size, out)


@njit(cache=True, nogil=True, error_model="numpy")
def corners(
    kind: int, centre: Floats, half: Floats, yaw: float, position: Floats, rotation: Floats
) -> Floats:
    """(8, 3) corners of the solid's box in the optical frame; those that differ in one bit share an edge."""
    c, s = math.cos(yaw), math.sin(yaw)
    top = half[2] + half[0] if kind == CAPSULE else half[2]
    corner = np.empty((8, 3))
    for i in range(8):
        x = half[0] if i & 1 else -half[0]
        y = half[1] if i & 2 else -half[1]
        z = top if i & 4 else -top
        wx = centre[0] + c * x - s * y - position[0]
        wy = centre[1] + s * x + c * y - position[1]
        wz = centre[2] + z - position[2]
        for j in range(3):
            corner[i, j] = rotation[0, j] * wx + rotation[1, j] * wy + rotation[2, j] * wz
    return corner


@njit(cache=True, nogil=True, error_model="numpy")
def pixels(
    u0: float, u1: float, v0: float, v1: float, near: float, focal: float, size: tuple[int, int], out: Floats
) -> None:
    """Tangents to whole pixels within the image, one more on every side; depth inf when none is left."""
    rows, columns = size
    out[4] = np.inf
    if near == np.inf:
        return
    middle_u, middle_v = 0.5 * (columns - 1), 0.5 * (rows - 1)
    # Bounds in floats first: a tangent close to the near plane is beyond every integer.
    out[0] = max(0.0, math.floor(focal * u0 + middle_u))
    out[1] = min(float(columns), math.ceil(focal * u1 + middle_u) + 1.0)
    out[2] = max(0.0, math.floor(focal * v0 + middle_v))
    out[3] = min(float(rows), math.ceil(focal * v1 + middle_v) + 1.0)
    if out[0] < out[1] and out[2] < out[3]:
        out[4] = near


@njit(cache=True, nogil=True, error_model="numpy")
def draw_box(
    index: int,
    half: Floats,
    eye: Floats,
    ray: Floats,
    focal: float,
    window: tuple[int, int, int, int],
    nearest: float,
    depth: Depths,
    number: Numbers,
) -> None:
    """One box: the ray enters where it has entered all three pairs of planes, if it has left none before."""
    rows, columns = depth.shape
    low0, low1, low2 = -half[0] - eye[0], -half[1] - eye[1], -half[2] - eye[2]
    high0, high1, high2 = half[0] - eye[0], half[1] - eye[1], half[2] - eye[2]
    r00, r10, r20 = ray[0, 0], ray[1, 0], ray[2, 0]
    for v in range(window[2], window[3]):
        y = (v - 0.5 * (rows - 1)) / focal
        b0, b1, b2 = ray[0, 1] * y + ray[0, 2], ray[1, 1] * y + ray[1, 2], ray[2, 1] * y + ray[2, 2]
        for u in range(window[0], window[1]):
            if depth[v, u] <= nearest:
                continue
            x = (u - 0.5 * (columns - 1)) / focal
            i0, i1, i2 = 1.0 / (r00 * x + b0), 1.0 / (r10 * x + b1), 1.0 / (r20 * x + b2)
            p, q = low0 * i0, high0 * i0
            enter, leave = min(p, q), max(p, q)
            p, q = low1 * i1, high1 * i1
            enter, leave = max(enter, min(p, q)), min(leave, max(p, q))
            p, q = low2 * i2, high2 * i2
            enter, leave = max(enter, min(p, q)), min(leave, max(p, q))
            if NEAR < enter <= leave and enter < depth[v, u]:
                depth[v, u], number[v, u] = enter, index


@njit(cache=True, nogil=True, error_model="numpy")
def draw_round(
    index: int,
    kind: int,
    half: Floats,
    eye: Floats,
    ray: Floats,
    focal: float,
    window: tuple[int, int, int, int],
    nearest: float,
    depth: Depths,
    number: Numbers,
) -> None:
    """One cylinder or capsule."""
    rows, columns = depth.shape
    for v in range(window[2], window[3]):
        y = (v - 0.5 * (rows - 1)) / focal
        for u in range(window[0], window[1]):
            if depth[v, u] <= nearest:
                continue
            x = (u - 0.5 * (columns - 1)) / focal
            dx = ray[0, 0] * x + ray[0, 1] * y + ray[0, 2]
            dy = ray[1, 0] * x + ray[1, 1] * y + ray[1, 2]
            dz = ray[2, 0] * x + ray[2, 1] * y + ray[2, 2]
            if kind == CYLINDER:
                t = meet_cylinder(half[0], half[2], eye, dx, dy, dz)
            else:
                t = meet_capsule(half[0], half[2], eye, dx, dy, dz)
            if NEAR < t < depth[v, u]:
                depth[v, u], number[v, u] = t, index


@njit(cache=True, nogil=True, error_model="numpy")
def meet_mantle(radius: float, length: float, eye: Floats, dx: float, dy: float, dz: float) -> float:
    """Ray parameter where it enters the curved side of an upright cylinder, half length `length`; or inf."""
    a = dx * dx + dy * dy
    b = eye[0] * dx + eye[1] * dy
    root = b * b - a * (eye[0] * eye[0] + eye[1] * eye[1] - radius * radius)
    if root < 0.0 or a == 0.0:
        return np.inf
    t = (-b - math.sqrt(root)) / a
    return t if t > NEAR and abs(eye[2] + t * dz) <= length else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def meet_cylinder(radius: float, length: float, eye: Floats, dx: float, dy: float, dz: float) -> float:
    """Ray parameter where it enters the cylinder through its side or the cap that faces the eye, or inf."""
    t = meet_mantle(radius, length, eye, dx, dy, dz)
    if t < np.inf or abs(eye[2]) <= length:
        return t
    cap = length if eye[2] > 0.0 else -length
    t = (cap - eye[2]) / dz
    x, y = eye[0] + t * dx, eye[1] + t * dy
    return t if t > NEAR and x * x + y * y <= radius * radius else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def meet_capsule(radius: float, length: float, eye: Floats, dx: float, dy: float, dz: float) -> float:
    """Ray parameter where it enters the capsule: its side, or the sphere at either end; or inf."""
    t = meet_mantle(radius, length, eye, dx, dy, dz)
    a = dx * dx + dy * dy + dz * dz
    for end in (-length, length):
        z = eye[2] - end
        b = eye[0] * dx + eye[1] * dy + z * dz
        root = b * b - a * (eye[0] * eye[0] + eye[1] * eye[1] + z * z - radius * radius)
        if root >= 0.0:
            enter = (-b - math.sqrt(root)) / a
            if NEAR < enter < t:
                t = enter
    return t
