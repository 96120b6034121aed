"""Solids of a world: upright boxes, cylinders and capsules, and their flat arrays for kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2

BOX, CYLINDER, CAPSULE = 0, 1, 2
SOLID, GLASS, MIRROR = 0, 1, 2
MATERIALS = {"solid": SOLID, "glass": GLASS, "mirror": MIRROR}
"""Number of each material of a world file."""
RgbColour = tuple[int, int, int]
OccupiedCircle = tuple[float, float, float]
"""x, y, radius of a person or the robot, to be avoided."""


class SimulatedShape(NamedTuple):
    """An upright solid; metres and radians in the frame of the world or of the body that carries it.

    x, y, z: centre. half: half sides of a box; (radius, radius, half length) of a cylinder; (radius, radius,
    half length of the straight part) of a capsule. name: "object/part", as collisions report it. material:
    SOLID, GLASS or MIRROR.
    """

    kind: int
    x: float
    y: float
    z: float
    half: tuple[float, float, float]
    yaw: float
    colour: RgbColour
    name: str
    material: int = SOLID

    @property
    def bottom(self) -> float:
        """Lowest z coordinate of the solid."""
        return self.z - self.half_height

    @property
    def top(self) -> float:
        """Highest z coordinate of the solid."""
        return self.z + self.half_height

    @property
    def half_height(self) -> float:
        """Distance from the centre to the top."""
        return self.half[2] + (self.half[0] if self.kind == CAPSULE else 0.0)

    @property
    def reach(self) -> float:
        """Circumscribed radius about (x, y), seen from above."""
        return math.hypot(self.half[0], self.half[1]) if self.kind == BOX else self.half[0]

    @property
    def extent(self) -> tuple[float, float]:
        """Half sides of the axis-aligned bounding rectangle, seen from above."""
        if self.kind != BOX:
            return self.half[0], self.half[0]
        c, s = abs(math.cos(self.yaw)), abs(math.sin(self.yaw))
        return c * self.half[0] + s * self.half[1], s * self.half[0] + c * self.half[1]

    def transformed(self, pose: SE2) -> SimulatedShape:
        """Return the shape in the parent frame when its own frame lies at `pose`."""
        placed = pose @ SE2(self.x, self.y, self.yaw)
        return self._replace(x=placed.x, y=placed.y, yaw=placed.yaw)


def box(
    name: str, at: SE2, bottom: float, size: tuple[float, float, float], colour: RgbColour
) -> SimulatedShape:
    """Return a box of full side lengths `size` whose lower side is at height `bottom`."""
    half = (size[0] / 2, size[1] / 2, size[2] / 2)
    return SimulatedShape(BOX, at.x, at.y, bottom + half[2], half, at.yaw, colour, name)


def cylinder(
    name: str, at: tuple[float, float], bottom: float, radius: float, height: float, colour: RgbColour
) -> SimulatedShape:
    """Return an upright cylinder whose lower side is at height `bottom`."""
    half = (radius, radius, height / 2)
    return SimulatedShape(CYLINDER, at[0], at[1], bottom + height / 2, half, 0.0, colour, name)


def capsule(
    name: str, at: tuple[float, float], bottom: float, radius: float, height: float, colour: RgbColour
) -> SimulatedShape:
    """Return an upright capsule of total height `height` from `bottom` up."""
    half = (radius, radius, height / 2 - radius)
    return SimulatedShape(CAPSULE, at[0], at[1], bottom + height / 2, half, 0.0, colour, name)


class ShapeArrays(NamedTuple):
    """Shapes as flat arrays for the kernels, n shapes; metres and radians as in Shape.

    kind: (n,). centre, half: (n, 3). yaw: (n,). colour: (n, 3). material: (n,).
    """

    kind: NDArray[np.int8]
    centre: NDArray[np.float64]
    half: NDArray[np.float64]
    yaw: NDArray[np.float64]
    colour: NDArray[np.uint8]
    material: NDArray[np.int8]


def shape_arrays(shapes: Sequence[SimulatedShape]) -> ShapeArrays:
    """Return flat arrays of the shapes, in their order."""
    return ShapeArrays(
        np.array([s.kind for s in shapes], dtype=np.int8),
        np.array([(s.x, s.y, s.z) for s in shapes], dtype=np.float64).reshape(-1, 3),
        np.array([s.half for s in shapes], dtype=np.float64).reshape(-1, 3),
        np.array([s.yaw for s in shapes], dtype=np.float64),
        np.array([s.colour for s in shapes], dtype=np.uint8).reshape(-1, 3),
        np.array([s.material for s in shapes], dtype=np.int8),
    )


def concatenate(a: ShapeArrays, b: ShapeArrays) -> ShapeArrays:
    """Return the concatenation of two sets of shapes."""
    return ShapeArrays(
        np.concatenate([a.kind, b.kind]),
        np.concatenate([a.centre, b.centre]),
        np.concatenate([a.half, b.half]),
        np.concatenate([a.yaw, b.yaw]),
        np.concatenate([a.colour, b.colour]),
        np.concatenate([a.material, b.material]),
    )


def distance(shape: SimulatedShape, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances in metres from points to the shape seen from above, 0 inside; any array shape."""
    dx, dy = x - shape.x, y - shape.y
    if shape.kind != BOX:
        return np.maximum(np.hypot(dx, dy) - shape.half[0], 0.0)
    # Point in the box frame: R(-yaw) (p - c); distance beyond each pair of sides.
    c, s = math.cos(shape.yaw), math.sin(shape.yaw)
    outside_x = np.maximum(np.abs(c * dx + s * dy) - shape.half[0], 0.0)
    outside_y = np.maximum(np.abs(-s * dx + c * dy) - shape.half[1], 0.0)
    return np.hypot(outside_x, outside_y)


def clearance(shapes: Sequence[SimulatedShape], x: float, y: float, low: float, high: float) -> float:
    """Return the distance from a point to the nearest shape within the heights low..high, m.

    It is inf if there is no such shape.
    """
    px, py = np.array(x), np.array(y)
    smallest = math.inf
    for shape in shapes:
        # The circumscribed circle is quickly computed and rules out most of the many solids of a map.
        if math.hypot(x - shape.x, y - shape.y) - shape.reach > smallest:
            continue
        if shape.bottom < high and shape.top > low:
            smallest = min(smallest, float(distance(shape, px, py)))
    return smallest
