"""A stranger's xacro file: expanded as xacro does it, without Python, the environment, or other people's files."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from chefbot.cli.robot.foreign.urdf_given import check_given, expanded
from chefbot.design.export.ros2.workspace import description_package
from chefbot.errors import UserError
from chefbot.robot.load import load_robot

xacro = pytest.importorskip("xacro", reason="needs xacro from PyPI")
ROBOT = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
TURTLEBOT = {
    "package.xml": "<package><name>turtle_description</name></package>",
    "config/sizes.yaml": "wheel: {radius: 0.033, width: 0.018}\ntilt: !degrees 15\nnames: [left, right]\n",
    "urdf/common.xacro": ROBOT.format("""
  <xacro:property name="M_PI" value="3.1415926535897931"/>
  <xacro:macro name="cylinder_inertia" params="m r h:=0.1">
    <inertial><mass value="${m}"/><origin xyz="0 0 0" rpy="0 0 0"/>
      <inertia ixx="${m*(3*r**2+h**2)/12}" ixy="0" ixz="0" iyy="${m*(3*r*r+h*h)/12}" iyz="0" izz="${m*r*r/2}"/>
    </inertial></xacro:macro>"""),
    "urdf/robot.xacro": ROBOT.format("""
  <xacro:arg name="prefix" default=""/> <xacro:arg name="laser" default="true"/>
  <xacro:arg name="model" default="burger"/>
  <xacro:include filename="common.xacro"/>
  <xacro:include filename="common.xacro" ns="shared"/>
  <xacro:property name="prefix" value="$(arg prefix)"/>
  <xacro:property name="sizes" value="${xacro.load_yaml('../config/sizes.yaml')}"/>
  <xacro:property name="masses" value="${dict(burger=0.8, waffle=1.4)}"/>
  <xacro:property name="lazy" value="${later * 2}"/> <xacro:property name="later" value="0.04"/>
  <xacro:property name="upright"><origin xyz="0 0 ${lazy}" rpy="0 ${-sizes.tilt} 0"/></xacro:property>
  <link name="${prefix}base_link"><xacro:cylinder_inertia m="${masses['$(arg model)']}" r="0.1"/>
    <visual><xacro:insert_block name="upright"/>
    <geometry><cylinder radius="${max(0.1, sizes.wheel.radius)}" length="${lazy + 1e-3}"/></geometry></visual></link>
  <xacro:macro name="wheel" params="side reflect *origin parent:=^|base_link">
    <link name="${prefix}${side}_wheel"><xacro:shared.cylinder_inertia m="0.05" r="${sizes['wheel']['radius']}"
      h="${sizes.wheel.width}"/></link>
    <joint name="${prefix + side}_joint" type="continuous"><xacro:insert_block name="origin"/>
      <parent link="${prefix}${parent}"/><child link="${prefix}${side}_wheel"/>
      <axis xyz="0 ${1 if reflect else -1} 0"/>
    </joint></xacro:macro>
  <xacro:macro name="spokes" params="n side"><xacro:if value="${n > 0}">
    <link name="${side}_spoke_${n}"/><joint name="${side}_spoke_${n}_joint" type="fixed">
      <origin xyz="${cos(2 * pi * n / 3):} 0 0" rpy="0 0 ${round(radians(120 * n), 6)}"/>
      <parent link="${side}_wheel"/><child link="${side}_spoke_${n}"/></joint>
    <xacro:spokes n="${n - 1}" side="${side}"/></xacro:if></xacro:macro>
  <xacro:wheel side="${sizes.names[0]}" reflect="true"><origin xyz="0 0.08 0" rpy="${-M_PI/2} 0 0"/></xacro:wheel>
  <xacro:wheel side="${sizes.names[-1]}" reflect="${not True}"><origin xyz="0 -0.08 0" rpy="0 0 0"/></xacro:wheel>
  <xacro:spokes n="3" side="left"/>
  <xacro:if value="$(arg laser)"><link name="laser"/><joint name="l" type="fixed">
  <parent link="base_link"/><child link="laser"/>
  </joint></xacro:if>
  <xacro:unless value="${'$(arg model)' in ['waffle', 'waffle_pi'] or len(sizes.names) != 2}">
    <xacro:element xacro:name="gazebo"><xacro:attribute name="reference" value="base_${str('link')}"/></xacro:element>
  </xacro:unless>""").replace(":} 0 0", "} 0 0"),
}  # fmt: skip
"""Of the kind that TurtleBots have: macros with defaults and blocks, conditions, a YAML file, a loop by recursion."""


def write(folder: Path, files: dict[str, str]) -> None:
    """Files with the text given, below `folder`."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def same_as_xacro(path: Path) -> None:
    """The expansion equals xacro's own; its comments aside."""
    theirs = ET.fromstring(xacro.process_file(str(path)).toxml())
    assert ET.canonicalize(ET.tostring(expanded(path))) == ET.canonicalize(ET.tostring(theirs))


