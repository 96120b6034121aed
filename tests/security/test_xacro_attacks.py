"""xacro files of attackers are refused in a sentence; those of real robots expand as with xacro itself."""

from __future__ import annotations

import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from tests.support.mutants.texts import XACRO

from chefbot.cli.robot.foreign import xacro_process
from chefbot.cli.robot.foreign.urdf_given import check_given, expanded
from chefbot.errors import ChefbotError

pytest.importorskip("xacro", reason="needs xacro from PyPI")
ROBOT = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}<link name="a"/></robot>'


def doubled(levels: int, inside: str) -> str:
    """Macros each of which calls the one before twice."""
    first = f'<xacro:macro name="m0">{inside}</xacro:macro>'
    calls = "".join(
        f'<xacro:macro name="m{i}"><xacro:m{i - 1}/><xacro:m{i - 1}/></xacro:macro>' for i in range(1, levels)
    )
    return f"{first}{calls}<xacro:m{levels - 1}/>"


def value(expression: str) -> str:
    """A link named by an expression."""
    return f'<link name="${{{expression}}}"/>'


ATTACKS = {
    "walk by a comprehension": (value("[c for c in ().__class__.__base__.__subclasses__()]"), "more than arithmetic"),
    "walk by a lambda": (value("(lambda: ().__class__)()"), "more than arithmetic|is not a permitted function"),
    "dunder": (value("().__class__"), "asks for an attribute"),
    "dunder of a function": (value("len.__self__"), "asks for an attribute"),
    "dunder of a namespace": (value("xacro.load_yaml.__globals__"), "asks for an attribute"),
    "function as a value": (value("list(python.values())"), "'values' is not defined"),
    "namespace as a value": (value("dict(xacro)"), "namespace of functions is not a value"),
    "attribute by a format": (value("'{0.__class__}'.format(1)"), "cannot expand it"),
    "item by a format": (value("'{0[__class__]}'.format(1)"), "cannot expand it"),
    "attribute by an f-string": (value("f'{().__class__}'"), "cannot expand it"),
    "wide format": (value("'%999999999d' % 1"), "not a plain format"),
    "wide f-string": (value("f'{1:>999999999}'"), "cannot expand it"),
    "huge power": (value("9**9**9"), "bits"),
    "huge shift": (value("1 &lt;&lt; 10**9"), "not arithmetic"),
    "huge rounding": (value("round(1, -10**9)"), "300 is the maximum"),
    "huge text": (value("'a' * 10**9"), "repetition"),
    "huge replacement": (value("('a'*9999).replace('a', 'b'*9999)"), "longer than"),
    "huge range": (value("list(range(10**9))"), "range is longer"),
    "deep expression": (value("(" * 4000 + ")" * 4000), "cannot expand it"),
    "circular property": ('<xacro:property name="a" value="${a}x"/>' + value("a"), "circular variable"),
    "recursive macro": ('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>', "without end"),
    "mutual macros": (
        '<xacro:macro name="m"><xacro:n/></xacro:macro><xacro:macro name="n"><xacro:m/></xacro:macro><xacro:m/>',
        "without end",
    ),
    "exponential macros": (doubled(40, '<link name="b"/>'), "memory|had not finished"),
    "exponential macros of nothing": (doubled(40, ""), "memory|had not finished"),
    "exponential texts": (
        '<xacro:property name="t0" value="aaaaaaaaaa"/>'
        + "".join(f'<xacro:property name="t{i}" value="{f"${{t{i - 1}}}" * 10}"/>' for i in range(1, 12))
        + value("t11"),
        "longer than|memory|had not finished",
    ),
    "exponential lists": (
        "".join(f'<xacro:property name="p{i}" value="${{[p{i - 1}, p{i - 1}]}}"/>' for i in range(1, 40))
        + '<xacro:property name="p0" value="1"/>' + value("p39"),
        "memory|had not finished|longer",
    ),
    "find above": ('<xacro:include filename="$(find ..)/etc/passwd"/>', "not a package name"),
    "find a folder of the system": ('<xacro:include filename="$(find /etc)/passwd"/>', "not a package name"),
    "environment": (value("'$(env HOME)'"), "evaluates neither"),
    "evaluation": ('<link name="$(eval __import__(\'os\').getpid())"/>', "evaluates neither"),
    "evaluation in an argument": ('<xacro:arg name="x" default="$(eval 1)"/>', "evaluates neither"),
    "passwords": ('<xacro:include filename="/etc/passwd"/>', "lies outside"),
    "passwords by the way up": (f'<xacro:include filename="{"../" * 20}etc/passwd"/>', "lies outside"),
    "passwords by a pattern": ('<xacro:include filename="/*/passwd"/>', "lies outside"),
    "passwords by a link": ('<xacro:include filename="link.xacro"/>', "lies outside"),
    "device by a link": ('<xacro:include filename="device.xacro"/>', "lies outside"),
    "pipe": ('<xacro:include filename="pipe.xacro"/>', "pipe or a device"),
    "folder": ('<xacro:include filename="folder.xacro"/>', "Is a directory"),
    "null character in a name": ("<link name=\"${xacro.load_yaml('a\\0.yaml')}\"/>", "null|cannot be read"),
    "YAML of passwords": (value("xacro.load_yaml('/etc/passwd')"), "lies outside"),
    "YAML with a type of Python": (value("xacro.load_yaml('python.yaml')"), "could not determine a constructor"),
    "YAML with an expression": (value("xacro.load_yaml('walk.yaml')"), "asks for an attribute"),
    "YAML of laughs": (value("xacro.load_yaml('laughs.yaml')"), "memory|had not finished|longer"),
    "YAML that is not text": (value("xacro.load_yaml('bytes.yaml')"), "cannot expand it"),
    "entities in an include": ('<xacro:include filename="entities.xacro"/>', "DOCTYPE"),
    "message with control characters": (value("xacro.fatal('\\x1b[2Jx')"), "x"),
}  # fmt: skip


