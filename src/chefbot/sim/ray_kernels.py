"""Kernels that intersect a bundle of rays with the solids of a world.

A solid is tested only against the rays whose horizontal direction lies between its outermost corners, seen from the
sensor: the solids are upright, so that this holds for a tilted robot as well.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.sim.cameras.depth_raycast import (
    NEAR_PLANE_DISTANCE,
    Floats,
    intersect_capsule,
    intersect_cylinder,
)
from chefbot.sim.world.shapes import BOX, CAPSULE, CYLINDER, GLASS, MIRROR

NO_HIT, FLOOR_HIT = -1, -2
"""Values in place of the index of a solid."""
SECTORS = 180
"""Number of sectors of azimuth into which the rays are sorted."""
SECTORS_PER_RADIAN = SECTORS / (2.0 * math.pi)
STEEP_LENGTH = 1e-3
"""Horizontal part of a unit vector below which a ray has no azimuth."""
REFLECTION_OFFSET = 1e-4
"""Distance from a mirror at which a reflected ray begins, m."""

Integers = NDArray[np.int64]
Vector = tuple[float, float, float]
Solids = tuple[NDArray[np.int8], Floats, Floats, Floats, NDArray[np.int8]]
"""kind (n,), centre (n, 3), half (n, 3), yaw (n,) and material (n,), as in ShapeArrays."""


@njit(cache=True, error_model="numpy")
def cast_rays(
    solids: Solids, flat_floor: bool, origin: Floats, rays: Floats, limit: float, min_glass_cosine: float
) -> tuple[Floats, Floats]:
    """Return the distances (m,) to the first hit of each ray, inf for none, and the surface normals there (m, 3).

    flat_floor: whether the floor is the plane z = 0. rays: (m, 3) unit vectors. limit: length of the rays, m.
    min_glass_cosine: cosine of the angle of incidence below which rays pass glass and are reflected by mirrors, as
    light is; negative for sound, for which both are walls.
    """
    count = len(rays)
    distance, normal, hit = np.full(count, np.inf), np.zeros((count, 3)), np.full(count, NO_HIT)
    lists = sort_by_azimuth(rays)
    if flat_floor:
        hit_floor(origin, rays, distance, normal, hit)
    kind, centre, half, yaw, material = solids
    for i in range(len(kind)):
        dx, dy = origin[0] - centre[i, 0], origin[1] - centre[i, 1]
        size = (half[i, 0], half[i, 1], half[i, 2])
        reach = limit + (math.hypot(size[0], size[1]) if kind[i] == BOX else size[0])
        if dx * dx + dy * dy > reach * reach:
            continue
        # the sensor in the frame of the solid
        turn = (math.cos(yaw[i]), math.sin(yaw[i]))
        eye = (turn[0] * dx + turn[1] * dy, turn[0] * dy - turn[1] * dx, origin[2] - centre[i, 2])
        low, high = azimuths_of_box(eye, size) if kind[i] == BOX else azimuths_of_circle(eye, size[0])
        window = (sector_at(low + yaw[i]) - 1, min(math.ceil((high - low) * SECTORS_PER_RADIAN) + 3, SECTORS))
        passed = min_glass_cosine if material[i] == GLASS else -1.0
        cast_to_solid(i, kind[i], size, turn, eye, window, passed, rays, lists, distance, normal, hit)
    for j in range(count):
        if distance[j] > limit:
            distance[j] = np.inf
        elif min_glass_cosine >= 0.0 and hit[j] >= 0 and material[hit[j]] == MIRROR:
            distance[j] += reflected_distance(solids, flat_floor, origin, rays[j], distance[j], normal[j])
    return distance, normal


@njit(cache=True, error_model="numpy")
def sort_by_azimuth(rays: Floats) -> tuple[Integers, Integers]:
    """Return linked lists of the rays in each sector: the first ray (SECTORS + 1,) and the next one (m,).

    -1 ends a list. The last list holds the steep rays, which belong to all sectors.
    """
    first, following = np.full(SECTORS + 1, -1), np.full(len(rays), -1)
    for j in range(len(rays)):
        x, y = rays[j, 0], rays[j, 1]
        sector = SECTORS
        if x * x + y * y > STEEP_LENGTH * STEEP_LENGTH:
            sector = sector_at(math.atan2(y, x)) % SECTORS
        following[j], first[sector] = first[sector], j
    return first, following


@njit(cache=True, error_model="numpy")
def sector_at(azimuth: float) -> int:
    """Return the number of the sector of an azimuth, rad, modulo the number of sectors."""
    return math.floor(azimuth * SECTORS_PER_RADIAN)


@njit(cache=True, error_model="numpy")
def azimuths_of_circle(eye: Vector, radius: float) -> tuple[float, float]:
    """Return the interval of azimuths, rad, in which a circle around (0, 0) lies as seen from `eye`."""
    distance = math.hypot(eye[0], eye[1])
    if distance <= radius:
        return -math.pi, math.pi
    bearing, width = math.atan2(-eye[1], -eye[0]), math.asin(radius / distance)
    return bearing - width, bearing + width


@njit(cache=True, error_model="numpy")
def azimuths_of_box(eye: Vector, size: Vector) -> tuple[float, float]:
    """Return the interval of azimuths, rad, in which a rectangle of half sides `size` around (0, 0) lies.

    It ends at the two corners that lie apart most, which depend on the sides that the sensor looks at.
    """
    x, y, half_x, half_y = eye[0], eye[1], size[0], size[1]
    # side of the rectangle on which the sensor is along each axis: -1, 0 between the sides, 1
    across, along = (x > half_x) - (x < -half_x), (y > half_y) - (y < -half_y)
    if across == 0 and along == 0:
        return -math.pi, math.pi  # above or below it
    # the right end, then the left end, as seen from the sensor
    right_x, right_y = half_x * (-along if along else across), half_y * (across if across else along)
    left_x, left_y = half_x * (along if along else across), half_y * (-across if across else along)
    low, high = math.atan2(right_y - y, right_x - x), math.atan2(left_y - y, left_x - x)
    return low, high if high >= low else high + 2.0 * math.pi


@njit(cache=True, error_model="numpy")
def cast_to_solid(
    index: int,
    kind: int,
    size: Vector,
    turn: tuple[float, float],
    eye: Vector,
    window: tuple[int, int],
    min_cosine: float,
    rays: Floats,
    lists: tuple[Integers, Integers],
    distance: Floats,
    normal: Floats,
    hit: Integers,
) -> None:
    """Shorten the rays that hit a solid before anything else, at an angle of incidence of at least `min_cosine`.

    turn: cosine and sine of the solid's yaw. eye: the sensor in the frame of the solid. window: the first sector in
    which the solid lies, and the number of sectors.
    """
    (first, following), (c, s) = lists, turn
    for step in range(window[1] + 1):
        # the steep rays come last
        j = first[(window[0] + step) % SECTORS if step < window[1] else SECTORS]
        while j >= 0:
            ray = (c * rays[j, 0] + s * rays[j, 1], c * rays[j, 1] - s * rays[j, 0], rays[j, 2])
            t = hit_box(size, eye, ray) if kind == BOX else hit_round(kind, size, eye, ray)
            if t < distance[j]:
                at = surface_normal(kind, size, eye, ray, t)
                if abs(at[0] * ray[0] + at[1] * ray[1] + at[2] * ray[2]) >= min_cosine:
                    distance[j], hit[j] = t, index
                    normal[j, 0], normal[j, 1], normal[j, 2] = (
                        c * at[0] - s * at[1],
                        s * at[0] + c * at[1],
                        at[2],
                    )
            j = following[j]


@njit(cache=True, error_model="numpy")
def hit_floor(origin: Floats, rays: Floats, distance: Floats, normal: Floats, hit: Integers) -> None:
    """Shorten the rays that go down to the plane z = 0."""
    for j in range(len(rays)):
        if rays[j, 2] < 0.0 < origin[2]:
            distance[j], hit[j] = -origin[2] / rays[j, 2], FLOOR_HIT
            normal[j, 0], normal[j, 1], normal[j, 2] = 0.0, 0.0, 1.0


@njit(cache=True, error_model="numpy")
def hit_box(size: Vector, eye: Vector, ray: Vector) -> float:
    """Return the distance to the entry into a box of half sides `size`, inf for a miss (slab method)."""
    enter, leave = NEAR_PLANE_DISTANCE, np.inf
    for axis in range(3):
        if ray[axis] == 0.0:
            if abs(eye[axis]) > size[axis]:
                return np.inf
            continue
        middle, half = -eye[axis] / ray[axis], size[axis] / abs(ray[axis])
        enter, leave = max(enter, middle - half), min(leave, middle + half)
    return enter if NEAR_PLANE_DISTANCE < enter <= leave else np.inf


@njit(cache=True, error_model="numpy")
def hit_round(kind: int, size: Vector, eye: Vector, ray: Vector) -> float:
    """Return the distance to the entry into a cylinder or capsule, inf for a miss."""
    sensor = np.array(eye)
    if kind == CYLINDER:
        return intersect_cylinder(size[0], size[2], sensor, *ray)
    return intersect_capsule(size[0], size[2], sensor, *ray)


@njit(cache=True, error_model="numpy")
def surface_normal(kind: int, size: Vector, eye: Vector, ray: Vector, t: float) -> Vector:
    """Return the normal, in the frame of the solid, of the surface that a ray meets at the distance t."""
    x, y, z = eye[0] + t * ray[0], eye[1] + t * ray[1], eye[2] + t * ray[2]
    if kind == BOX:
        # the face that the point lies on: where it is farthest out
        out_x, out_y, out_z = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
        if out_z >= max(out_x, out_y):
            return 0.0, 0.0, math.copysign(1.0, z)
        return (math.copysign(1.0, x), 0.0, 0.0) if out_x >= out_y else (0.0, math.copysign(1.0, y), 0.0)
    if kind == CYLINDER and size[2] - abs(z) < size[0] - math.hypot(x, y):
        return 0.0, 0.0, math.copysign(1.0, z)
    # round: away from the nearest point of the axis
    up = z - min(max(z, -size[2]), size[2]) if kind == CAPSULE else 0.0
    return x / size[0], y / size[0], up / size[0]


@njit(cache=True, error_model="numpy")
def reflected_distance(
    solids: Solids, flat_floor: bool, origin: Floats, ray: Floats, to_mirror: float, normal: Floats
) -> float:
    """Return the distance (m) from a mirror to what the reflected ray meets, inf for nothing; it passes glass."""
    # Reflection: d' = d - 2 (d . n) n; the ray begins a little before the mirror.
    across = ray[0] * normal[0] + ray[1] * normal[1] + ray[2] * normal[2]
    reflected, start = np.empty(3), np.empty(3)
    for k in range(3):
        reflected[k] = ray[k] - 2.0 * across * normal[k]
        start[k] = origin[k] + to_mirror * ray[k] + REFLECTION_OFFSET * reflected[k]
    nearest = np.inf
    if flat_floor and reflected[2] < 0.0:
        nearest = -start[2] / reflected[2]
    kind, centre, half, yaw, material = solids
    for i in range(len(kind)):
        if material[i] == GLASS:
            continue
        c, s = math.cos(yaw[i]), math.sin(yaw[i])
        dx, dy = start[0] - centre[i, 0], start[1] - centre[i, 1]
        eye = (c * dx + s * dy, c * dy - s * dx, start[2] - centre[i, 2])
        beam = (c * reflected[0] + s * reflected[1], c * reflected[1] - s * reflected[0], reflected[2])
        size = (half[i, 0], half[i, 1], half[i, 2])
        nearest = min(
            nearest, hit_box(size, eye, beam) if kind[i] == BOX else hit_round(kind[i], size, eye, beam)
        )
    return nearest + REFLECTION_OFFSET
