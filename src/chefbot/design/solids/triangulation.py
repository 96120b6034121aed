"""A part's solids as closed triangle meshes of bounded volume error, united where they touch."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.outline import Loop, Outline, points
from chefbot.robot.geometry.shapes import AXES, Ball, Prism, Solid, volume

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

DEVIATION = 2e-5
"""Metres between a true arc and its chords at most: less than a printer or a laser resolves."""
VOLUME_SHARE = 8e-4
"""Maximum volume error over the volume of a solid."""
MIN_OUTLINE_SHARE = 0.01
"""Minimum remaining share of an outline with holes for which the volume error is bounded."""
REFINEMENT_FACTOR = 0.7
"""Factor between refinements while the volume error is too large."""
COORDINATE_TOLERANCE = 1e-6
"""Millimetres: coordinates that differ by less are rounding errors of the same one."""
MILLI = 1e-3
MIN_EDGE_ANGLE = 45.0
"""Degrees between two triangles that make an edge; chords of an arc meet at 15 at most."""
BALL_TURN = (12.0, 23.0, 37.0)
"""Rotation of balls about x, y, z, degrees, so that their edges miss those of the cup."""


class Mesh(NamedTuple):
    """Vertices (n, 3) in metres, triangles (m, 3) counter-clockwise seen from outside; normals (n, 3) or None.

    With normals, a vertex on an edge is repeated for each of its faces.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    normals: NDArray[np.float64] | None = None

    @property
    def volume(self) -> float:
        """Return the volume in cubic metres (divergence theorem)."""
        a, b, c = self.vertices[self.triangles.T]
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@lru_cache(maxsize=256)
def part_mesh(solids: tuple[Solid, ...], deviation: float = DEVIATION, shaded: bool = False) -> Mesh:
    """Return the mesh of a part's solids in the part's frame, with normals if `shaded`.

    Arcs are accurate to `deviation` metres and the volume to VOLUME_SHARE. Prisms are united to one shell. A
    ball stays a shell of its own: it touches its cup along a line only, and must turn in it.
    """
    prisms = [_mesh(_prism(solid, deviation)) for solid in solids if isinstance(solid, Prism)]
    balls = [_mesh(_ball(solid, deviation), shaded) for solid in solids if isinstance(solid, Ball)]
    return joined([*([united(prisms, shaded)] if prisms else []), *balls])


def joined(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one without uniting them."""
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    triangles = [mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=True)]
    normals = [mesh.normals for mesh in meshes if mesh.normals is not None]
    return Mesh(
        np.vstack([mesh.vertices for mesh in meshes]),
        np.vstack(triangles),
        np.vstack(normals) if len(normals) == len(meshes) else None,
    )


def united(meshes: list[Mesh], shaded: bool = False) -> Mesh:
    """Return the union of closed meshes without normals: bodies that touch or overlap become one."""
    from manifold3d import Manifold, Mesh64, OpType

    ends = np.cumsum([len(mesh.vertices) for mesh in meshes])
    corners = _together(np.vstack([mesh.vertices for mesh in meshes]) / MILLI)
    bodies = [
        Manifold(Mesh64(np.ascontiguousarray(own), mesh.triangles.astype(np.uint64)))
        for own, mesh in zip(np.split(corners, ends[:-1]), meshes, strict=True)
    ]
    return _mesh(Manifold.batch_boolean(bodies, OpType.Add), shaded)


def _together(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coordinates (n, 3) with nearly equal values made equal, so that touching faces coincide."""
    result = np.empty_like(corners)
    for axis, values in enumerate(corners.T):
        order = np.argsort(values)
        rising = values[order]
        fresh = np.append(True, np.diff(rising) > COORDINATE_TOLERANCE)
        result[order, axis] = rising[fresh][np.cumsum(fresh) - 1]
    return result


def placed(mesh: Mesh, turn: NDArray[np.float64], at: NDArray[np.float64]) -> Mesh:
    """Return the mesh rotated by a matrix (3, 3), then shifted by `at` metres."""
    normals = None if mesh.normals is None else mesh.normals @ turn.T
    return Mesh(mesh.vertices @ turn.T + at, mesh.triangles, normals)


def _prism(prism: Prism, deviation: float) -> Manifold:
    from manifold3d import Manifold

    length = prism.length / MILLI
    body = Manifold.extrude(_section(prism.outline, deviation), length).translate((0.0, 0.0, -length / 2))
    return body.transform(_matrix(AXES[prism.axis], prism.at))


def _section(outline: Outline, deviation: float) -> CrossSection:
    """The section in millimetres, as fine as its area requires; holes may overlap."""
    from manifold3d import CrossSection, FillRule

    exact = outline.moments().area
    bound = VOLUME_SHARE * max(exact, MIN_OUTLINE_SHARE * Outline(outline.edge).moments().area)
    while True:
        edge, *holes = (_millimetres(loop, deviation) for loop in (outline.edge, *outline.holes))
        area = _area(edge) - sum(map(_area, holes))
        if abs(area * MILLI**2 - exact) <= bound:
            return CrossSection([edge], FillRule.NonZero) - CrossSection(holes, FillRule.NonZero)
        deviation *= REFINEMENT_FACTOR


def _area(polygon: NDArray[np.float64]) -> float:
    """Of corners (n, 2), whichever way round (shoelace formula)."""
    x, y = polygon.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0


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
        deviation *= REFINEMENT_FACTOR


def _matrix(turn: NDArray[np.float64], at: tuple[float, float, float]) -> NDArray[np.float64]:
    return np.column_stack([turn, np.array(at) / MILLI])


def _mesh(body: Manifold, shaded: bool = False) -> Mesh:
    found: Any = (body.calculate_normals(0, MIN_EDGE_ANGLE) if shaded else body).to_mesh64()
    corners = np.asarray(found.vert_properties)
    normals = corners[:, 3:6].copy() if shaded else None
    return Mesh(corners[:, :3] * MILLI, np.asarray(found.tri_verts).astype(np.int64), normals)
