"""The robot as xacro (https://github.com/ros/xacro/wiki): a URDF for people, with names for its numbers.

Four files: the robot, its macros, and the blocks of ros2_control and Gazebo. Expanded, it is the robot of
`chefbot.design.export.urdf`, but with meshes where that has primitives.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from chefbot.design.export.links import UrdfLink, links
from chefbot.design.export.mjcf import numbers
from chefbot.design.export.urdf import colour_name, for_mujoco
from chefbot.design.export.urdf_control import MOCK, gazebo, ros2_control
from chefbot.design.export.urdf_frames import Frame, fixed_frames
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.layout import body_height, ground_clearance
from chefbot.robot.geometry.shapes import MassProperties, Solid
from chefbot.robot.geometry.solids import RobotPart
from chefbot.robot.materials import RgbaColour
from chefbot.robot.spec import Robot

XACRO = "http://www.ros.org/wiki/xacro"
PREFIX = "${prefix}"
NOTE = (
    "Written by `chefbot urdf` (option package) from the robot's YAML file. Change that file and write the package "
    "anew: a number changed here is not changed in drawings, simulator and firmware."
)

MACROS = """
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="colour" params="name rgba">
    <material name="${name}">
      <color rgba="${rgba}"/>
    </material>
  </xacro:macro>

  <!-- Mass in kg, its centre in metres in the link's frame, the tensor about the centre in kg m^2. -->
  <xacro:macro name="inertial" params="mass xyz ixx iyy izz ixy ixz iyz">
    <inertial>
      <origin xyz="${xyz}" rpy="0 0 0"/>
      <mass value="${mass}"/>
      <inertia ixx="${ixx}" iyy="${iyy}" izz="${izz}" ixy="${ixy}" ixz="${ixz}" iyz="${iyz}"/>
    </inertial>
  </xacro:macro>

  <!-- One piece of a link, as it looks. -->
  <xacro:macro name="part" params="name mesh colour xyz:='0 0 0' rpy:='0 0 0'">
    <visual name="${name}">
      <origin xyz="${xyz}" rpy="${rpy}"/>
      <geometry>
        <mesh filename="${meshes}/${mesh}"/>
      </geometry>
      <material name="${colour}"/>
    </visual>
  </xacro:macro>

  <!-- What collides: an upright cylinder from the height `low` to the height `high`. Called like its link, or
       Gazebo's reader does not give it the link's friction. -->
  <xacro:macro name="hull" params="link radius low high">
    <collision name="${prefix}${link}">
      <origin xyz="0 0 ${(low + high) / 2}" rpy="0 0 0"/>
      <geometry>
        <cylinder radius="${radius}" length="${high - low}"/>
      </geometry>
    </collision>
  </xacro:macro>

  <xacro:macro name="fixed" params="joint parent child xyz:='0 0 0' rpy:='0 0 0'">
    <joint name="${prefix}${joint}" type="fixed">
      <parent link="${prefix}${parent}"/>
      <child link="${prefix}${child}"/>
      <origin xyz="${xyz}" rpy="${rpy}"/>
    </joint>
  </xacro:macro>

  <!-- A driven wheel; reflect is 1 on the left, -1 on the right. -->
  <xacro:macro name="wheel" params="side reflect">
    <link name="${prefix}wheel_${side}_link">
      <xacro:inertial mass="${wheel_mass}" xyz="0 0 0" ixx="${wheel_ixx}" iyy="${wheel_iyy}" izz="${wheel_izz}"
                      ixy="0" ixz="0" iyz="0"/>
      <collision name="${prefix}wheel_${side}_link">
        <origin xyz="0 0 0" rpy="${pi / 2} 0 0"/>
        <geometry>
          <cylinder radius="${wheel_radius}" length="${wheel_width}"/>
        </geometry>
      </collision>
      <xacro:part name="wheel_${side}" mesh="${wheel_mesh}" colour="${wheel_colour}"/>
    </link>
    <joint name="${prefix}wheel_${side}_joint" type="continuous">
      <parent link="${prefix}base_link"/>
      <child link="${prefix}wheel_${side}_link"/>
      <origin xyz="0 ${reflect * wheel_separation / 2} ${wheel_radius}" rpy="0 0 0"/>
      <axis xyz="0 1 0"/>
      <limit effort="${motor_torque}" velocity="${motor_speed}"/>
    </joint>
  </xacro:macro>

  <!-- A ball that touches the floor; its mass and looks are base_link's. reflect is 1 in front. -->
  <xacro:macro name="caster" params="name reflect">
    <link name="${prefix}caster_${name}_link">
      <collision name="${prefix}caster_${name}_link">
        <origin xyz="0 0 0" rpy="0 0 0"/>
        <geometry>
          <sphere radius="${caster_radius}"/>
        </geometry>
      </collision>
    </link>
    <xacro:fixed joint="caster_${name}_joint" parent="base_link" child="caster_${name}_link"
                 xyz="${reflect * caster_offset} 0 ${caster_radius + caster_gap}"/>
  </xacro:macro>

  <!-- The frame that a sensor's messages name. -->
  <xacro:macro name="sensor" params="joint frame parent:=base_link xyz:='0 0 0' rpy:='0 0 0'">
    <link name="${prefix}${frame}"/>
    <xacro:fixed joint="${joint}" parent="${parent}" child="${frame}" xyz="${xyz}" rpy="${rpy}"/>
  </xacro:macro>
