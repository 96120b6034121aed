"""The xacro of a robot: its properties give the numbers of the URDF, and its meshes exist."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.design.export.links import links
from chefbot.design.export.sdf_elements import (
    add_friction,
    add_geometry,
    add_material,
    add_pose,
    add_value,
    sdf_document,
    shape_tag,
    xml_text,
)
from chefbot.design.export.urdf import urdf
from chefbot.design.export.urdf_control import MOCK, gazebo, ros2_control
from chefbot.design.export.urdf_xacro import XACRO, Property, mesh_files, xacro_files
from chefbot.design.export.xacro_expression import evaluate
from chefbot.robot.geometry import layout
from chefbot.robot.load import built_in_robots, load_robot

ROBOTS = sorted(built_in_robots())
EXPRESSION = re.compile(r"\$\{([^}]*)\}")


@given(st.floats(allow_nan=False), st.sampled_from(["", ".9g", ".3f", "+.1e"]))
def test_a_property_is_written_as_its_expression(value: float, form: str) -> None:
    number = Property(value, "wheel_width / 2")
    assert number == value and f"{number:{form}}" == "${wheel_width / 2}"
    assert f"{number + 0.0:{form}}" == f"{value + 0.0:{form}}", "results of arithmetic are plain numbers"


@pytest.mark.parametrize("name", ROBOTS)
def test_the_expressions_give_the_numbers_of_the_urdf(name: str) -> None:
    robot = load_robot(name)
    root = ET.fromstring(xacro_files(robot, "some_description")[f"{name}.urdf.xacro"])
    given = {one.attrib["name"]: one.attrib["value"] for one in root.iter(f"{{{XACRO}}}property")}
    numbers = {key: float(text) for key, text in given.items() if key not in ("prefix", "meshes")}

    def expanded(text: str) -> list[float]:
        plain = EXPRESSION.sub(lambda one: repr(evaluate(one[1], numbers)), text)
        return [float(word) for word in plain.split()]

    own = {
        one.attrib["name"]: one for one in ET.fromstring(urdf(robot)).iter("joint") if "type" in one.attrib
    }
    joints = [one for one in root.iter("joint") if "type" in one.attrib]
    assert {one.attrib["name"] for one in joints} == {f"${{prefix}}{key}" for key in own}
    for joint in joints:
        ours, theirs = (
            own[joint.attrib["name"].removeprefix("${prefix}")].find("origin"),
            joint.find("origin"),
        )
        assert ours is not None and theirs is not None
        assert expanded(theirs.attrib["xyz"]) == pytest.approx(expanded(ours.attrib["xyz"]), abs=1e-8)
        assert expanded(theirs.attrib["rpy"]) == pytest.approx(expanded(ours.attrib["rpy"]), abs=1e-8)
    used = set(
        re.findall(r"[a-z]+_[a-z]+", " ".join(EXPRESSION.findall(ET.tostring(root, encoding="unicode"))))
    )
    assert set(numbers) <= used, "no property without a use"


@pytest.mark.parametrize("name", ROBOTS)
def test_the_meshes_that_are_shown_are_the_files(name: str) -> None:
    robot = load_robot(name)
    files = mesh_files(robot)
    text = xacro_files(robot, "some_description")[f"{name}.urdf.xacro"]
    assert set(re.findall(r"\$\{meshes\}/([^\"]+)", text)) == set(files)
    assert 'value="package://some_description/meshes"' in text
    assert all(solids for solids in files.values())
    parts = [part for link in links(robot) for part in link.parts]
    assert len(files) < len(parts), "parts of a kind share a file"
    assert len(set(files.values())) == len(files), "no mesh stands in two files"


@pytest.mark.parametrize("name", ROBOTS)
def test_gazebo_gets_the_friction_of_each_link_once(name: str) -> None:
    robot = load_robot(name)
    blocks = gazebo(robot, "left_")
    friction = {one.attrib["reference"]: one for one in blocks if one.find("mu1") is not None}
    casters = {f"left_caster_{caster}_link" for caster in layout.caster_positions(robot)}
    wheels = {"left_wheel_left_link", "left_wheel_right_link"}
    assert set(friction) == casters | wheels | {"left_base_link", "left_payload_link"}
    assert max(Counter(one.attrib.get("reference", "") for one in blocks).values()) == 1
    for wheel in wheels:
        assert float(friction[wheel].findtext("mu1", "")) == pytest.approx(robot.wheels.friction)
    assert all(float(friction[one].findtext("mu2", "")) < robot.wheels.friction for one in casters)


def test_ros2_control_names_the_hardware_and_the_prefixed_joints() -> None:
    robot = load_robot("chefbot")
    assert ros2_control(robot).findtext("hardware/plugin") == MOCK
    block = ros2_control(robot, "a_", "my/Hardware")
    assert block.attrib == {"name": "a_drive", "type": "system"}
    assert block.findtext("hardware/plugin") == "my/Hardware"
    names = [one.attrib["name"] for one in block.findall("joint")]
    assert names == ["a_wheel_left_joint", "a_wheel_right_joint"]
    geared = [one.attrib["name"] for one in block.findall("transmission/joint")]
    assert geared == names
    low, high = (float(one.text or "") for one in block.findall("joint/command_interface/param")[:2])
    assert -low == high == pytest.approx(robot.motor.no_load_speed)


@pytest.mark.parametrize(
    ("value", "text"),
    [(True, "true"), (False, "false"), (1, "1"), (0.1, "0.1"), (1 / 3, "0.333333333"), (1e-12, "1e-12"),
     (2.0, "2"), ("ode", "ode"), ((1.0, -0.5), "1 -0.5")],
)  # fmt: skip
def test_values_are_written_as_sdf_has_them(value: object, text: str) -> None:
    assert xml_text(value) == text
    parent = ET.Element("parent")
    assert add_value(parent, "tag", value, name="n").text == text
    assert ET.tostring(parent, encoding="unicode") == f'<parent><tag name="n">{text}</tag></parent>'


def test_a_pose_names_its_frame_only_if_there_is_one() -> None:
    parent = ET.Element("link")
    add_pose(parent, (1.0, 2.0, 3.0))
    add_pose(parent, (0.0, 0.0, 0.5), (0.0, 0.25, 0.0), "base_link")
    first, second = parent
    assert (first.text, first.attrib) == ("1 2 3 0 0 0", {})
    assert (second.text, second.attrib) == ("0 0 0.5 0 0.25 0", {"relative_to": "base_link"})


def test_each_shape_has_its_own_sizes() -> None:
    hulls = [hull for link in links(load_robot("chefbot")) for hull in link.hulls]
    assert {hull.kind for hull in hulls} >= {"cylinder", "wheel", "sphere"}
    for hull in hulls:
        parent = ET.Element("collision")
        add_geometry(parent, hull)
        (shape,) = parent.findall("geometry/*")
        assert shape.tag == shape_tag(hull) == {"wheel": "cylinder"}.get(hull.kind, hull.kind)
        sizes = [float(word) for child in shape for word in (child.text or "").split()]
        assert sizes == pytest.approx(list(hull.size)), hull.kind


def test_colours_friction_and_the_document_are_complete() -> None:
    model = ET.Element("model", name="x")
    add_material(model, (0.1, 0.2, 0.3, 1.0))
    add_friction(model, 0.6)
    root = ET.fromstring(sdf_document(model, "a notice"))
    assert root.tag == "sdf" and re.fullmatch(r"1\.\d+", root.attrib["version"])
    assert "<!-- a notice -->" in sdf_document(model, "a notice")
    assert "<!--" not in sdf_document(model)
    assert (
        root.findtext("model/material/ambient") == root.findtext("model/material/diffuse") == "0.1 0.2 0.3 1"
    )
    assert [one.text for one in root.findall("model/surface/friction/ode/*")] == ["0.6", "0.6"]
