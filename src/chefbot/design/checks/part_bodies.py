"""The parts of a robot as closed meshes in base_link, ready for boolean operations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chefbot.design.solids.triangulation import part_mesh
from chefbot.robot.geometry.shapes import Solid, rotation
from chefbot.robot.geometry.solids import RobotPart, link_origin, payload, solids
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from manifold3d import Manifold

DEVIATION = 4e-6
"""Metres between arcs and their polygons: fine enough that a shaft in its bore shares no volume."""


PAIRS = 1 << 14
"""Number of pairs of bodies of which a check remembers what it found: a robot has a thousand."""


@dataclass(frozen=True, eq=False)
class PartBody:
    """A part, its closed surface in base_link, and the corners of its bounding box.

    There is one object for each part and place, which also serves as a key.
    """

    part: RobotPart
    surface: Manifold
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @property
    def name(self) -> str:
        """Return the name of the part."""
        return self.part.name


def bodies(robot: Robot) -> tuple[PartBody, ...]:
    """Return the bodies of all parts and of the payload."""
    return tuple(_placed(part, link_origin(robot, part.link)) for part in (*solids(robot), payload(robot)))


def room_of_box(robot: Robot, box: PartBody) -> float:
    """Return the distance of the outermost corner of the bounding box from the edge of the body, m."""
    (x0, y0), (x1, y1) = box.low[:2].tolist(), box.high[:2].tolist()
    return min(robot.body.plate.room(x, y) for x in (x0, x1) for y in (y0, y1))


def named(robot: Robot, *names: str) -> list[PartBody]:
    """Return the parts with these names; unknown names are left out: a moved sensor may need no stand."""
    parts = [part for part in (*solids(robot), payload(robot)) if part.name in names]
    return [_placed(part, link_origin(robot, part.link)) for part in parts]


def placement(turn: NDArray[np.float64], shift: Any) -> NDArray[np.float64]:
    """Return the transform (3, 4) of a part into base_link: rotation, then translation."""
    return np.column_stack([turn, np.asarray(shift, dtype=float)])


@lru_cache(maxsize=4096)
def _placed(part: RobotPart, origin: tuple[float, float, float]) -> PartBody:
    turn = rotation(part.pitch, part.yaw)
    surface = _surface(part.solids).transform(placement(turn, np.add(part.at, origin)))
    box = np.array(surface.bounding_box())
    return PartBody(part, surface, box[:3], box[3:])


@lru_cache(maxsize=4096)
def _surface(pieces: tuple[Solid, ...]) -> Manifold:
    from manifold3d import Manifold, Mesh64, OpType

    meshes = [part_mesh((piece,), DEVIATION) for piece in pieces]
    made = [Manifold(Mesh64(mesh.vertices, mesh.triangles.astype(np.uint64))) for mesh in meshes]
    return Manifold.batch_boolean(made, OpType.Add)
