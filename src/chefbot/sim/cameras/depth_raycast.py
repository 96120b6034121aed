"""Kernels that render solids into a depth image: exact ray intersection per pixel, nearest solid wins.

Rays are scaled so that their third component in the optical frame (z forward, x right, y down) is 1: then the
ray parameter is the depth along the optical axis. Solids are drawn front to back, each only within the
rectangle of pixels that it can cover (z-buffer: Foley et al., Computer Graphics, 15.4; slabs: Kay & Kajiya,
Ray tracing complex scenes, 1986).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.sim.world.shapes import BOX, CAPSULE, CYLINDER

NEAR_PLANE_DISTANCE = 0.01
"""Distance of the near plane from the lens, metres."""
NOTHING, FLOOR = -1, -2
"""Values of an image of shape indices where no solid is seen."""

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
    """Render a depth image and an image of shape indices.

    kind (n,), centre (n, 3), half (n, 3), yaw (n,): the solids as in ShapeArrays. position (3,) and rotation
    (3, 3) of the optical frame in the world. focal: focal length in pixels, optical axis through the middle
    of the image.
    depth: (h, w) metres along the optical axis, inf for nothing. number: (h, w) shape indices, FLOOR or
    NOTHING.
    """
    columns = depth.shape[1]
    tangent = np.empty(columns)
    for u in range(columns):
        tangent[u] = (u - 0.5 * (columns - 1)) / focal
    # Background: floor plane and sky.
    draw_floor(position, rotation, focal, tangent, depth, number)
    count = len(kind)
    # Per solid: window of pixels (u0, u1, v0, v1) and nearest depth.
    frame = np.empty((count, 5))
    for i in range(count):
        outline(kind[i], centre[i], half[i], yaw[i], position, rotation, focal, depth.shape, frame[i])
    # Draw nearest first, so that most pixels fail the depth test early.
    order = np.empty(count, np.int64)
    for n in range(front_to_back(frame, order)):
        i = order[n]
        eye, ray = to_solid_frame(centre[i], yaw[i], position, rotation)
        u0, u1, v0, v1 = int(frame[i, 0]), int(frame[i, 1]), int(frame[i, 2]), int(frame[i, 3])
        window = (u0, u1, v0, v1)
        if kind[i] == BOX:
            draw_box(i, half[i], eye, ray, focal, tangent, window, frame[i, 4], depth, number)
        else:
            solid = (i, kind[i], half[i])
            draw_cylinder_or_capsule(*solid, eye, ray, focal, tangent, window, frame[i, 4], depth, number)


@njit(cache=True, nogil=True, error_model="numpy")
def front_to_back(frame: Floats, order: NDArray[np.int64]) -> int:
    """Write the indices of the visible solids into `order`, nearest first; return how many there are.

    Insertion sort: few solids are visible, and `np.argsort` takes seconds to compile.
    """
    count = 0
    for i in range(len(frame)):
        if frame[i, 4] < np.inf:
            slot = count
            while slot > 0 and frame[order[slot - 1], 4] > frame[i, 4]:
                order[slot] = order[slot - 1]
                slot -= 1
            order[slot] = i
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def draw_floor(
    position: Floats, rotation: Floats, focal: float, tangent: Floats, depth: Depths, number: Numbers
) -> None:
    """Initialize the image: the plane z = 0 below the horizon, nothing above it.

    tangent (w,): x of the ray of each column.
    """
    rows, columns = depth.shape
    for v in range(rows):
        y = (v - 0.5 * (rows - 1)) / focal
        for u in range(columns):
            # Third component of the world ray: z(t) = p_z + t slope = 0 at the floor.
            slope = rotation[2, 0] * tangent[u] + rotation[2, 1] * y + rotation[2, 2]
            t = -position[2] / slope
            # Without branches, so that it vectorises.
            depth[v, u] = t if t > NEAR_PLANE_DISTANCE else np.inf
            number[v, u] = FLOOR if t > NEAR_PLANE_DISTANCE else NOTHING


@njit(cache=True, nogil=True, error_model="numpy")
def to_solid_frame(centre: Floats, yaw: float, position: Floats, rotation: Floats) -> tuple[Floats, Floats]:
    """Return the camera in the frame of a solid: position (3,) and rotation (3, 3)."""
    c, s = math.cos(yaw), math.sin(yaw)
    # eye = Rz(yaw)^T (p - c), ray = Rz(yaw)^T R.
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
    """Write the pixel window u0, u1, v0, v1 (ends exclusive) of a solid's box and its nearest depth into out
    (5,).

    A solid that is not visible gets the depth inf. Edges that cross the near plane are clipped there.
    """
    corner = box_corners(kind, centre, half, yaw, position, rotation)
    u0, u1, v0, v1, near = np.inf, -np.inf, np.inf, -np.inf, np.inf
    for i in range(8):
        # Project corners in front of the near plane: u = x / z, v = y / z.
        if corner[i, 2] >= NEAR_PLANE_DISTANCE:
            u, v = corner[i, 0] / corner[i, 2], corner[i, 1] / corner[i, 2]
            u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
            near = min(near, corner[i, 2])
        # Clip the three edges from this corner at the near plane.
        for bit in (1, 2, 4):
            j = i ^ bit
            if corner[i, 2] < NEAR_PLANE_DISTANCE < corner[j, 2]:
                t = (NEAR_PLANE_DISTANCE - corner[i, 2]) / (corner[j, 2] - corner[i, 2])
                u = (corner[i, 0] + t * (corner[j, 0] - corner[i, 0])) / NEAR_PLANE_DISTANCE
                v = (corner[i, 1] + t * (corner[j, 1] - corner[i, 1])) / NEAR_PLANE_DISTANCE
                u0, u1, v0, v1, near = min(u0, u), max(u1, u), min(v0, v), max(v1, v), NEAR_PLANE_DISTANCE
    pixel_window(u0, u1, v0, v1, near, focal, size, out)


@njit(cache=True, nogil=True, error_model="numpy")
def box_corners(
    kind: int, centre: Floats, half: Floats, yaw: float, position: Floats, rotation: Floats
) -> Floats:
    """Return the (8, 3) corners of a solid's box in the optical frame; one differing bit marks an edge."""
    c, s = math.cos(yaw), math.sin(yaw)
    top = half[2] + half[0] if kind == CAPSULE else half[2]
    corner = np.empty((8, 3))
    for i in range(8):
        # Corner i has the sign of bit 0 along x, bit 1 along y, bit 2 along z.
        x = half[0] if i & 1 else -half[0]
        y = half[1] if i & 2 else -half[1]
        z = top if i & 4 else -top
        # Solid frame to world, relative to the camera.
        wx = centre[0] + c * x - s * y - position[0]
        wy = centre[1] + s * x + c * y - position[1]
        wz = centre[2] + z - position[2]
        # World to optical frame: R^T w.
        for j in range(3):
            corner[i, j] = rotation[0, j] * wx + rotation[1, j] * wy + rotation[2, j] * wz
    return corner


