"""Somebody's URDF or xacro: what is broken, missing or malicious is one sentence."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.cli.robot.foreign.urdf_given import check_given
from chefbot.design.export.urdf import urdf
from chefbot.design.export.urdf_check import check_urdf
from chefbot.design.export.urdf_xml import parse_urdf_xml
from chefbot.errors import ChefbotError
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.load import load_robot

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
INERTIAL = """<inertial><mass value="{mass}"/>
<inertia ixx="{ixx}" iyy="1" izz="1" ixy="{ixy}" ixz="0" iyz="0"/></inertial>"""


def robot(inside: str) -> str:
    """A URDF's text."""
    return f'<robot name="r">{inside}</robot>'


def joint(name: str, parent: str, child: str, kind: str = "fixed", more: str = "") -> str:
    """A joint's text."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>'
    )


def links(*names: str) -> str:
    """Links without anything."""
    return "".join(f'<link name="{name}"/>' for name in names)


def weighed(mass: float = 1.0, ixx: float = 1.0, ixy: float = 0.0) -> str:
    """A link with mass."""
    return f'<link name="a">{INERTIAL.format(mass=mass, ixx=ixx, ixy=ixy)}</link>'


def meshed(file: str) -> str:
    """A link that looks like a mesh."""
    return robot(f'<link name="a"><visual><geometry><mesh filename="{file}"/></geometry></visual></link>')


FAULTS = {
    "entities": ('<!DOCTYPE r [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]>' + robot(links("a")), "DOCTYPE"),
    "external entity": ('<!DOCTYPE r SYSTEM "file:///etc/passwd">' + robot(links("a")), "DOCTYPE"),
    "no xml": ("robot: {}", "not valid XML"),
    "cut off": (robot(links("a"))[:-5], "not valid XML"),
    "too deep": (robot("<a>" * 5000 + "</a>" * 5000), "nested"),
    "another format": ("<sdf/>", "<sdf>, not <robot>"),
    "no link": (robot(""), "has no link"),
    "name twice": (robot(links("a", "a")), "two links are called 'a'"),
    "no name": (robot("<link/>"), "a link has no name"),
    "unknown parent": (robot(links("a", "b") + joint("j", "aa", "b")), r"parent link 'aa' does not exist"),
    "two roots": (robot(links("a", "b")), "'a' and 'b' hang on nothing"),
    "two parents": (robot(links("a", "b", "c") + joint("j", "a", "c") + joint("k", "b", "c")), "one parent"),
    "circle": (robot(links("a", "b") + joint("j", "a", "b") + joint("k", "b", "a")), "circle"),
    "circle aside": (robot(links("r", "a", "b") + joint("j", "a", "b") + joint("k", "b", "a")), "circle"),
    "on itself": (robot(links("r", "a") + joint("j", "a", "a")), "circle"),
    "joint twice": (robot(links("a", "b", "c") + joint("j", "a", "b") + joint("j", "a", "c")), "name of its own"),
    "kind of joint": (robot(links("a", "b") + joint("j", "a", "b", "hinge")), "type 'hinge' is unknown"),
    "zero axis": (robot(links("a", "b") + joint("j", "a", "b", "continuous", '<axis xyz="0 0 0"/>')), "axis is zero"),
    "no limit": (robot(links("a", "b") + joint("j", "a", "b", "revolute")), "needs <limit>"),
    "bad origin": (robot(links("a", "b") + joint("j", "a", "b", more='<origin xyz="0 nan 0"/>')), "3 finite numbers"),
    "no mass": (robot(weighed(mass=0.0)), "must be positive"),
    "negative moment": (robot(weighed(ixx=-1.0)), "principal moment"),
    "moments that no body has": (robot(weighed(ixx=2.1)), "triangle inequality"),
    "products that no body has": (robot(weighed(ixy=0.9)), "triangle inequality"),
    "no size": (
        robot('<link name="a"><visual><geometry><sphere radius="0"/></geometry></visual></link>'), "all positive",
    ),
    "no shape": (robot('<link name="a"><collision><geometry/></collision></link>'), "0 shapes"),
    "no such shape": (
        robot('<link name="a"><visual><geometry><cone radius="1"/></geometry></visual></link>'), "not a URDF shape",
    ),
    "mesh missing": (meshed("gone.stl"), r"mesh gone\.stl does not exist"),
    "mesh of a missing package": (meshed("package://nowhere/a.stl"), "package nowhere is not found"),
    "mesh on the net": (meshed("http://example.com/a.stl"), "only package:// and file://"),
    "mesh is a folder": (meshed("."), "is not a file"),
    "mesh with a zero byte": (meshed("file:///a%00b"), "cannot be read"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_each_urdf_fault_is_reported_in_one_sentence(fault: str, tmp_path: Path) -> None:
    text, sentence = FAULTS[fault]
    file = tmp_path / "given.urdf"
    file.write_text(text)
    with pytest.raises(ChefbotError, match=sentence) as caught:
        check_given(file)
    assert "given.urdf" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_mesh_behind_circular_symlinks_is_reported(tmp_path: Path) -> None:
    (tmp_path / "a.stl").symlink_to("b.stl")
    (tmp_path / "b.stl").symlink_to("a.stl")
    (tmp_path / "given.urdf").write_text(meshed("a.stl"))
    with pytest.raises(ChefbotError, match=r"mesh a\.stl cannot be read"):
        check_given(tmp_path / "given.urdf")


def test_a_named_pipe_as_a_mesh_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.stl")
    (tmp_path / "given.urdf").write_text(meshed("a.stl"))
    with pytest.raises(ChefbotError, match="is not a file"):
        check_given(tmp_path / "given.urdf")


def test_a_valid_urdf_gives_its_tree_and_finds_its_meshes(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>mine</name></package>")
    (tmp_path / "urdf").mkdir()
    (tmp_path / "a b.stl").write_bytes(b"solid")
    file = tmp_path / "urdf" / "given.urdf"
    file.write_text(meshed("package://mine/a%20b.stl"))
    assert [branch.link for branch in check_given(file)] == ["a"]


def test_our_own_urdf_passes() -> None:
    machine = load_robot("chefbot")
    tree = check_urdf(parse_urdf_xml(urdf(machine).encode(), "ours"), "ours")
    assert sum(branch.mass for branch in tree) == pytest.approx(total_mass(machine))
    assert tree[0].link == "base_footprint"


INCLUDES = {
    "itself": ({"a.xacro": '<xacro:include filename="a.xacro"/>'}, "itself"),
    "in a circle": (
        {"a.xacro": '<xacro:include filename="b.xacro"/>', "b.xacro": '<xacro:include filename="a.xacro"/>'},
        "itself",
    ),
    "in a circle over a folder": ({"a.xacro": '<xacro:include filename="$(dirname)/a.xacro"/>'}, "itself"),
    "by a variable": (
        {"a.xacro": '<xacro:property name="f" value="a.xacro"/><xacro:include filename="${f}"/>'}, "itself",
    ),
    "a macro that calls itself": (
        {"a.xacro": '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>'}, "without end",
    ),
    "what is not there": ({"a.xacro": '<xacro:include filename="gone.xacro"/>'}, r"No such file .*gone\.xacro"),
    "an unknown name": ({"a.xacro": '<link name="${nothing}"/>'}, "'nothing' is not defined"),
    "too much memory": ({"a.xacro": "<link name=\"${'a' * 10**10}\"/>"}, "a repetition 10000000000 times is longer"),
    "too much memory in one text": (
        {"a.xacro": f"<xacro:property name='a' value=\"${{'a' * 99999}}\"/><link name=\"{'${a}' * 20000}\"/>"},
        "too much memory|MemoryError",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", INCLUDES)
def test_xacro_that_never_ends_or_does_not_expand_is_reported(fault: str, tmp_path: Path) -> None:
    pytest.importorskip("xacro", reason="needs xacro from PyPI")
    files, sentence = INCLUDES[fault]
    for name, inside in files.items():
        (tmp_path / name).write_text(f'<robot name="r" {XACRO}>{inside}{links("a")}</robot>')
    with pytest.raises(ChefbotError, match=sentence) as caught:
        check_given(tmp_path / "a.xacro")
    assert "\n" not in str(caught.value)


def test_xml_entities_in_an_included_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.xacro").write_text(f'<robot name="r" {XACRO}><xacro:include filename="b.xacro"/></robot>')
    (tmp_path / "b.xacro").write_text('<!DOCTYPE r [<!ENTITY a "aa">]><robot/>')
    with pytest.raises(ChefbotError, match=r"b\.xacro: has a DOCTYPE"):
        check_given(tmp_path / "a.xacro")


def test_exponential_includes_are_read_once_each(tmp_path: Path) -> None:
    """Twenty-five of them would be read 2^25 times."""
    for i in range(25):
        inside = f'<xacro:include filename="{i + 1}.xacro"/>' * 2
        (tmp_path / f"{i}.xacro").write_text(
            f"<robot {XACRO}><xacro:if value='0'>{inside}</xacro:if></robot>"
        )
    (tmp_path / "25.xacro").write_text(f"<robot {XACRO}/>")
    (tmp_path / "a.xacro").write_text(
        f'<robot name="r" {XACRO}><xacro:include filename="0.xacro"/>{links("a")}</robot>'
    )
    pytest.importorskip("xacro", reason="needs xacro from PyPI")
    assert [branch.link for branch in check_given(tmp_path / "a.xacro")] == ["a"]


OURS = urdf(load_robot("chefbot")).encode()


@settings(max_examples=150)
@given(at=st.integers(0, len(OURS) - 1), cut=st.integers(0, 60), put=st.binary(max_size=12))
def test_a_damaged_urdf_passes_or_gives_one_sentence(at: int, cut: int, put: bytes) -> None:
    try:
        check_urdf(parse_urdf_xml(OURS[:at] + put + OURS[at + cut :], "it"), "it")
    except ChefbotError as error:
        assert str(error).startswith("it")
