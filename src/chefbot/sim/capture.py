"""What the simulated depth camera sees at one instant."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.sim.depth_holes import hole_array
from chefbot.sim.world.shapes import ShapeArrays


class Capture(NamedTuple):
    """Input of the depth renderer: the camera's optical frame in the world and the solids at one instant.

    position: (3,) metres. rotation: (3, 3) from the optical frame (z forward, x right, y down) to the world. holes:
    (n, 5), see `hole_array`.
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    shapes: ShapeArrays
    holes: NDArray[np.float64] = hole_array(())


OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Rotation from the optical frame to the camera's body frame (REP-103)."""
