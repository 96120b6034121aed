"""Primitive solids and their exact mass properties."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.outline import Outline

Vector = tuple[float, float, float]
TENSOR = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
"""Names of the components of an inertia tensor, in the order of MassProperties."""
Axis = Literal["x", "y", "z"]
ORIGIN: Vector = (0.0, 0.0, 0.0)
AXES: dict[str, NDArray[np.float64]] = {
    "x": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
}
"""Rotations from a prism's own axes (u and v in the outline, w along the extrusion) to x, y and z: the
outline of a prism along x is drawn in (y, z), along y in (x, z), along z in (x, y)."""


class Prism(NamedTuple):
    """An outline in metres extruded by `length`; `at` is where the outline's origin lies at mid-extrusion."""

    outline: Outline
    length: float
    axis: Axis = "z"
    at: Vector = ORIGIN


class Ball(NamedTuple):
    """A sphere with radius and centre in metres."""

    radius: float
    at: Vector = ORIGIN


Solid = Prism | Ball


class VolumeMoments(NamedTuple):
    """Volume integrals of a solid: of 1, of the position r (3,), and of r r^T (3, 3)."""

    volume: float
    first: NDArray[np.float64]
    second: NDArray[np.float64]


class MassProperties(NamedTuple):
    """Mass in kg; centre in metres; (ixx, iyy, izz, ixy, ixz, iyz) about the centre in kg m^2."""

    mass: float
    centre: Vector
    inertia: tuple[float, float, float, float, float, float]


@lru_cache(maxsize=4096)
def volume_moments(solid: Solid) -> VolumeMoments:
    """Return the exact volume integrals of a solid about the origin of the frame it is drawn in."""
    centred = _ball_spread(solid.radius) if isinstance(solid, Ball) else _prism_spread(solid)
    return transform_moments(centred, np.eye(3), np.array(solid.at))


def transform_moments(
    integrals: VolumeMoments, rotation: NDArray[np.float64], shift: NDArray[np.float64]
) -> VolumeMoments:
    """Return the integrals of the same volume rotated and then translated (parallel-axis theorem)."""
    # First moment and second moment in the rotated frame: R f and R S R^T.
    first = rotation @ integrals.first
    second = rotation @ integrals.second @ rotation.T
    # Parallel-axis theorem: S' = S + t f^T + f t^T + V t t^T.
    cross = np.outer(shift, first)
    return VolumeMoments(
        integrals.volume,
        first + integrals.volume * shift,
        second + cross + cross.T + integrals.volume * np.outer(shift, shift),
    )


def mass_properties(spreads: Iterable[tuple[VolumeMoments, float]]) -> MassProperties:
    """Return the mass properties of volumes with their densities in kg/m^3."""
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for integrals, density in spreads:
        mass += density * integrals.volume
        first = first + density * integrals.first
        second = second + density * integrals.second
    centre = first / mass
    # Second moment about the centre of mass, then the inertia tensor I = tr(S) 1 - S.
    about_centre = second - mass * np.outer(centre, centre)
    tensor = np.trace(about_centre) * np.eye(3) - about_centre
    components = (tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2])
    ixx, iyy, izz, ixy, ixz, iyz = (float(value) for value in components)
    x, y, z = centre.tolist()
    return MassProperties(float(mass), (x, y, z), (ixx, iyy, izz, ixy, ixz, iyz))


def volume(solid: Solid) -> float:
    """Return the volume of a solid in cubic metres, in closed form."""
    return volume_moments(solid).volume


def _ball_spread(radius: float) -> VolumeMoments:
    # Second moment of a sphere: 4/15 pi r^5 per axis.
    return VolumeMoments(
        4.0 / 3.0 * math.pi * radius**3, np.zeros(3), np.eye(3) * 4.0 / 15.0 * math.pi * radius**5
    )


def _prism_spread(prism: Prism) -> VolumeMoments:
    m, length = prism.outline.moments(), prism.length
    # Moments of the outline's area times length; along the extrusion A l^3 / 12.
    first = np.array([m.x, m.y, 0.0]) * length
    second = np.array([[m.xx, m.xy, 0.0], [m.xy, m.yy, 0.0], [0.0, 0.0, m.area * length**2 / 12.0]]) * length
    return transform_moments(VolumeMoments(m.area * length, first, second), AXES[prism.axis], np.zeros(3))


def rotation(pitch: float, yaw: float) -> NDArray[np.float64]:
    """Return the rotation matrix (3, 3): first about y by `pitch`, then about z by `yaw` (REP-103)."""
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    return np.array([[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0.0, cp]])
