"""The expansion of an untrusted xacro file."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

pytest.importorskip("xacro", reason="needs xacro from PyPI")

from tests.support.confined_xacro import expand_here

from chefbot.errors import UserError

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'


def expand(body: str, folder: Path, **files: str) -> str:
    """The URDF; or UserError with the sentence."""
    (folder / "package.xml").write_text("<package><name>desk</name></package>")
    for name, text in files.items():
        (folder / name.replace("_", ".")).write_text(text)
    path = folder / "r.xacro"
    path.write_text(f"{HEAD}{body}</robot>")
    return expand_here(path)


def test_properties_arguments_and_functions_are_evaluated(
    tmp_path: Path,
) -> None:
    text = expand(
        '<xacro:arg name="side" default="left"/><xacro:property name="r" value="${2 * pi}"/>'
        '<xacro:property name="data" value="${xacro.load_yaml(\'a.yaml\')}"/>'
        '<link name="$(arg side)_${round(degrees(r))}_${data.wheel.radius}"/>'
        "<link name=\"${len(xacro.tokenize('a, b;c'))}\"/>",
        tmp_path,
        a_yaml="wheel: {radius: 0.1}\n",
    )
    assert [link.attrib["name"] for link in ET.fromstring(text)] == ["left_360_0.1", "3"]


def test_packages_and_folders_are_substituted(tmp_path: Path) -> None:
    text = expand('<link name="$(find desk)|$(dirname)|$(optenv HOME a b)"/>', tmp_path)
    (link,) = ET.fromstring(text)
    assert link.attrib["name"] == f"{tmp_path}|{tmp_path}|a b", "the environment is not read"


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ('<link name="$(env HOME)"/>', "evaluates neither Python nor the environment"),
        ('<link name="$(eval 1 + 1)"/>', "evaluates neither Python nor the environment"),
        ('<link name="$(arg side)"/>', r"\$\(arg side\) has no value"),
        ('<link name="$(find ..)"/>', "'..' is not a package name"),
        ('<link name="$(run me)"/>', "is not a substitution of xacro"),
        ('<link name="$(find a b)"/>', "is not a substitution of xacro"),
        ("<link name=\"${open('/etc/passwd')}\"/>", "open"),
        ("<link name=\"${xacro.load_yaml('/etc/passwd')}\"/>", "lies outside"),
        ("<link name=\"${xacro.load_yaml('package.xml')}\"/>", "only .yaml and .yml files are read"),
        ('<xacro:include filename="/etc/hostname"/>', "lies outside"),
        ('<xacro:include filename="r.xacro"/>', "includes itself"),
        ('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>', "calls itself without end"),
        ("<link name=\"${xacro.fatal('no', 'wheel')}\"/>", "no wheel"),
        ('<link name="${1 / 0}"/>', "division by zero"),
        ('<link name="${nothing}"/>', "nothing"),
    ],
)
def test_what_is_not_evaluated_is_reported_in_one_sentence(body: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=sentence) as end:
        expand(body, tmp_path)
    assert "Traceback" not in str(end.value)


def test_a_fault_in_an_included_file_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"nothing.*\(in .*part\.xml\)"):
        expand(
            '<xacro:include filename="part.xml"/>', tmp_path,
            part_xml=f'{HEAD}<link name="${{nothing}}"/></robot>',
        )  # fmt: skip
