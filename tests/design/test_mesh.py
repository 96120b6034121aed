"""Solids as triangles and as true arcs: closed, as large and as heavy as the formulas say, in their places."""

from __future__ import annotations

import csv
import io
import json
import math
import struct
import subprocess
import sys
from importlib.util import find_spec
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.design.export.links import links
from chefbot.design.solids.bill_of_materials import bill, bill_csv, box
from chefbot.design.solids.glb import glb, part_glb
from chefbot.design.solids.rasterizer import rasterize
from chefbot.design.solids.renderer import RenderedBody, picture
from chefbot.design.solids.stl_obj import Piece, in_print_position, obj, pieces, stl, united_robot
from chefbot.design.solids.triangulation import Mesh, part_mesh
from chefbot.maths.outline import Outline, circle, rectangle
from chefbot.robot.chassis import Equipment
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.layout import body_height
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.geometry.shapes import (
    Ball,
    MassProperties,
    Prism,
    Solid,
    mass_properties,
    rotation,
    volume_moments,
)
from chefbot.robot.geometry.solids import RobotPart, payload, solids
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.section import MountingPosition, Size
from chefbot.robot.spec import Robot
from chefbot.robot.validation import check_buildable

ROBOTS = sorted(built_in_robots())
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def all_parts() -> list[RobotPart]:
    """One of each shape."""
    robots = [load_robot(name) for name in ROBOTS]
    return list({part.solids: part for robot in robots for part in (*solids(robot), payload(robot))}.values())


def as_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.triangles)


def difference(mesh: Mesh, part: RobotPart) -> float:
    """Largest relative error of volume, centre and inertia against the exact ones, in the part's frame."""
    exact = mass_properties([(volume_moments(solid), 1.0) for solid in part.solids])
    found = as_trimesh(mesh)
    found.density = 1.0
    return unlike(exact, found.volume, found.center_mass, found.moment_inertia)


def unlike(exact: MassProperties, volume: float, centre: Any, inertia: Any) -> float:
    xx, yy, zz, xy, xz, yz = exact.inertia
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    size = math.sqrt(np.trace(tensor) / exact.mass)
    errors = [abs(volume / exact.mass - 1.0), *(np.abs(np.array(centre) - exact.centre) / size)]
    return float(max(*errors, np.abs(np.array(inertia) - tensor).max() / np.abs(tensor).max()))


@pytest.mark.parametrize("part", all_parts(), ids=lambda part: part.name)
def test_every_part_mesh_is_closed_and_has_the_exact_volume(part: RobotPart) -> None:
    mesh = part_mesh(part.solids)
    closed = as_trimesh(mesh)
    assert closed.is_watertight
    assert closed.is_winding_consistent
    balls = sum(isinstance(solid, Ball) for solid in part.solids)
    assert closed.body_count == balls + (len(part.solids) > balls), (
        "prisms that touch are one, a ball runs free"
    )
    assert mesh.volume == pytest.approx(part.volume, rel=1e-3)
    assert difference(mesh, part) < 2e-3


def test_a_hole_larger_than_its_disc_gives_an_empty_section() -> None:
    from chefbot.design.solids.triangulation import _section

    disc = Outline(circle(0.01), (circle(0.0101),))
    assert _section(disc, 1e-5).is_empty()
    foil = Outline(circle(0.01), (circle(0.009999),))
    assert _section(foil, 1e-5).area() == pytest.approx(foil.moments().area * 1e6, rel=0.1)


def is_round(solid: Solid) -> bool:
    if isinstance(solid, Ball):
        return True
    return any(corner.bulge for loop in (solid.outline.edge, *solid.outline.holes) for corner in loop)


@pytest.mark.rotated("meshes of any fineness")
@pytest.mark.slow
def test_finer_chords_approach_the_true_mass() -> None:
    for part in all_parts():
        if not any(is_round(solid) for solid in part.solids):
            assert difference(part_mesh(part.solids), part) < 1e-8
            continue
        coarse = difference(part_mesh(part.solids, 2e-6), part)
        fine = difference(part_mesh(part.solids, 2e-7), part)
        assert fine < 0.2 * coarse, part.name
        assert fine < 2e-4, part.name


