"""The robot in MuJoCo's XML (MJCF), written as text without MuJoCo.

The actuators of the wheels follow the motor's line: the control is the voltage as a share of the rated one,
and torque = efficiency * stall_torque * (share - speed / no_load_speed).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from chefbot.design.export.links import Primitive, UrdfLink, links, looks, sensor_mounts
from chefbot.design.export.urdf_frames import joint_name, quaternion
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.as_built import AS_DRAWN, AsBuilt
from chefbot.robot.geometry.shapes import MassProperties
from chefbot.robot.geometry.solids import SENSOR, RobotPart
from chefbot.robot.motion_limits import rolling_torque
from chefbot.robot.spec import DRIVE_EFFICIENCY, GRAVITY, Robot

HULL_GROUP, LOOKS_GROUP, HOUSING_GROUP = 1, 2, 3
"""Geom groups of the robot: what collides, its parts as built, and the sensors' housings, which their own rays
begin in."""
CASTER_FRICTION = 0.02
BODY_FRICTION = 0.3
HARD = 'solimp="0.99 0.999 0.001" solref="0.01 1"'
"""Contact of tyres and casters with the floor. MuJoCo's default lets a loaded wheel sink in by 1 % of its
radius, and a wheel that rolls on a smaller radius falls short of its encoder: 215 mm over the 40 m of a 10 m
square. With this it is 7 mm."""
PHYSICS_STEP = 0.005  # s
FAR_COORDINATE = 1000.0
"""Coordinate in metres from which nine digits are too few: the origin of a map may be anywhere."""
OPTION = f'<option timestep="{PHYSICS_STEP}" integrator="discrete" cone="elliptic" gravity="0 0 {-GRAVITY}"/>'
FLOOR_FRICTION = 1.0
FLOOR = (
    '<geom name="floor" type="plane" size="0 0 1" '
    f'friction="{FLOOR_FRICTION:g} 0.005 0.0001" rgba="0.75 0.7 0.6 1"/>'
)


class RobotXml(NamedTuple):
    """Fragments of a MuJoCo model: one body for the worldbody, and the contents of <actuator> and <sensor>."""

    body: str
    actuators: str
    sensors: str


def mjcf(robot: Robot) -> str:
    """Return a complete model: the robot on a floor."""
    return mjcf_document(robot_xml(robot), attributes=f" model={quoteattr(robot.name)}")


def mjcf_document(xml: RobotXml, *surroundings: str, floor: str = FLOOR, attributes: str = "") -> str:
    """Return the text of a model: the floor, what else is in the world, and the robot."""
    bodies = "\n".join((floor, *surroundings, xml.body))
    return f"""<mujoco{attributes}>
{OPTION}
<worldbody>
{bodies}
</worldbody>
<actuator>{xml.actuators}</actuator>
<sensor>{xml.sensors}</sensor>
</mujoco>
"""


def robot_xml(robot: Robot, as_built: AsBuilt = AS_DRAWN, start: SE2 = IDENTITY) -> RobotXml:
    """Return the robot at `start` (pose of base_link in the world)."""
    base, *others = links(robot)
    inside = [_inertial(base.inertia), *(_hull(robot, hull, as_built) for hull in base.hulls)]
    inside += [_look(part, primitive, colour) for part in base.parts for primitive, colour in looks(part)]
    inside += [_sub_body(robot, link, as_built) for link in others]
    inside += [_site(name, *mount) for name, mount in sensor_mounts(robot).items()]
    turn = numbers(quaternion((0.0, 0.0, start.yaw)))
    body = "\n".join(
        [
            f'<body name="base_link" pos="{numbers((start.x, start.y, 0.0))}" quat="{turn}">',
            '<freejoint name="base"/>',
            *inside,
            "</body>",
        ]
    )
    return RobotXml(body, _actuators(robot), _sensors())


def numbers(values: Iterable[float]) -> str:
    """Return numbers with nine digits, separated by spaces; from FAR_COORDINATE on with 15, a micrometre and less."""
    return " ".join(f"{value:.15g}" if abs(value) >= FAR_COORDINATE else f"{value:.9g}" for value in values)


def _inertial(inertia: MassProperties) -> str:
    return (
        f'<inertial pos="{numbers(inertia.centre)}" mass="{inertia.mass:.9g}" '
        f'fullinertia="{numbers(inertia.inertia)}"/>'
    )


def _sub_body(robot: Robot, link: UrdfLink, as_built: AsBuilt) -> str:
    geoms = "".join(_hull(robot, hull, as_built) for hull in link.hulls)
    x, y, z = link.at
    joint = ""
    if link.turns:
        name = joint_name(link.name)
        joint = (
            f'<joint name="{name}" type="hinge" axis="0 1 0" armature="{robot.motor.rotor_inertia:.3g}" '
            f'frictionloss="{rolling_torque(robot):.9g}"/>'
        )
        y, z = y * as_built.separation, z * _wheel_factor(link.name, as_built)
    pos = numbers((x, y, z))
    return f'<body name="{link.name}" pos="{pos}">{joint}{_inertial(link.inertia)}{geoms}</body>'


def _wheel_factor(name: str, as_built: AsBuilt) -> float:
    return as_built.left_wheel if "left" in name else as_built.right_wheel


def _look(part: RobotPart, primitive: Primitive, colour: Iterable[float]) -> str:
    """A visible geom without collisions."""
    at = f'pos="{numbers(primitive.at)}" quat="{numbers(quaternion(primitive.rpy))}"'
    group = HOUSING_GROUP if part.material == SENSOR else LOOKS_GROUP
    look = f'group="{group}" contype="0" conaffinity="0" mass="0" rgba="{numbers(colour)}"'
    return f'<geom name="{primitive.name}_look" {_shape(primitive)} {at} {look}/>'


def _hull(robot: Robot, solid: Primitive, as_built: AsBuilt) -> str:
    at = f'pos="{numbers(solid.at)}"'
    if solid.kind == "wheel":
        grip = robot.wheels.friction * as_built.friction
        shape = _tyre(solid, _wheel_factor(solid.name, as_built))
        contact = f'{HARD} priority="1" friction="{grip:.9g} 0.005 0.0001" rgba="0.15 0.15 0.15 1"'
    elif solid.kind == "sphere":
        shape = _shape(solid)
        contact = f'{HARD} priority="1" friction="{CASTER_FRICTION} 0.005 0.0001" rgba="0.6 0.6 0.65 1"'
    else:
        shape = _shape(solid)
        contact = f'friction="{BODY_FRICTION} 0.005 0.0001" rgba="0.6 0.6 0.65 0.15"'
    return f'<geom name="{solid.name}" {shape} {at} group="{HULL_GROUP}" condim="3" {contact}/>'


def _tyre(solid: Primitive, factor: float) -> str:
    """An ellipsoid, which touches the floor in one point at the tyre's middle: the wheel separation is exact."""
    radius, half = solid.size[0] * factor, solid.size[1] / 2
    return f'type="ellipsoid" size="{numbers((radius, half, radius))}"'


