"""What a simulated camera sees at one instant."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.section import Mount
from chefbot.sim.cameras.depth_holes import hole_array
from chefbot.sim.cameras.tag_faces import TagFace
from chefbot.sim.rays import mount_rotation
from chefbot.sim.world.shapes import ShapeArrays


class Capture(NamedTuple):
    """Input of a renderer: the camera's optical frame in the world, the solids, holes and tags at one instant.

    position: (3,) metres. rotation: (3, 3) from the optical frame (z forward, x right, y down) to the world. holes:
    (n, 5), see `hole_array`.
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    shapes: ShapeArrays
    holes: NDArray[np.float64] = hole_array(())
    tags: tuple[TagFace, ...] = ()


OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Rotation from the optical frame to the camera's body frame (REP-103)."""


def optical_frame(
    base: tuple[NDArray[np.float64], NDArray[np.float64]], mount: Mount, upside_down: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return position (3,) and rotation (3, 3) of a camera's optical frame; base: those of base_link in the world."""
    position, rotation = base
    at = position + rotation @ np.array([mount.x, mount.y, mount.z])
    optical = rotation @ mount_rotation(mount) @ OPTICAL
    return at, optical * np.array([-1.0, -1.0, 1.0]) if upside_down else optical