@pytest.mark.rotated("meshes of any fineness")
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.slow
def test_the_assembly_is_one_closed_mesh_without_overlaps(name: str) -> None:
    robot = load_robot(name)
    united = united_robot(robot)
    read = trimesh.load(io.BytesIO(stl(united)), file_type="stl")
    assert read.is_watertight
    assert read.volume == pytest.approx(sum(part.volume for part in solids(robot)), rel=1e-3)
    assert read.bounds[0][2] == pytest.approx(0.0, abs=1e-3), "stands on the floor"
    assert read.bounds[1][2] >= body_height(robot) - 1e-6


factor = st.floats(0.8, 1.25)


@pytest.mark.rotated("meshes of any fineness")
@pytest.mark.slow
@given(st.sampled_from(ROBOTS), st.integers(1, 4), factor, factor, factor)
@settings(max_examples=5)
def test_the_assembly_is_closed_for_any_dimensions(
    name: str, plates: int, plate: float, clamp: float, wheel: float
) -> None:
    """Heights that no longer are round numbers: faces touch up to rounding errors only."""
    robot = load_robot(name)
    robot = msgspec.structs.replace(
        robot,
        plates=scaled(robot.plates, "thickness", plate, count=plates),
        motor_clamp=scaled(robot.motor_clamp, "thickness", clamp),
        wheels=scaled(robot.wheels, "diameter", wheel),
    )
    try:
        check_buildable(robot, "robot")
        parts = solids(robot)
    except (RobotFileError, IndexError):  # an impossible one, or a box on a plate that is gone
        assume(False)
    assert as_trimesh(united_robot(robot)).is_watertight
    assert all(as_trimesh(part_mesh(part.solids)).is_watertight for part in parts)


def scaled(section: Any, field: str, by: float, **others: Any) -> Any:
    return msgspec.structs.replace(section, **{field: by * getattr(section, field)}, **others)


@pytest.mark.parametrize("name", ROBOTS)
def test_glb_has_every_link_part_and_colour_in_place(name: str) -> None:
    robot = load_robot(name)
    data = glb(robot)
    scene = trimesh.load(io.BytesIO(data), file_type="glb", process=False)
    frames = {frame.removesuffix("_link"): frame for frame in robot.sensors.by_frame}
    for piece in pieces(robot):
        transform, mesh = scene.graph[frames.get(piece.name, piece.name)]
        seen = trimesh.transform_points(scene.geometry[mesh].vertices, transform) @ Z_UP.T
        assert seen.min(axis=0) == pytest.approx(piece.mesh.vertices.min(axis=0), abs=1e-6), piece.name
        assert seen.max(axis=0) == pytest.approx(piece.mesh.vertices.max(axis=0), abs=1e-6), piece.name
        material = scene.geometry[mesh].visual.material
        assert material.name == piece.material
    for mesh in scene.geometry.values():
        bare = trimesh.Trimesh(mesh.vertices, mesh.faces)
        bare.merge_vertices(merge_norm=True)
        assert bare.is_watertight


def test_a_link_node_has_the_frame_and_mass_of_its_link() -> None:
    robot = load_robot("chefbot_lidar")
    document = read_json(glb(robot))
    nodes = {node["name"]: node for node in document["nodes"]}
    for link in links(robot):
        assert nodes[link.name]["extras"]["mass"] == pytest.approx(link.inertia.mass, rel=1e-12)
        within = [document["nodes"][child] for child in nodes[link.name]["children"]]
        masses = [node["extras"]["mass"] for node in within if "kind" in node["extras"]]
        assert sum(masses) == pytest.approx(link.inertia.mass, rel=1e-12)
        if link.name != "base_link":
            assert nodes[link.name]["matrix"][12:15] == pytest.approx(list(link.at))
    mount = robot.sensors.by_frame["camera_link"].mount
    turn = np.array(nodes["camera_link"]["matrix"]).reshape(4, 4).T
    assert turn[:3, :3] == pytest.approx(rotation(mount.pitch, mount.yaw))
    assert turn[:3, 3] == pytest.approx([mount.x, mount.y, mount.z])
    assert {m["pbrMetallicRoughness"]["metallicFactor"] for m in document["materials"]} == {0.0}


def read_json(data: bytes) -> dict[str, Any]:
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    (size,) = struct.unpack_from("<I", data, 12)
    document: dict[str, Any] = json.loads(data[20 : 20 + size])
    return document