def _shape(solid: Primitive) -> str:
    """MuJoCo takes half lengths."""
    radius, rest = solid.size[:1], tuple(side / 2 for side in solid.size[1:])
    size = tuple(side / 2 for side in solid.size) if solid.kind == "box" else radius + rest
    return f'type="{solid.kind}" size="{numbers(size)}"'


def _site(name: str, at: tuple[float, float, float], pitch: float, yaw: float) -> str:
    """A sensor's frame."""
    turn = numbers(quaternion((0.0, pitch, yaw)))
    return f'<site name="{name}" pos="{numbers(at)}" quat="{turn}" size="0.01" group="4"/>'


def _actuators(robot: Robot) -> str:
    stall = robot.wheel_stall_torque
    slope = DRIVE_EFFICIENCY / robot.motor.speed_torque_gradient
    full = max(1.0, robot.battery.full_voltage / robot.motor.voltage)
    line = (
        f'gaintype="fixed" gainprm="{stall:.9g}" biastype="affine" biasprm="0 0 {-slope:.9g}" '
        f'ctrlrange="{-full:.9g} {full:.9g}" ctrllimited="true" '
        f'forcerange="{-full * stall:.9g} {full * stall:.9g}" forcelimited="true"'
    )
    sides = ("left", "right")
    return "".join(f'<general name="motor_{side}" joint="wheel_{side}_joint" {line}/>' for side in sides)


def _sensors() -> str:
    return '<gyro name="gyro" site="imu_link"/><accelerometer name="accelerometer" site="imu_link"/>'
