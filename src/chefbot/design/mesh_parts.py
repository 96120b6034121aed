"""A part's solids as triangles: closed, fine enough that the volume is right, and united where they touch."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.outline import Loop, Outline, points
from chefbot.robot.shapes import AXES, Ball, Prism, Solid, volume

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

DEVIATION = 2e-5
"""Metres between a true arc and its chords at most: less than a printer or a laser resolves."""
VOLUME_SHARE = 8e-4
"""Of a solid's volume that its chords may cut off or add at most."""
FINER = 0.7
"""From one try to the next, as long as the volume is too far off."""
GRID = 1e-6
"""Millimetres that corners are rounded to: faces that lie on each other then do so to the last bit."""
MILLI = 1e-3
SHARP = 45.0
"""Degrees between two triangles that make an edge; chords of an arc meet at 15 at most."""
BALL_TURN = (12.0, 23.0, 37.0)
"""Degrees about x, y, z: no edge of a ball then falls on an edge of the cup that it runs in."""


class Mesh(NamedTuple):
    """Vertices (n, 3) in metres, triangles (m, 3) counter-clockwise seen from outside; normals (n, 3) or None.

    With normals, a vertex on an edge stands there once for each face that meets in it.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    normals: NDArray[np.float64] | None = None

    @property
    def volume(self) -> float:
        """Cubic metres (divergence theorem)."""
        a, b, c = self.vertices[self.triangles.T]
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@lru_cache(maxsize=256)
def part_mesh(solids: tuple[Solid, ...], deviation: float = DEVIATION, shaded: bool = False) -> Mesh:
    """Solids of one part in the part's frame, arcs kept within `deviation` metres and the volume within
    VOLUME_SHARE; with normals if `shaded`.

    Prisms are united to one shell. A ball stays a shell of its own: it touches its cup along a line only, and
    has to turn in it.
    """
    prisms = [_prism(solid, deviation) for solid in solids if isinstance(solid, Prism)]
    balls = [_ball(solid, deviation) for solid in solids if isinstance(solid, Ball)]
    shells = [_united(prisms)] if prisms else []
    return joined([_mesh(body, shaded) for body in (*shells, *balls)])


def joined(meshes: list[Mesh]) -> Mesh:
    """Several as one, beside each other."""
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    triangles = [mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=True)]
    normals = [mesh.normals for mesh in meshes if mesh.normals is not None]
    return Mesh(
        np.vstack([mesh.vertices for mesh in meshes]),
        np.vstack(triangles),
        np.vstack(normals) if len(normals) == len(meshes) else None,
    )


def united(meshes: list[Mesh]) -> Mesh:
    """The union of closed meshes: bodies that touch or overlap become one."""
    return _mesh(_united([_body(mesh) for mesh in meshes]), shaded=False)


def placed(mesh: Mesh, turn: NDArray[np.float64], at: NDArray[np.float64]) -> Mesh:
    """Turned by the matrix (3, 3), then moved by `at` metres."""
    normals = None if mesh.normals is None else mesh.normals @ turn.T
    return Mesh(mesh.vertices @ turn.T + at, mesh.triangles, normals)


def _prism(prism: Prism, deviation: float) -> Manifold:
    from manifold3d import Manifold

    length = prism.length / MILLI
    body = Manifold.extrude(_section(prism.outline, deviation), length).translate((0.0, 0.0, -length / 2))
    return _on_grid(body.transform(_matrix(AXES[prism.axis], prism.at)))


def _section(outline: Outline, deviation: float) -> CrossSection:
    """In millimetres, as finely cut as its area asks for."""
    from manifold3d import CrossSection, FillRule

    exact = outline.moments().area
    while True:
        loops = [_millimetres(loop, deviation) for loop in (outline.edge, *outline.holes)]
        section = CrossSection(loops, FillRule.EvenOdd)
        if abs(section.area() * MILLI**2 - exact) <= VOLUME_SHARE * exact:
            return section
        deviation *= FINER


def _millimetres(loop: Loop, deviation: float) -> NDArray[np.float64]:
    return np.array(points(loop, deviation)) / MILLI


def _ball(ball: Ball, deviation: float) -> Manifold:
    from manifold3d import Manifold

    exact = volume(ball)
    while True:
        segments = int(np.ceil(np.pi / np.arccos(1.0 - min(deviation / ball.radius, 0.01))))
        body = Manifold.sphere(ball.radius / MILLI, segments)
        if abs(body.volume() * MILLI**3 - exact) <= VOLUME_SHARE * exact:
            return body.rotate(BALL_TURN).transform(_matrix(np.eye(3), ball.at))
        deviation *= FINER


def _matrix(turn: NDArray[np.float64], at: tuple[float, float, float]) -> NDArray[np.float64]:
    return np.column_stack([turn, np.array(at) / MILLI])


def _on_grid(body: Manifold) -> Manifold:
    return body.warp_batch(lambda corners: np.round(np.asarray(corners) / GRID) * GRID)


def _body(mesh: Mesh) -> Manifold:
    from manifold3d import Manifold, Mesh64

    return _on_grid(Manifold(Mesh64(mesh.vertices / MILLI, mesh.triangles.astype(np.uint64))))


def _united(bodies: list[Manifold]) -> Manifold:
    from manifold3d import Manifold, OpType

    return Manifold.batch_boolean(bodies, OpType.Add)


def _mesh(body: Manifold, shaded: bool) -> Mesh:
    found: Any = (body.calculate_normals(0, SHARP) if shaded else body).to_mesh64()
    corners = np.asarray(found.vert_properties)
    normals = corners[:, 3:6].copy() if shaded else None
    return Mesh(corners[:, :3] * MILLI, np.asarray(found.tri_verts).astype(np.int64), normals)