def test_glb_colours_are_linear_values_of_the_srgb_colours() -> None:
    robot = load_robot("chefbot")
    part = next(part for part in solids(robot) if part.name == "base_plate")
    (material,) = read_json(part_glb(part))["materials"]
    linear = np.array(material["pbrMetallicRoughness"]["baseColorFactor"])
    shown = 1.055 * linear[:3] ** (1 / 2.4) - 0.055
    assert shown == pytest.approx(part.colour[:3], abs=0.02)


def test_equipment_with_a_used_name_is_refused() -> None:
    robot = load_robot("chefbot")
    for name in ("base_link", "payload_link", "assembly"):
        box_of_tricks = Equipment(
            name=name, place=MountingPosition(), size=Size(x=0.01, y=0.01, z=0.01), mass=0.1
        )
        other: Robot = msgspec.structs.replace(robot, equipment=(box_of_tricks,))
        with pytest.raises(RobotFileError, match=name):
            glb(other)
            bill(other)


@pytest.mark.parametrize("scale", [1.0, 1000.0])
@pytest.mark.slow
def test_stl_and_obj_round_trip(scale: float) -> None:
    robot = load_robot("chefbot")
    for item in bill(robot):
        piece = in_print_position(item.part)
        read = trimesh.load(io.BytesIO(stl(piece.mesh, scale)), file_type="stl")
        text, looks = obj([piece], "looks.mtl", scale)
        again = trimesh.load(io.BytesIO(text), file_type="obj", force="mesh")
        for mesh in (read, again):
            assert mesh.is_watertight, item.name
            assert mesh.volume == pytest.approx(piece.mesh.volume * scale**3, rel=1e-4)
        assert b"mtllib looks.mtl" in text
        assert f"newmtl {item.part.material.replace(' ', '_')}".encode() in looks


def test_the_assembly_as_obj_names_every_part() -> None:
    robot = load_robot("chefbot")
    text, looks = obj(pieces(robot), "assembly.mtl")
    names = [line[2:].decode() for line in text.splitlines() if line.startswith(b"o ")]
    assert names == [part.name for part in solids(robot)]
    used = {line.split()[1] for line in text.splitlines() if line.startswith(b"usemtl")}
    assert used == {line.split()[1] for line in looks.splitlines() if line.startswith(b"newmtl")}


@pytest.mark.parametrize("part", all_parts(), ids=lambda part: part.name)
def test_a_part_lies_flat_on_the_print_bed(part: RobotPart) -> None:
    mesh = in_print_position(part).mesh
    assert mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-12)
    assert mesh.volume == pytest.approx(part_mesh(part.solids).volume, rel=1e-9)
    corners = mesh.vertices[mesh.triangles]
    on_bed = (np.abs(corners[:, :, 2]) < 1e-7).all(axis=1)
    a, b, c = np.moveaxis(corners[on_bed][:, :, :2], 1, 0)
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum() / 2
    ends = [s.outline.moments().area for s in part.solids if isinstance(s, Prism)]
    assert area == pytest.approx(max(ends), rel=2e-3)


@pytest.mark.parametrize("name", ROBOTS)
def test_bill_of_materials_has_the_robot_mass_and_empty_prices(name: str) -> None:
    robot = load_robot(name)
    items = bill(robot)
    assert sum(item.mass for item in items) == pytest.approx(unloaded_mass(robot), rel=1e-12)
    assert sum(item.number for item in items) == len(solids(robot))
    rows = list(csv.DictReader(io.StringIO(bill_csv(items).decode())))
    assert [row["part"] for row in rows] == [item.name for item in items]
    assert len({row["part"] for row in rows}) == len(rows)
    assert {row["price_each"] for row in rows} == {""}
    wheel = next(row for row in rows if row["part"] == "wheel")
    assert float(wheel["x_mm"]) == pytest.approx(robot.wheels.diameter * 1e3)
    assert wheel["count"] == "2"


@pytest.mark.rotated("meshes of any fineness")
@pytest.mark.parametrize("part", all_parts(), ids=lambda part: part.name)
def test_the_bounding_box_of_a_part_is_tight(part: RobotPart) -> None:
    size, seen = np.array(box(part.solids)), np.ptp(part_mesh(part.solids, 1e-7).vertices, axis=0)
    assert (seen <= size + 1e-9).all()
    assert size == pytest.approx(seen, abs=1e-6)


