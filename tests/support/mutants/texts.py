"""Texts of valid files: those of the package, and small ones of kinds that the package has no file of."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import yaml

import chefbot
from chefbot.runtime.launch import built_in_launches, load_launch, node_class, node_params

PACKAGE = Path(chefbot.__file__).parent
WORLD = (PACKAGE / "sim/worlds/room.yaml").read_text()
ROBOT = (PACKAGE / "robot/chefbot.yaml").read_text()
LAUNCH = (PACKAGE / "launch/waiter.yaml").read_text()
SCENARIO = (PACKAGE / "proving/scenarios/go_hazards.yaml").read_text()
CALIBRATED = """\
# A robot after its calibration.
like: chefbot_lidar
name: calibrated
calibration:
  left_wheel: 1.002          # of the nominal diameter
  wheel_deviation: 0.0005
  right_wheel: 0.998
  separation: 1.01
  gyro_scale: 1.003
  lidar_yaw: 0.4 deg
drive: {max_speed: 0.3 m/s}
"""
MAP = """\
image: {image}
mode: trinary
resolution: 0.05
origin: [-0.5, -0.5, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
PLACES = """\
# Named places on the map beside this file; edit freely.
places:
  kitchen: {x: 1.0 m, y: 0.5 m, yaw: 90.0 deg}
  table_1: {x: 0.25 m, y: 0.0 m}  # by the window
  home:
    x: 0 m
    y: 0 m
"""
RELATIONS = "# t1 t2 x y z roll pitch yaw\n" + "".join(
    f"{t}.25 {t + 3}.5 0.{t} -0.0{t} 0 0 0 0.1{t}\n" for t in range(1, 9)
)


def _carmen() -> str:
    lines = ["# a comment", "PARAM laser_front_laser_resolution 1.0"]
    for number in range(20):
        x, yaw = 0.1 * number, 0.01 * number
        ranges = " ".join(f"{2.0 + math.sin(0.2 * beam):.2f}" for beam in range(45))
        pose = f"{x:.3f} 0.000 {yaw:.3f}"
        lines.append(f"ODOM {pose} 0.1 0 0 {number}.0 robot {number}.0")
        lines.append(f"FLASER 45 {ranges} {pose} {pose} {number}.5 robot {number}.5")
    return "\n".join([*lines, ""])


def _parameters() -> str:
    """A launch whose nodes have all their parameters written, with the values that they have anyway."""
    nodes: dict[str, object] = {}
    for name in ("waiter", "explore"):
        for node, entry in load_launch(str(built_in_launches()[name])).nodes.items():
            params = node_params(node_class(entry.kind, name), entry.params, name)
            nodes[node] = {"kind": entry.kind, "params": msgspec.to_builtins(params)}
    return yaml.safe_dump({"description": "All parameters", "nodes": nodes}, sort_keys=False, width=110)


CARMEN, PARAMETERS = _carmen(), _parameters()
HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
XACRO = {
    "package.xml": "<package><name>cart_description</name></package>",
    "config/wheels.yaml": "wheel: {radius: 0.098, width: 0.04, mass: !degrees 30}\nnames: [front, rear]\n",
    "urdf/common.xacro": f"""<?xml version="1.0"?>
{HEAD}
  <xacro:macro name="box_inertia" params="m x y z">
    <inertial><mass value="${{m}}"/>
    <inertia ixx="${{m*(y*y+z*z)/12}}" ixy="0" ixz="0" iyy="${{m*(x*x+z*z)/12}}" iyz="0" izz="${{m*(x*x+y*y)/12}}"/>
    </inertial></xacro:macro>
</robot>""",
    "r.urdf.xacro": f"""<?xml version="1.0"?>
{HEAD}
  <xacro:arg name="prefix" default="cart_"/> <xacro:property name="p" value="$(arg prefix)"/>
  <xacro:include filename="$(find cart_description)/urdf/common.xacro"/>
  <xacro:property name="data" value="${{xacro.load_yaml('config/wheels.yaml')}}"/>
  <xacro:property name="track" value="${{2 * 0.187795}}"/>
  <link name="${{p}}base"><xacro:box_inertia m="16.5" x="0.42" y="0.31" z="0.24"/>
    <visual><geometry><box size="0.42 ${{track - 2 * data.wheel.width}} 0.24"/></geometry></visual></link>
  <xacro:macro name="wheel" params="side x:=^|0 y *origin">
    <link name="${{p}}${{side}}_wheel"><visual><geometry>
      <cylinder radius="${{data['wheel']['radius']}}" length="${{data.wheel.width}}"/></geometry></visual></link>
    <joint name="${{p}}${{side}}_joint" type="continuous"><parent link="${{p}}base"/>
      <child link="${{p}}${{side}}_wheel"/>
      <xacro:insert_block name="origin"/><axis xyz="0 1 0"/></joint></xacro:macro>
  <xacro:wheel side="left" y="1"><origin xyz="${{'%.3f' % track}} 0 0" rpy="${{-pi/2}} 0 0"/></xacro:wheel>
  <xacro:if value="${{'left' in data.names or len(data.names) == 2}}">
    <xacro:wheel side="right" y="-1"><origin xyz="0 ${{-track/2}} 0" rpy="0 0 ${{radians(90)}}"/></xacro:wheel>
  </xacro:if>
  <xacro:unless value="${{p == ''}}"><link name="unused"/><joint name="u" type="fixed"><parent link="${{p}}base"/>
    <child link="unused"/></joint></xacro:unless>
</robot>""",
}
