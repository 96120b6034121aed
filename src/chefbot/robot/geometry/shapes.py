"""Simple solids and their exact mass properties."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.outline import Outline

Vector = tuple[float, float, float]
Axis = Literal["x", "y", "z"]
ORIGIN: Vector = (0.0, 0.0, 0.0)
AXES: dict[str, NDArray[np.float64]] = {
    "x": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
}
"""Rotations from a prism's own axes (u and v in the outline, w along it) to x, y and z: an outline across x
is drawn in (y, z), one across y in (x, z), one across z in (x, y)."""


class Prism(NamedTuple):
    """An outline, metres, extruded by `length`; `at` is the middle of the extrusion at the outline's origin."""

    outline: Outline
    length: float
    axis: Axis = "z"
    at: Vector = ORIGIN


class Ball(NamedTuple):
    """A sphere, metres."""

    radius: float
    at: Vector = ORIGIN


Solid = Prism | Ball


class Spread(NamedTuple):
    """Integrals over a volume: of 1, of the position r (3,), and of r r^T (3, 3)."""

    volume: float
    first: NDArray[np.float64]
    second: NDArray[np.float64]


class MassProperties(NamedTuple):
    """Mass in kg; centre in metres; (ixx, iyy, izz, ixy, ixz, iyz) about the centre in kg m^2."""

    mass: float
    centre: Vector
    inertia: tuple[float, float, float, float, float, float]


@lru_cache(maxsize=4096)
def spread(solid: Solid) -> Spread:
    """Exact, about the origin of the frame that the solid is drawn in."""
    own = _ball_spread(solid.radius) if isinstance(solid, Ball) else _prism_spread(solid)
    return moved(own, np.eye(3), np.array(solid.at))


def moved(own: Spread, rotation: NDArray[np.float64], shift: NDArray[np.float64]) -> Spread:
    """The same volume turned and then shifted (parallel-axis theorem)."""
    first = rotation @ own.first
    second = rotation @ own.second @ rotation.T
    cross = np.outer(shift, first)
    return Spread(
        own.volume,
        first + own.volume * shift,
        second + cross + cross.T + own.volume * np.outer(shift, shift),
    )


def mass_properties(spreads: Iterable[tuple[Spread, float]]) -> MassProperties:
    """Of volumes with their densities in kg/m^3."""
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for volume, density in spreads:
        mass += density * volume.volume
        first = first + density * volume.first
        second = second + density * volume.second
    centre = first / mass
    about_centre = second - mass * np.outer(centre, centre)
    tensor = np.trace(about_centre) * np.eye(3) - about_centre
    upper = (tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2])
    ixx, iyy, izz, ixy, ixz, iyz = (float(value) for value in upper)
    x, y, z = centre.tolist()
    return MassProperties(float(mass), (x, y, z), (ixx, iyy, izz, ixy, ixz, iyz))


def volume(solid: Solid) -> float:
    """Cubic metres, by the closed formula."""
    return spread(solid).volume


def _ball_spread(radius: float) -> Spread:
    return Spread(4.0 / 3.0 * math.pi * radius**3, np.zeros(3), np.eye(3) * 4.0 / 15.0 * math.pi * radius**5)


def _prism_spread(prism: Prism) -> Spread:
    m, length = prism.outline.moments(), prism.length
    first = np.array([m.x, m.y, 0.0]) * length
    second = np.array([[m.xx, m.xy, 0.0], [m.xy, m.yy, 0.0], [0.0, 0.0, m.area * length**2 / 12.0]]) * length
    return moved(Spread(m.area * length, first, second), AXES[prism.axis], np.zeros(3))


def rotation(pitch: float, yaw: float) -> NDArray[np.float64]:
    """First about y by `pitch`, then about z by `yaw` (REP-103)."""
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    return np.array([[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0.0, cp]])
