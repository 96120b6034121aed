"""The robot as a coloured GLB (https://registry.khronos.org/glTF/specs/2.0): a node for each link.

Geometry is in metres in the link's own frame (REP-103, z up); only the root node is turned, for glTF is y up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chefbot.design.export.links import UrdfLink, links
from chefbot.design.solids.triangulation import part_mesh
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.shapes import Vector, rotation
from chefbot.robot.geometry.solids import RobotPart
from chefbot.robot.materials import RgbaColour
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from trimesh import Scene, Trimesh
    from trimesh.visual.material import PBRMaterial

Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""Rotation from the robot's x, y, z to glTF's x, z, -y, in which y is up."""
ROUGHNESS = 0.65
"""glTF's roughness of all materials; none is metallic, because there is no room to reflect."""


def glb(robot: Robot) -> bytes:
    """Return all links with mass as one binary file.

    A node has the name of its link and contains a node for each part. The node of a sensor has the name and
    the place of its frame.
    """
    return _binary(_scene(robot))


def part_glb(part: RobotPart) -> bytes:
    """Return a single part in its own frame."""
    from trimesh import Scene

    scene = Scene(base_frame="part", metadata={})
    scene.geometry[part.name] = _coloured(part)
    scene.graph.update(part.name, "part", matrix=Y_UP, geometry=part.name, metadata=_extras(part))
    return _binary(scene)


def _binary(scene: Scene) -> bytes:
    data: bytes = scene.export(file_type="glb", include_normals=True, unitize_normals=True)
    return data


def _extras(part: RobotPart) -> dict[str, object]:
    return {"kind": part.kind, "material": part.material, "mass": part.mass}


def _scene(robot: Robot) -> Scene:
    from trimesh import Scene

    scene = Scene(base_frame=robot.name, metadata={})
    meshes: dict[tuple[object, ...], str] = {}  # equal parts share one mesh, named like the first of them
    frames = {name.removesuffix("_link"): name for name in robot.sensors.by_frame}
    for link in links(robot):
        _hang_link(scene, robot, link)
    for link in links(robot):
        for part in link.parts:
            node = frames.get(part.name, part.name)
            shared = meshes.setdefault((part.solids, part.material, part.colour), node)
            _hang_part(scene, link, part, node, shared)
    return scene


def _hang_part(scene: Scene, link: UrdfLink, part: RobotPart, node: str, mesh: str) -> None:
    if node in scene.graph.nodes:
        raise RobotFileError(f"equipment of the robot file is called {node!r}, which is taken; rename it")
    if mesh not in scene.geometry:
        scene.geometry[mesh] = _coloured(part)
    place = _matrix(rotation(part.pitch, part.yaw), part.at)
    scene.graph.update(node, link.name, matrix=place, geometry=mesh, metadata=_extras(part))


def _hang_link(scene: Scene, robot: Robot, link: UrdfLink) -> None:
    """base_link under the root, all others under base_link."""
    root = link.name == "base_link"
    matrix = Y_UP if root else _matrix(np.eye(3), link.at)
    inertia = link.inertia
    extras = {"mass": inertia.mass, "centre": list(inertia.centre), "inertia": list(inertia.inertia)}
    scene.graph.update(
        link.name, robot.name if root else "base_link", matrix=matrix, metadata={"link": link.name, **extras}
    )


def _matrix(turn: NDArray[np.float64], at: Vector) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, at
    return matrix


def _coloured(part: RobotPart) -> Trimesh:
    from trimesh import Trimesh
    from trimesh.visual import TextureVisuals

    mesh = part_mesh(part.solids, shaded=True)
    return Trimesh(
        mesh.vertices,
        mesh.triangles,
        vertex_normals=mesh.normals,
        process=False,
        visual=TextureVisuals(material=_material(part.material, part.colour)),
    )


def _material(name: str, colour: RgbaColour) -> PBRMaterial:
    from trimesh.visual.material import PBRMaterial

    red, green, blue, opacity = colour
    return PBRMaterial(
        name=name,
        baseColorFactor=[*map(_linear, (red, green, blue)), opacity],
        metallicFactor=0.0,
        roughnessFactor=ROUGHNESS,
        alphaMode="OPAQUE" if opacity == 1.0 else "BLEND",
    )


def _linear(share: float) -> float:
    """Linear intensity of an sRGB component, as glTF requires (IEC 61966-2-1)."""
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4