coordinate = st.floats(-5.0, 25.0)
triangle = st.tuples(*(st.tuples(coordinate, coordinate, st.floats(1.0, 9.0)) for _ in range(3)))


@given(st.lists(triangle, min_size=1, max_size=6))
@settings(max_examples=60)
@pytest.mark.slow
def test_a_pixel_shows_the_nearest_triangle_over_its_centre(drawn: list[Any]) -> None:
    corners = np.array(drawn)
    seen = rasterize(corners, 20, 20)
    y, x = np.mgrid[:20, :20] + 0.5
    depth = np.full((20, 20), np.inf)
    sure = np.ones((20, 20), bool)
    for a, b, c in corners:
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        weights = [
            ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area if area else x * 0 - 1
            for p, q in ((b, c), (c, a), (a, b))
        ]
        smallest = np.min(weights, axis=0)
        if area < 0.0:
            sure &= (np.abs(smallest) > 1e-6) & (abs(area) > 1e-3)
            plane = sum(weight * corner[2] for weight, corner in zip(weights, (a, b, c), strict=True))
            depth = np.where(smallest >= 0.0, np.minimum(depth, plane), depth)
    assert (np.isinf(seen.depth) == np.isinf(depth))[sure].all()
    hit = sure & np.isfinite(depth)
    assert seen.depth[hit] == pytest.approx(depth[hit], abs=1e-3)
    assert ((seen.triangle >= 0) == np.isfinite(seen.depth)).all()


def test_a_picture_shows_parts_in_their_colours() -> None:
    red = RenderedBody(part_mesh((Prism(Outline(rectangle(0.1, 0.1)), 0.1),)), (0.9, 0.1, 0.1, 1.0))
    image = picture([red], (120, 100)).astype(int)
    assert image.shape == (100, 120, 3)
    middle = image[50, 60]
    assert middle[0] > 2 * middle[1] > 0
    assert image[3, 3].min() > 230, "paper"
    reddish = image[..., 0] > 1.5 * image[..., 1]
    assert 0.2 < reddish.mean() < 0.7
    top, side = image[30, 60, 0], image[65, 45, 0]
    assert top > side, "the lamp stands above"


def test_cad_libraries_are_not_imported_unless_used() -> None:
    script = (
        "import sys, chefbot, chefbot.cli.app, chefbot.cli.robot.solids; "
        "import chefbot.design.solids.glb, chefbot.design.solids.step; "
        "sys.exit(bool({'trimesh', 'manifold3d', 'shapely', 'build123d', 'OCP', 'scipy'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


cad = pytest.mark.skipif(find_spec("build123d") is None, reason="STEP needs the extra: chefbot[cad]")


@cad
@pytest.mark.slow
def test_cad_kernel_gives_the_same_volume_centre_and_inertia() -> None:
    from chefbot.design.solids.step import cad_part

    for part in all_parts():
        exact = mass_properties([(volume_moments(solid), 1.0) for solid in part.solids])
        assert kernel_error(cad_part(part), exact) < 1e-6, part.name


def kernel_error(shape: Any, exact: MassProperties) -> float:
    """Of what OpenCASCADE integrates over the true surfaces."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape.wrapped, found, 1e-9)
    centre, matrix = found.CentreOfMass(), found.MatrixOfInertia()
    inertia = np.array([[matrix.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)]) * 1e-15
    return unlike(exact, found.Mass() * 1e-9, np.array([centre.X(), centre.Y(), centre.Z()]) * 1e-3, inertia)


def test_normals_are_computed_only_on_request() -> None:
    piece: Piece = in_print_position(all_parts()[0])
    assert piece.mesh.normals is None
    shaded = part_mesh(all_parts()[0].solids, shaded=True)
    assert shaded.normals is not None
    assert np.linalg.norm(shaded.normals, axis=1) == pytest.approx(1.0, abs=1e-9)
    face = np.cross(
        *(shaded.vertices[shaded.triangles[:, i]] - shaded.vertices[shaded.triangles[:, 0]] for i in (1, 2))
    )
    assert (np.einsum("ij,ij->i", face, shaded.normals[shaded.triangles[:, 0]]) > 0).all()
