"""The parts of a Robot as solids: the source of drawings, meshes, masses, simulation models and checks."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from chefbot.maths.outline import Outline, circle, rectangle
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.outlines import (
    base_plate_outline,
    clamp_face_outline,
    flange_outline,
    middle_plate_outline,
    top_plate_outline,
)
from chefbot.robot.geometry.shapes import (
    ORIGIN,
    Axis,
    Ball,
    MassProperties,
    Prism,
    Solid,
    Vector,
    VolumeMoments,
    mass_properties,
    rotation,
    transform_moments,
    volume,
    volume_moments,
)
from chefbot.robot.materials import MATERIALS, RgbaColour
from chefbot.robot.section import Housing, MountingPosition, Size
from chefbot.robot.sensors import CliffSensor
from chefbot.robot.spec import Robot

SENSOR = "sensor"
"""Material name of sensor housings."""
STAND_RADIUS = 0.003
"""Radius of the nylon rod that a sensor stands on, metres."""
PAYLOAD_RADIUS_RATIO = 0.8
"""Ratio of the payload's radius to that of the plates: trays and boxes do not overhang."""
PLASTIC: RgbaColour = (0.18, 0.19, 0.21, 1.0)
BOARD: RgbaColour = (0.10, 0.40, 0.25, 1.0)
RUBBER: RgbaColour = (0.13, 0.13, 0.14, 1.0)
STEEL: RgbaColour = MATERIALS["steel"].colour


class RobotPart(NamedTuple):
    """One physical part of the robot, with mass in kg; equal parts share their `kind`.

    The frame of its solids lies at `at` in the link's frame, rotated by pitch and yaw.
    """

    name: str
    kind: str
    link: str
    solids: tuple[Solid, ...]
    mass: float
    colour: RgbaColour
    material: str
    at: Vector = ORIGIN
    pitch: float = 0.0
    yaw: float = 0.0

    @property
    def volume(self) -> float:
        """Volume in cubic metres, in closed form."""
        return sum(volume(solid) for solid in self.solids)

    @property
    def spread(self) -> VolumeMoments:
        """Volume integrals in the link's frame."""
        integrals = [volume_moments(solid) for solid in self.solids]
        # Sum over the solids, then transform from the part's frame to the link's.
        total = VolumeMoments(*(sum(terms[1:], terms[0]) for terms in zip(*integrals, strict=True)))
        return transform_moments(total, rotation(self.pitch, self.yaw), np.array(self.at))

    @property
    def inertia(self) -> MassProperties:
        """Mass properties of this part alone, in its link's frame."""
        return mass_properties([(self.spread, self.mass / self.volume)])


@lru_cache(maxsize=64)
def solids(robot: Robot) -> tuple[RobotPart, ...]:
    """Return all parts including wheels and sensors, without the payload."""
    return tuple(_parts(robot))


def link_origin(robot: Robot, link: str) -> Vector:
    """Return the origin of a link in base_link, metres; links are not rotated against base_link."""
    side = link.removeprefix("wheel_").removesuffix("_link")
    if side in layout.SIDES:
        return 0.0, layout.SIDES[side] * robot.wheels.separation / 2, robot.wheel_radius
    return (0.0, 0.0, layout.body_height(robot)) if link == "payload_link" else ORIGIN


def payload(robot: Robot) -> RobotPart:
    """Return the payload as a cylinder on the top plate."""
    height, plate = robot.body.payload_height, robot.body.plate
    radius = PAYLOAD_RADIUS_RATIO * min(plate.front, plate.back, plate.half_width)
    solid = _cylinder(radius, height, at=(0.0, 0.0, height / 2))
    colour: RgbaColour = (0.85, 0.55, 0.25, 0.8)
    return RobotPart("payload", "payload", "payload_link", (solid,), robot.body.payload, colour, "payload")


def _parts(robot: Robot) -> Iterator[RobotPart]:
    yield from _plates(robot)
    yield from _poles_and_tubes(robot)
    for side, sign in layout.SIDES.items():
        yield _clamp(robot, side, sign)
        yield _motor(robot, side, sign)
        yield _wheel(robot, side)
    yield from _casters(robot)
    yield from _boxes(robot)
    yield from _sensors(robot)


