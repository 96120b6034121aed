"""The solids of all people at once, as flat arrays for the kernels, and their poses for MuJoCo."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chefbot.maths.se2 import SE2
from chefbot.sim.people.walkers import Floats, Walkers
from chefbot.sim.world.furniture import person_shapes
from chefbot.sim.world.shapes import ShapeArrays, SimulatedShape, shape_arrays


class Bodies:
    """Legs, trunk and head of `count` people."""

    def __init__(self, count: int) -> None:
        self.shapes: list[tuple[SimulatedShape, ...]] = [person_shapes(i) for i in range(count)]
        self._own = shape_arrays([shape for shapes in self.shapes for shape in shapes])
        self._owner = np.repeat(np.arange(count), [len(shapes) for shapes in self.shapes])

    def arrays(self, walkers: Walkers) -> ShapeArrays:
        """Return all solids where the people are; all are round, so that their yaw does not matter."""
        heading = walkers.heading[self._owner]
        x, y = self._own.centre[:, 0], self._own.centre[:, 1]
        centre = self._own.centre.copy()
        centre[:, 0] = walkers.position[self._owner, 0] + heading[:, 0] * x - heading[:, 1] * y
        centre[:, 1] = walkers.position[self._owner, 1] + heading[:, 1] * x + heading[:, 0] * y
        return self._own._replace(centre=centre)


def poses_of(walkers: Walkers) -> list[SE2]:
    """Return the poses of all people, x forward."""
    rows = zip(walkers.position.tolist(), walkers.heading.tolist(), strict=True)
    return [SE2(x, y, math.atan2(uy, ux)) for (x, y), (ux, uy) in rows]


@njit(cache=True, nogil=True)
def write_poses(position: Floats, heading: Floats, mocap_pos: Floats, mocap_quat: Floats) -> None:
    """Write the poses of n people into the last rows of MuJoCo's positions (m, 3) and quaternions (m, 4), w x y z."""
    first = len(mocap_pos) - len(position)
    for i in range(len(position)):
        mocap_pos[first + i, 0], mocap_pos[first + i, 1] = position[i, 0], position[i, 1]
        # Cosine and sine of half the yaw from the cosine.
        ux, uy = heading[i, 0], heading[i, 1]
        half_sine = math.sqrt(max(0.5 * (1.0 - ux), 0.0))
        mocap_quat[first + i, 0] = math.sqrt(max(0.5 * (1.0 + ux), 0.0))
        mocap_quat[first + i, 3] = half_sine if uy >= 0.0 else -half_sine