def test_a_turtlebot_description_expands_as_with_xacro(tmp_path: Path) -> None:
    write(tmp_path, TURTLEBOT)
    same_as_xacro(tmp_path / "urdf" / "robot.xacro")
    assert len(check_given(tmp_path / "urdf" / "robot.xacro")) == 7


def test_our_own_description_expands_as_with_xacro(tmp_path: Path) -> None:
    files = {
        name: data
        for name, data in description_package(load_robot("chefbot")).items()
        if name.endswith(("xml", "xacro"))
    }
    write(
        tmp_path, {name: data.decode() if isinstance(data, bytes) else data for name, data in files.items()}
    )
    same_as_xacro(tmp_path / "urdf" / "chefbot.urdf.xacro")


def test_packages_are_found_without_ros(tmp_path: Path) -> None:
    inside = '<xacro:include filename="$(find turtle_description)/urdf/common.xacro"/><link name="a"/>'
    write(tmp_path, TURTLEBOT | {"urdf/a.xacro": ROBOT.format(inside)})
    assert [branch.link for branch in check_given(tmp_path / "urdf" / "a.xacro")] == ["a"]


WALK = (
    "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == 'Popen'][0]"
    "('touch {sentinel}', shell=True)"
)
DOORS = {
    "a comprehension": (f'<link name="${{{WALK}}}"/>', "is more than arithmetic"),
    "$(eval) of a property": (
        """<xacro:property name="p" value="__import__('os').system('touch {sentinel}')"/>"""
        '<link name="$(eval ${{p}})"/>',
        r"\$\(eval __import__",
    ),
    "$(eval)": ("<link name=\"$(eval 'a')\"/>", r"evaluates neither Python nor"),
    "the environment": ('<link name="$(env HOME)"/>', r"\$\(env HOME\) is not evaluated"),
    "a unit in a YAML file": ("<link name=\"${{xacro.load_yaml('walk.yaml')}}\"/>", "is more than arithmetic"),
    "a YAML file elsewhere": ("<link name=\"${{load_yaml('../secret.yaml')}}\"/>", r"secret\.yaml lies outside"),
    "a YAML file behind a link": ("<link name=\"${{load_yaml('link.yaml')}}\"/>", r"link\.yaml lies outside"),
    "another kind of file": ("<link name=\"${{load_yaml('key')}}\"/>", r"only \.yaml and \.yml"),
    "an include elsewhere": ('<xacro:include filename="/etc/passwd"/>', "/etc/passwd lies outside"),
    "an include by a pattern": ('<xacro:include filename="/etc/pass*"/>', r"/etc/pass\* lies outside"),
}  # fmt: skip


@pytest.mark.parametrize("door", DOORS)
def test_an_untrusted_file_runs_no_code_and_stays_in_its_package(door: str, tmp_path: Path) -> None:
    text, sentence = DOORS[door]
    sentinel, folder = tmp_path / "sentinel", tmp_path / "given"
    inside = text.replace("${[", "${{[").replace("True)}", "True)}}").format(sentinel=sentinel)
    write(folder, {"key": "a: 1", "a.xacro": ROBOT.format(inside)})
    write(folder, {"walk.yaml": f"a: !degrees {WALK.format(sentinel=sentinel)!r}"})
    write(tmp_path, {"secret.yaml": "password: hunter2"})
    (folder / "link.yaml").symlink_to("../secret.yaml")
    with pytest.raises(UserError, match=sentence) as caught:
        check_given(folder / "a.xacro")
    assert not sentinel.exists()
    assert "hunter2" not in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_local_module_named_xacro_is_not_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, {"xacro.py": "open('sentinel', 'w')", "a.xacro": ROBOT.format('<link name="${1 + 1}"/>')})
    monkeypatch.chdir(tmp_path)
    assert [branch.link for branch in check_given(Path("a.xacro"))] == ["2"]
    assert not (tmp_path / "sentinel").exists()


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ('<xacro:include filename="none.xacro"/>', "No such file or directory: .*none.xacro$"),
        ("<link name=\"${'\\ud800'}\"/>", "half of a surrogate pair"),
    ],
)
def test_an_error_is_named_once(tmp_path: Path, content: str, sentence: str) -> None:
    path = tmp_path / "a.xacro"
    path.write_text(f'<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="a">{content}</robot>')
    with pytest.raises(UserError, match=sentence) as caught:
        expanded(path)
    assert str(caught.value).count("No such file") <= 1