def _material_part(kind: str, name: str, material: str, pieces: tuple[Solid, ...], at: Vector) -> RobotPart:
    """Return a base_link part that is cut or printed from a material: its mass is volume times density."""
    properties = MATERIALS[material]
    mass = properties.density * sum(volume(piece) for piece in pieces)
    return RobotPart(name, kind, "base_link", pieces, mass, properties.colour, material, at)


def _cylinder(
    radius: float, length: float, axis: Axis = "z", at: Vector = ORIGIN, bore: float = 0.0
) -> Prism:
    """Return a cylinder, with a bore of radius `bore` along its axis if it is not 0."""
    return Prism(Outline(circle(radius), (circle(bore),) if bore else ()), length, axis, at)


def _plates(robot: Robot) -> Iterator[RobotPart]:
    plates, undersides = robot.plates, layout.plate_undersides(robot)
    for i, underside in enumerate(undersides):
        kind = "base_plate" if i == 0 else "top_plate" if i == len(undersides) - 1 else "middle_plate"
        name = f"middle_plate_{i}" if kind == "middle_plate" and len(undersides) > 3 else kind
        prism = Prism(PLATE_OUTLINES[kind](robot), plates.thickness)
        yield _material_part(
            kind, name, plates.material, (prism,), (0.0, 0.0, underside + plates.thickness / 2)
        )


PLATE_OUTLINES = {
    "base_plate": base_plate_outline,
    "middle_plate": middle_plate_outline,
    "top_plate": top_plate_outline,
}


def _poles_and_tubes(robot: Robot) -> Iterator[RobotPart]:
    poles, tubes, undersides = robot.poles, robot.tubes, layout.plate_undersides(robot)
    rod = _cylinder(poles.radius, poles.height, bore=robot.plates.screw_hole / 2)
    tube = _cylinder(tubes.outer_radius, tubes.length, bore=tubes.bore / 2)
    for level, underside in enumerate(undersides[:-1], start=1):
        floor = underside + robot.plates.thickness
        ceiling = floor + tubes.length
        for corner, (x, y) in enumerate(layout.pole_positions(robot), start=1):
            suffix = f"{level}_{corner}"
            foot_z, head_z = floor + poles.height / 2, ceiling - poles.height / 2
            middle = (x, y, (floor + ceiling) / 2)
            yield _material_part("pole", f"pole_{suffix}_foot", poles.material, (rod,), (x, y, foot_z))
            yield _material_part("pole", f"pole_{suffix}_head", poles.material, (rod,), (x, y, head_z))
            yield _material_part("tube", f"tube_{suffix}", tubes.material, (tube,), middle)


def _clamp(robot: Robot, side: str, sign: float) -> RobotPart:
    """Return a motor clamp; its frame lies below the middle of the flange, on its lower side."""
    clamp = robot.motor_clamp
    bottom = layout.plate_undersides(robot)[0] - clamp.thickness
    flange = Prism(flange_outline(robot), clamp.thickness, at=(0.0, 0.0, clamp.thickness / 2))
    # The face stands at the outer end of the flange, towards the wheel.
    face_y = sign * (clamp.length - clamp.thickness) / 2
    face = Prism(clamp_face_outline(robot, bottom), clamp.thickness, "y", (0.0, face_y, 0.0))
    at = (0.0, sign * layout.clamp_middle(robot), bottom)
    return _material_part("motor_clamp", f"motor_clamp_{side}", clamp.material, (flange, face), at)


def _motor(robot: Robot, side: str, sign: float) -> RobotPart:
    """Return a motor with body and shaft; its frame lies where the shaft leaves the body."""
    motor = robot.motor
    front = layout.motor_front(robot)
    shaft_length = robot.wheels.outer_face - front
    body_at = (0.0, -sign * motor.length / 2, motor.shaft_offset)
    body = _cylinder(motor.diameter / 2, motor.length, "y", body_at)
    shaft = _cylinder(motor.shaft_diameter / 2, shaft_length, "y", (0.0, sign * shaft_length / 2, 0.0))
    at = (0.0, sign * front, robot.wheel_radius)
    return RobotPart(f"motor_{side}", "motor", "base_link", (body, shaft), motor.mass, STEEL, "motor", at)


def _wheel(robot: Robot, side: str) -> RobotPart:
    wheels = robot.wheels
    tyre = _cylinder(robot.wheel_radius, wheels.width, "y", bore=robot.motor.shaft_diameter / 2)
    name, link = f"wheel_{side}", f"wheel_{side}_link"
    return RobotPart(name, "wheel", link, (tyre,), wheels.mass, RUBBER, "tyre and hub")