@njit(cache=True, nogil=True, error_model="numpy")
def pixel_window(
    u0: float, u1: float, v0: float, v1: float, near: float, focal: float, size: tuple[int, int], out: Floats
) -> None:
    """Write the window of whole pixels for bounds in tangents, one pixel wider; depth inf if it is empty."""
    rows, columns = size
    out[4] = np.inf
    if near == np.inf:
        return
    middle_u, middle_v = 0.5 * (columns - 1), 0.5 * (rows - 1)
    # Clamp as floats: a tangent close to the near plane exceeds every integer.
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
    tangent: Floats,
    window: tuple[int, int, int, int],
    nearest: float,
    depth: Depths,
    number: Numbers,
) -> None:
    """Render one box by the slab method: the ray is inside between the last entry and the first exit."""
    rows = len(depth)
    # Slab planes relative to the eye, in the box frame.
    min0, min1, min2 = -half[0] - eye[0], -half[1] - eye[1], -half[2] - eye[2]
    max0, max1, max2 = half[0] - eye[0], half[1] - eye[1], half[2] - eye[2]
    r00, r10, r20 = ray[0, 0], ray[1, 0], ray[2, 0]
    for v in range(window[2], window[3]):
        y = (v - 0.5 * (rows - 1)) / focal
        b0, b1, b2 = ray[0, 1] * y + ray[0, 2], ray[1, 1] * y + ray[1, 2], ray[2, 1] * y + ray[2, 2]
        for u in range(window[0], window[1]):
            if depth[v, u] <= nearest:
                continue
            x = tangent[u]
            # Inverse ray direction, then entry and exit of the three slabs (Kay & Kajiya).
            i0, i1, i2 = 1.0 / (r00 * x + b0), 1.0 / (r10 * x + b1), 1.0 / (r20 * x + b2)
            t0, t1 = min0 * i0, max0 * i0
            t_enter, t_exit = min(t0, t1), max(t0, t1)
            t0, t1 = min1 * i1, max1 * i1
            t_enter, t_exit = max(t_enter, min(t0, t1)), min(t_exit, max(t0, t1))
            t0, t1 = min2 * i2, max2 * i2
            t_enter, t_exit = max(t_enter, min(t0, t1)), min(t_exit, max(t0, t1))
            # Hit in front of everything drawn so far.
            if NEAR_PLANE_DISTANCE < t_enter <= t_exit and t_enter < depth[v, u]:
                depth[v, u], number[v, u] = t_enter, index


