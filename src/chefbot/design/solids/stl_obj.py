"""Parts and the assembled robot as STL and OBJ, for printers and for CAD."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.design.solids.triangulation import Mesh, part_mesh, placed, united
from chefbot.robot.geometry.shapes import AXES, Ball, Prism, Solid, rotation
from chefbot.robot.geometry.solids import RobotPart, link_origin, solids
from chefbot.robot.materials import RgbaColour
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from trimesh import Trimesh


class Piece(NamedTuple):
    """A mesh with the name, the material and the colour of its part."""

    name: str
    mesh: Mesh
    material: str
    colour: RgbaColour


def pieces(robot: Robot) -> list[Piece]:
    """Return every part of the robot without the payload, in base_link."""
    return [Piece(part.name, _in_base(robot, part), part.material, part.colour) for part in solids(robot)]


def united_robot(robot: Robot) -> Mesh:
    """Return all parts united in base_link; parts in contact are one body, a ball in its cup stays another."""
    return united([piece.mesh for piece in pieces(robot)])


def in_print_position(part: RobotPart) -> Piece:
    """Return a part in its printing position: lowest z = 0, on the largest end of a prism with nothing below.

    A part without such an end keeps its orientation.
    """
    mesh = part_mesh(part.solids)
    turned = placed(mesh, _turn_down(mesh, part.solids), np.zeros(3))
    lowest = float(turned.vertices[:, 2].min())
    return Piece(
        part.name, placed(turned, np.eye(3), np.array([0.0, 0.0, -lowest])), part.material, part.colour
    )


def stl(mesh: Mesh, scale: float = 1.0) -> bytes:
    """Return binary STL in single precision; `scale` units are one metre."""
    from trimesh import Trimesh

    data: bytes = Trimesh(mesh.vertices * scale, mesh.triangles, process=False).export(file_type="stl")
    return data


def obj(seen: list[Piece], library: str, scale: float = 1.0) -> tuple[bytes, bytes]:
    """Return an OBJ file with an object for each piece, and its material file with the name `library`."""
    from trimesh import Scene
    from trimesh.exchange.obj import export_obj

    scene = Scene([_named(piece, scale) for piece in seen])
    text, files = export_obj(scene, return_texture=True, mtl_name=library, include_normals=False)
    return text.encode(), files[library]


def _in_base(robot: Robot, part: RobotPart) -> Mesh:
    at = np.array(link_origin(robot, part.link)) + np.array(part.at)
    return placed(part_mesh(part.solids), rotation(part.pitch, part.yaw), at)


def _turn_down(mesh: Mesh, drawn: tuple[Solid, ...]) -> NDArray[np.float64]:
    """The rotation that puts the best end at the bottom."""
    best, down = 0.0, np.array([0.0, 0.0, -1.0])
    for solid in drawn:
        if isinstance(solid, Ball):
            continue
        for way in (-1.0, 1.0):
            outwards = way * AXES[solid.axis][:, 2]
            area = solid.outline.moments().area
            if area > best * (1.0 + 1e-9) and _is_outermost(mesh, solid, outwards):
                best, down = area, outwards
    return _rotation_to_down(down)


def _is_outermost(mesh: Mesh, prism: Prism, outwards: NDArray[np.float64]) -> bool:
    end = float(np.array(prism.at) @ outwards) + prism.length / 2
    return float((mesh.vertices @ outwards).max()) <= end + 1e-8


def _rotation_to_down(down: NDArray[np.float64]) -> NDArray[np.float64]:
    """About one of the axes, by quarter turns."""
    x, y, z = (round(float(value)) for value in down)
    if z:
        return np.eye(3) if z < 0 else np.diag([1.0, -1.0, -1.0])
    if y:
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, y], [0.0, -y, 0.0]])
    return np.array([[0.0, 0.0, x], [0.0, 1.0, 0.0], [-x, 0.0, 0.0]])


def _named(piece: Piece, scale: float) -> Trimesh:
    from trimesh import Trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import SimpleMaterial

    colour = np.round(255.0 * np.array(piece.colour)).astype(np.uint8)
    look = TextureVisuals(material=SimpleMaterial(diffuse=colour, name=piece.material.replace(" ", "_")))
    vertices, metadata = piece.mesh.vertices * scale, {"name": piece.name}
    return Trimesh(vertices, piece.mesh.triangles, process=False, visual=look, metadata=metadata)