def _casters(robot: Robot) -> Iterator[RobotPart]:
    """Yield the casters: a ball whose upper half runs in a cup, and a spacer up to the base plate."""
    casters, plate_bottom = robot.casters, layout.plate_undersides(robot)[0]
    for name, (x, y, z) in layout.caster_positions(robot).items():
        radius, outer = casters.radius, casters.radius + casters.wall
        cup = _cylinder(outer, radius, at=(0.0, 0.0, radius / 2), bore=radius)
        height = plate_bottom - z - radius
        spacer = _cylinder(outer, height, at=(0.0, 0.0, radius + height / 2))
        parts = (Ball(radius), cup, spacer)
        yield _material_part("caster", f"caster_{name}", casters.material, parts, (x, y, z))


def _boxes(robot: Robot) -> Iterator[RobotPart]:
    yield _box(robot, "battery", robot.places.battery, robot.battery.size, robot.battery.mass, PLASTIC)
    yield _box(robot, "driver", robot.places.driver, robot.driver.size, robot.driver.mass, BOARD)
    for item in robot.equipment:
        yield _box(robot, item.name, item.place, item.size, item.mass, BOARD)


def _box(
    robot: Robot, name: str, place: MountingPosition, size: Size, mass: float, colour: RgbaColour
) -> RobotPart:
    prism = Prism(Outline(rectangle(size.x, size.y)), size.z, at=(0.0, 0.0, size.z / 2))
    at = (place.x, place.y, layout.plate_top(robot, place.plate))
    return RobotPart(name, name, "base_link", (prism,), mass, colour, "equipment", at)


def _sensors(robot: Robot) -> Iterator[RobotPart]:
    for frame, sensor in robot.sensors.by_frame.items():
        mount, housing, name = sensor.mount, sensor.housing, frame.removesuffix("_link")
        pose = (mount.x, mount.y, mount.z), mount.pitch, mount.yaw
        box = (_housing(housing),)
        kind = "cliff" if isinstance(sensor, CliffSensor) else name
        part = RobotPart(name, kind, "base_link", box, housing.mass, PLASTIC, SENSOR, *pose)
        yield part
        yield from _stand(robot, part)


def _housing(housing: Housing) -> Prism:
    size, centre = housing.size, housing.centre
    return Prism(Outline(rectangle(size.x, size.y)), size.z, at=(centre.x, centre.y, centre.z))


def _stand(robot: Robot, sensor: RobotPart) -> Iterator[RobotPart]:
    """Yield the rod of a sensor: from the support below up to it, or up to the base plate if it hangs."""
    x, y, bottom, top = _extent(sensor)
    below = [z for z in _supports(robot, x, y) if z <= bottom]
    low, high = (max(below), bottom) if below else (top, layout.plate_undersides(robot)[0])
    if high - low > 1e-6:
        rod = _cylinder(STAND_RADIUS, high - low)
        yield _material_part("stand", f"{sensor.name}_stand", "nylon", (rod,), (x, y, (low + high) / 2))


def _extent(sensor: RobotPart) -> tuple[float, float, float, float]:
    """Return x and y of a housing's centre in base_link, and its minimum and maximum z."""
    box = sensor.solids[0]
    assert isinstance(box, Prism)
    rotation_matrix, size = rotation(sensor.pitch, sensor.yaw), _sides(box)
    centre = rotation_matrix @ np.array(box.at) + np.array(sensor.at)
    # Half the extent of a rotated box along z: |R_z| . size / 2.
    half_height = float(np.abs(rotation_matrix[2]) @ size) / 2
    return float(centre[0]), float(centre[1]), float(centre[2]) - half_height, float(centre[2]) + half_height


def _sides(box: Prism) -> np.ndarray:
    corners = np.array([(c.x, c.y) for c in box.outline.edge])
    return np.array([*np.ptp(corners, axis=0), box.length])


def _supports(robot: Robot, x: float, y: float) -> Iterator[float]:
    """Yield the heights of all surfaces at (x, y) that a sensor stand can rest on."""
    for plate in range(1, robot.plates.count + 1):
        yield layout.plate_top(robot, plate)
    for box in _boxes(robot):
        prism = box.solids[0]
        assert isinstance(prism, Prism)
        length, width, height = _sides(prism)
        if abs(x - box.at[0]) <= length / 2 and abs(y - box.at[1]) <= width / 2:
            yield box.at[2] + height