@njit(cache=True, nogil=True, error_model="numpy")
def draw_cylinder_or_capsule(
    index: int,
    kind: int,
    half: Floats,
    eye: Floats,
    ray: Floats,
    focal: float,
    tangent: Floats,
    window: tuple[int, int, int, int],
    nearest: float,
    depth: Depths,
    number: Numbers,
) -> None:
    """Render one cylinder or capsule."""
    rows = len(depth)
    for v in range(window[2], window[3]):
        y = (v - 0.5 * (rows - 1)) / focal
        for u in range(window[0], window[1]):
            if depth[v, u] <= nearest:
                continue
            x = tangent[u]
            # Ray direction in the frame of the solid.
            dx = ray[0, 0] * x + ray[0, 1] * y + ray[0, 2]
            dy = ray[1, 0] * x + ray[1, 1] * y + ray[1, 2]
            dz = ray[2, 0] * x + ray[2, 1] * y + ray[2, 2]
            if kind == CYLINDER:
                t = intersect_cylinder(half[0], half[2], eye, dx, dy, dz)
            else:
                t = intersect_capsule(half[0], half[2], eye, dx, dy, dz)
            if NEAR_PLANE_DISTANCE < t < depth[v, u]:
                depth[v, u], number[v, u] = t, index


@njit(cache=True, nogil=True, error_model="numpy")
def intersect_tube(radius: float, length: float, eye: Floats, dx: float, dy: float, dz: float) -> float:
    """Return the ray parameter at the entry into an upright tube of half length `length`, or inf."""
    # Quadratic a t^2 + 2 b t + c = 0 of |eye_xy + t d_xy| = radius; smaller root.
    a = dx * dx + dy * dy
    b = eye[0] * dx + eye[1] * dy
    discriminant = b * b - a * (eye[0] * eye[0] + eye[1] * eye[1] - radius * radius)
    if discriminant < 0.0 or a == 0.0:
        return np.inf
    t = (-b - math.sqrt(discriminant)) / a
    return t if t > NEAR_PLANE_DISTANCE and abs(eye[2] + t * dz) <= length else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def intersect_cylinder(radius: float, length: float, eye: Floats, dx: float, dy: float, dz: float) -> float:
    """Return the ray parameter at the entry into a cylinder's side or the cap facing the eye, or inf."""
    t = intersect_tube(radius, length, eye, dx, dy, dz)
    if t < np.inf or abs(eye[2]) <= length:
        return t
    # Otherwise intersect the plane of the cap that faces the eye.
    cap = length if eye[2] > 0.0 else -length
    t = (cap - eye[2]) / dz
    x, y = eye[0] + t * dx, eye[1] + t * dy
    return t if t > NEAR_PLANE_DISTANCE and x * x + y * y <= radius * radius else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def intersect_capsule(radius: float, length: float, eye: Floats, dx: float, dy: float, dz: float) -> float:
    """Return the ray parameter at the entry into a capsule's side or either end sphere, or inf."""
    t = intersect_tube(radius, length, eye, dx, dy, dz)
    a = dx * dx + dy * dy + dz * dz
    for sphere_z in (-length, length):
        z = eye[2] - sphere_z
        # Ray-sphere quadratic about this end; smaller root.
        b = eye[0] * dx + eye[1] * dy + z * dz
        discriminant = b * b - a * (eye[0] * eye[0] + eye[1] * eye[1] + z * z - radius * radius)
        if discriminant >= 0.0:
            t_enter = (-b - math.sqrt(discriminant)) / a
            if NEAR_PLANE_DISTANCE < t_enter < t:
                t = t_enter
    return t