def prepare(folder: Path) -> None:
    """The files that attacks use."""
    import os

    (folder / "link.xacro").symlink_to("/etc/passwd")
    (folder / "device.xacro").symlink_to("/dev/zero")
    (folder / "folder.xacro").mkdir()
    os.mkfifo(folder / "pipe.xacro")
    laughs = "\n".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12))
    (folder / "laughs.yaml").write_text(f"a0: &a0 [x]\n{laughs}\n")
    (folder / "python.yaml").write_text("a: !!python/object/apply:os.getpid []\n")
    (folder / "walk.yaml").write_text("a: !degrees '().__class__'\n")
    (folder / "bytes.yaml").write_bytes(b"a: \xff\xfe\n")
    (folder / "entities.xacro").write_text('<!DOCTYPE r [<!ENTITY a "aa">]><robot/>')


@pytest.mark.slow
@pytest.mark.parametrize("attack", ATTACKS)
def test_an_attack_by_xacro_ends_in_a_sentence(
    attack: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside, sentence = ATTACKS[attack]
    monkeypatch.setattr(xacro_process, "CPU_SECONDS", 1 if "had not finished" in sentence else 3)
    prepare(tmp_path)
    (tmp_path / "a.xacro").write_text(ROBOT.format(inside) if "{}" in ROBOT else inside)
    begun = time.monotonic()
    with pytest.raises(ChefbotError, match=sentence) as caught:
        check_given(tmp_path / "a.xacro")
    assert (
        "\n" not in str(caught.value)
        and "Traceback" not in str(caught.value)
        and "root:" not in str(caught.value)
    )
    assert time.monotonic() - begun < xacro_process.EXPANSION_SECONDS + 5.0


UR = {
    "package.xml": "<package><name>arm_description</name></package>",
    "config/limits.yaml": (
        "joint_limits:\n  pan: &pan {max_velocity: !degrees 120.0, max_effort: 150.0,"
        " min_position: !degrees -360.0}\n"
        "  lift: {<<: *pan, max_effort: 56.0}\n"
    ),
    "config/kinematics.yaml": "kinematics:\n  pan: {x: 0, y: 0, z: 0.1625, roll: -0, pitch: 0, yaw: 0}\n"
    "  lift: {x: -0.425, y: 0, z: 0, roll: 1.570796327, pitch: 0, yaw: -0}\n",
    "config/looks.yaml": "files:\n  base: {visual: {mesh: {package: arm_description, path: meshes/base.stl}}}\n"
    "offsets: {pan: 0.1, lift: 0.2}\n",
    "meshes/base.stl": "solid a",
    "urdf/inc/common.xacro": ROBOT.replace('{}<link name="a"/>', """
  <xacro:macro name="get_look" params="name:=^ kind:=^">
    <xacro:property name="look" value="${files[name][kind]}" scope="parent"/></xacro:macro>
  <xacro:macro name="get_mesh" params="name kind"><xacro:get_look/>
    <mesh filename="package://${look['mesh']['package']}/${look['mesh']['path']}" scale="1 1 1"/></xacro:macro>
  <xacro:macro name="read_model" params="limits_file kinematics_file">
    <xacro:property name="limits" value="${xacro.load_yaml(limits_file)['joint_limits']}" scope="parent"/>
    <xacro:property name="kin" value="${xacro.load_yaml(kinematics_file)['kinematics']}" scope="parent"/>
    <xacro:property name="looks" value="${xacro.load_yaml('../config/looks.yaml')}"/>
    <xacro:property name="files" value="${looks['files']}" scope="parent"/>
    <xacro:property name="offsets" value="${looks.offsets}" scope="parent"/></xacro:macro>
  <xacro:macro name="arm_joint" params="name parent:=base *extra">
    <link name="${prefix}${name}"><xacro:insert_block name="extra"/></link>
    <joint name="${prefix}${name}_joint" type="revolute"><parent link="${prefix}${parent}"/>
      <child link="${prefix}${name}"/>
      <origin xyz="${kin[name]['x']} ${kin[name].y} ${kin[name].z + offsets[name]}"
              rpy="${kin[name].roll} ${kin[name].pitch} ${kin[name].yaw}"/><axis xyz="0 0 1"/>
      <limit lower="${limits[name].min_position}" upper="${radians(360)}" effort="${limits[name]['max_effort']}"
             velocity="${limits[name].max_velocity * (1.0 if safe else 2.0)}"/></joint></xacro:macro>"""),
    "urdf/arm.xacro": ROBOT.replace('{}<link name="a"/>', """
  <xacro:arg name="prefix" default="left_"/> <xacro:arg name="safe" default="true"/>
  <xacro:property name="prefix" value="$(arg prefix)"/> <xacro:property name="safe" value="$(arg safe)"/>
  <xacro:include filename="$(find arm_description)/urdf/inc/common.xacro"/>
  <xacro:read_model limits_file="$(find arm_description)/config/limits.yaml"
    kinematics_file="${'%s/config/%s.yaml' % ('$(find arm_description)', 'kinematics')}"/>
  <link name="${prefix}base"><visual><geometry><xacro:get_mesh name="base" kind="visual"/></geometry></visual></link>
  <xacro:arm_joint name="pan"><inertial><mass value="${3.7}"/><origin xyz="${'0 0 1'.split()[2]} 0 0" rpy="0 0 0"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></xacro:arm_joint>
  <xacro:arm_joint name="lift" parent="pan"><visual><geometry><sphere radius="${'%.3f' % (0.05 / 2)}"/></geometry>
  </visual></xacro:arm_joint>"""),
}  # fmt: skip
"""As descriptions of arms are: tables in YAML files with units and merged keys, properties in the caller's scope."""
JACKAL = {
    "package.xml": "<package><name>field_description</name></package>",
    "urdf/empty.urdf": ROBOT.replace('{}<link name="a"/>', ""),
    "urdf/accessories/mast.xacro": ROBOT.replace('{}<link name="a"/>', """
  <xacro:macro name="mast" params="parent tf_prefix height:=${0.3} name:='mast' **blocks">
    <link name="${tf_prefix}_${name}"/><joint name="${tf_prefix}_${name}_joint" type="fixed">
      <parent link="${parent}"/><child link="${tf_prefix}_${name}"/><xacro:insert_block name="blocks"/></joint>
  </xacro:macro>"""),
    "urdf/field.urdf.xacro": ROBOT.replace('{}<link name="a"/>', """
  <xacro:property name="PI" value="3.1415926535897931"/> <xacro:property name="wheelbase" value="0.262"/>
  <xacro:property name="track" value="0.37559"/> <xacro:property name="wheel_radius" value="0.098"/>
  <xacro:macro name="wheel" params="prefix *joint_pose">
    <link name="${prefix}_wheel_link"><visual><geometry>
      <cylinder radius="${wheel_radius}" length="${0.040}"/></geometry>
      <origin xyz="0 0 0" rpy="${PI/2} 0 0"/></visual></link>
    <joint name="${prefix}_wheel" type="continuous"><parent link="chassis_link"/><child link="${prefix}_wheel_link"/>
      <xacro:insert_block name="joint_pose"/><axis xyz="0 1 0"/></joint></xacro:macro>
  <link name="chassis_link"/>
  <xacro:macro name="wheels" params="sides:=[-1,1]"><xacro:if value="${len(sides) > 0}">
    <xacro:property name="side" value="${sides[0]}"/>
    <xacro:wheel prefix="front_${'left' if side == 1 else 'right'}">
      <origin xyz="${wheelbase/2} ${side * track/2} 0.034" rpy="0 0 0"/></xacro:wheel>
    <xacro:wheels sides="${sides[1:]}"/></xacro:if></xacro:macro>
  <xacro:wheels sides="${[-1, 1]}"/>
  <xacro:include filename="$(dirname)/accessories/*.xacro"/>
  <xacro:if value="$(optenv FIELD_MAST 1)"><xacro:mast parent="chassis_link" tf_prefix="$(optenv FIELD_PREFIX front)">
    <blocks><origin xyz="0.12 0 ${0.184 + max(0.02, 1e-3)}" rpy="0 0 ${round(radians(90), 4)}"/></blocks>
  </xacro:mast></xacro:if>
  <xacro:unless value="${wheelbase &lt; track and not False}"><link name="never"/></xacro:unless>
  <xacro:include filename="$(optenv FIELD_EXTRAS empty.urdf)"/>
  <xacro:include filename="maybe.xacro" optional="true"/>"""),
}  # fmt: skip
"""As descriptions of outdoor robots are: loops by recursion, options by the environment, accessories by a pattern."""
REAL = {
    "arm": (UR, "urdf/arm.xacro"),
    "field": (JACKAL, "urdf/field.urdf.xacro"),
    "cart": (XACRO, "r.urdf.xacro"),
}


@pytest.mark.parametrize("name", REAL)
def test_descriptions_like_real_ones_expand_as_with_xacro(name: str, tmp_path: Path) -> None:
    files, main = REAL[name]
    for file, text in files.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
    ours = expanded(tmp_path / main)
    assert len(check_given(tmp_path / main)) >= 3
    plain = (tmp_path / main).read_text().replace("$(find arm_description)", str(tmp_path))
    plain = plain.replace("$(find cart_description)", str(tmp_path)).replace("$(dirname)/", "")
    (tmp_path / main).write_text(plain)
    # in a process of its own: other tests confine the xacro of theirs
    command = [sys.executable, "-c", "import sys, xacro; print(xacro.process_file(sys.argv[1]).toxml())"]
    theirs = ET.fromstring(subprocess.check_output([*command, str(tmp_path / main)], text=True))
    assert ET.canonicalize(ET.tostring(ours)) == ET.canonicalize(ET.tostring(theirs))