</robot>
"""


def xacro_files(robot: Robot, package: str) -> dict[str, str]:
    """File name to text, for the folder `urdf` of a package with that name."""
    return {
        f"{robot.name}.urdf.xacro": _document(_main(robot, package)),
        "macros.xacro": _document(
            ET.fromstring(MACROS, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True)))
        ),
        "ros2_control.xacro": _document(_block([ros2_control(robot, PREFIX, "$(arg hardware)")])),
        "gazebo.xacro": _document(_block(gazebo(robot, PREFIX))),
    }


def mesh_files(robot: Robot) -> dict[str, tuple[Solid, ...]]:
    """Mesh file to solids in the part's own frame: one for each kind, more where pieces of a kind are mirrored
    or of different lengths."""
    return {name: part.solids for part, name in _meshes(robot)}


def _meshes(robot: Robot) -> list[tuple[RobotPart, str]]:
    """Every part with its mesh file."""
    files: dict[tuple[str, tuple[Solid, ...]], str] = {}
    found = []
    for part in (part for link in links(robot) for part in link.parts):
        shape = (part.kind, part.solids)
        if shape not in files:
            taken = f"{part.kind}.stl" in files.values()
            files[shape] = f"{part.name if taken else part.kind}.stl"
        found.append((part, files[shape]))
    return found


def _document(root: ET.Element) -> str:
    ET.register_namespace("xacro", XACRO)
    root.insert(0, ET.Comment(f" {NOTE} "))
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _block(elements: list[ET.Element]) -> ET.Element:
    root = ET.Element("robot")
    root.extend(elements)
    return root


def _call(element: ET.Element, tag: str, /, **arguments: str) -> ET.Element:
    return ET.SubElement(element, f"{{{XACRO}}}{tag}", arguments)


def _main(robot: Robot, package: str) -> ET.Element:
    root = ET.Element("robot", name=robot.name)
    for name, default in (("prefix", ""), ("use_gazebo", "false"), ("hardware", MOCK)):
        _call(root, "arg", name=name, default=default)
    _call(root, "property", name="prefix", value="$(arg prefix)")
    _call(root, "property", name="meshes", value=f"package://{package}/meshes")
    for name, value in _properties(robot).items():
        _call(root, "property", name=name, value=value)
    _call(root, "include", filename="macros.xacro")
    _colours(root, robot)
    ET.SubElement(root, "link", name=f"{PREFIX}base_footprint")
    for link in links(robot):
        if not link.turns:
            _link(root, robot, link)
    for side, sign in layout.SIDES.items():
        _call(root, "wheel", side=side, reflect=f"{sign:g}")
    for name, (x, _, _) in layout.caster_positions(robot).items():
        _call(root, "caster", name=name, reflect=f"{x / robot.casters.offset:g}")
    _frames(root, robot)
    _call(root, "include", filename="ros2_control.xacro")
    root.append(for_mujoco())
    _call(_call(root, "if", value="$(arg use_gazebo)"), "include", filename="gazebo.xacro")
    return root


def _properties(robot: Robot) -> dict[str, str]:
    """The numbers that have names; metres, kilograms, N m, rad/s."""
    wheel, mesh = next((part, mesh) for part, mesh in _meshes(robot) if part.kind == "wheel")
    ixx, iyy, izz, *_ = wheel.inertia.inertia
    amounts = {
        "body_radius": robot.body.radius,
        "body_low": ground_clearance(robot),
        "body_high": body_height(robot),
        "wheel_radius": robot.wheel_radius,
        "wheel_width": robot.wheels.width,
        "wheel_separation": robot.wheels.separation,
        "wheel_mass": wheel.mass,
        "wheel_ixx": ixx,
        "wheel_iyy": iyy,
        "wheel_izz": izz,
        "caster_radius": robot.casters.radius,
        "caster_offset": robot.casters.offset,
        "caster_gap": layout.CASTER_GAP,
        "motor_torque": robot.motor.stall_torque,
        "motor_speed": robot.motor.no_load_speed,
    }
    words = {"wheel_mesh": mesh, "wheel_colour": colour_name(wheel.colour)}
    return {name: f"{value:.9g}" for name, value in amounts.items()} | words


def _colours(root: ET.Element, robot: Robot) -> None:
    seen: dict[str, RgbaColour] = {}
    for part, _ in _meshes(robot):
        seen.setdefault(colour_name(part.colour), part.colour)
    for name, colour in seen.items():
        _call(root, "colour", name=name, rgba=numbers(colour))


def _link(root: ET.Element, robot: Robot, link: UrdfLink) -> None:
    """base_link or the payload: weight, hull, every piece."""
    element = ET.SubElement(root, "link", name=PREFIX + link.name)
    _inertial(element, link.inertia)
    hull = link.hulls[0]
    low, high = hull.at[2] - hull.size[1] / 2, hull.at[2] + hull.size[1] / 2
    size = {"radius": f"{hull.size[0]:.9g}", "low": f"{low:.9g}", "high": f"{high:.9g}"}
    if link.name == "base_link":
        size = {"radius": "${body_radius}", "low": "${body_low}", "high": "${body_high}"}
    _call(element, "hull", link=link.name, **size)
    for part, mesh in _meshes(robot):
        if part.link == link.name:
            _part(element, part, mesh)


def _part(element: ET.Element, part: RobotPart, mesh: str) -> None:
    place = {"xyz": numbers(part.at)}
    if part.pitch or part.yaw:
        place["rpy"] = numbers((0.0, part.pitch, part.yaw))
    _call(element, "part", name=part.name, mesh=mesh, colour=colour_name(part.colour), **place)


def _inertial(element: ET.Element, inertia: MassProperties) -> None:
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    moments = {name: f"{value:.9g}" for name, value in zip(names, inertia.inertia, strict=True)}
    _call(element, "inertial", mass=f"{inertia.mass:.9g}", xyz=numbers(inertia.centre), **moments)


def _frames(root: ET.Element, robot: Robot) -> None:
    """Joints of the links above, and sensors with links of their own; the casters have their macro."""
    weighed = {link.name for link in links(robot)}
    for frame in fixed_frames(robot):
        if frame.name in weighed:
            _call(root, "fixed", joint=frame.joint, parent=frame.parent, child=frame.name, **_place(frame))
        elif not frame.name.startswith("caster"):
            parent = {} if frame.parent == "base_link" else {"parent": frame.parent}
            _call(root, "sensor", joint=frame.joint, frame=frame.name, **parent, **_place(frame))


def _place(frame: Frame) -> dict[str, str]:
    """Origin as arguments; what is zero is left to the macro."""
    return {key: numbers(value) for key, value in (("xyz", frame.at), ("rpy", frame.rpy)) if any(value)}
