"""Dimensions that depend on the wheels, the plates or the motors of a robot."""

from __future__ import annotations

import math

import msgspec

from chefbot.design.errors import DesignError
from chefbot.design.sizing.robot_file_editor import Change
from chefbot.robot.drivetrain import Motor
from chefbot.robot.geometry import layout
from chefbot.robot.section import RobotSection
from chefbot.robot.sensors import CliffSensors
from chefbot.robot.spec import Robot

NOTCH_EXTRA_LENGTH = 0.01
"""Metres: the chapter's slot of 10 cm for a wheel of 9 cm."""
MIN_MOVE = 5e-5
"""Metres; files are written to a tenth of a millimetre."""
Values = dict[tuple[str, str], float]
"""Section and field to a length in metres."""


def dependent_changes(robot: Robot, diameter: float, radius: float | None) -> list[Change]:
    """Return the changes that keep the proportions with wheels of `diameter` and plates of `radius`, metres.

    radius: None keeps the plates as they are.
    """
    edge = {} if radius is None else _edge(robot, radius - plate_radius(robot))
    moved = [Change(path, mm(value), "moves with body.radius") for path, value in edge.items()]
    higher = raised(robot, (diameter - robot.wheels.diameter) / 2.0)
    return [*_notch(robot, diameter), *moved, *moved_sensors(robot, higher)]


def with_motor(robot: Robot, motor: Motor) -> Robot:
    """Return the robot with another motor; the plates are higher on a thicker one, and the sensors with them."""
    driven = msgspec.structs.replace(robot, motor=motor)
    return raised(driven, layout.plate_undersides(driven)[0] - layout.plate_undersides(robot)[0])


def plate_radius(robot: Robot) -> float:
    """Return the radius of the plates, m. Raises DesignError for a rectangular body."""
    if robot.body.radius is None:
        raise DesignError(
            f"robot {robot.name} has a rectangular body, which has no radius: change its length and width"
        )
    return robot.body.radius


def with_radius(robot: Robot, radius: float) -> Robot:
    """Return the robot with another plate radius, and the parts at their edge moved with it."""
    values = {("body", "radius"): radius, **_edge(robot, radius - plate_radius(robot))}
    for (section, field), value in values.items():
        part = msgspec.structs.replace(getattr(robot, section), **{field: value})
        robot = msgspec.structs.replace(robot, **{section: part})
    return robot


def raised(robot: Robot, rise: float) -> Robot:
    """Return the robot with every sensor `rise` metres higher."""
    if abs(rise) < MIN_MOVE:
        return robot
    higher: dict[str, RobotSection] = {}
    for field in robot.sensors.__struct_fields__:
        sensor = getattr(robot.sensors, field)
        if isinstance(sensor, CliffSensors):
            higher[field] = msgspec.structs.replace(sensor, height=round(sensor.height + rise, 4))
        elif sensor is not None:
            mount = msgspec.structs.replace(sensor.mount, z=round(sensor.mount.z + rise, 4))
            higher[field] = msgspec.structs.replace(sensor, mount=mount)
    return msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, **higher))


def moved_sensors(before: Robot, after: Robot) -> list[Change]:
    """Return the changes that move the sensors of `before` to the places of `after`."""
    changes = []
    for field in before.sensors.__struct_fields__:
        old, new = getattr(before.sensors, field), getattr(after.sensors, field)
        if isinstance(old, CliffSensors):
            if abs(new.height - old.height) >= MIN_MOVE:
                height = mm(new.height)
                changes.append(Change(("sensors", field, "height"), height, "moves with the plates"))
        elif old is not None and abs(new.mount.z - old.mount.z) >= MIN_MOVE:
            path = ("sensors", field, "mount", "z")
            changes.append(Change(path, mm(new.mount.z), "moves with the plates"))
    return changes


def mm(metres: float) -> str:
    """Return a length in metres as millimetres: `mm(0.09) == "90 mm"`."""
    return f"{round(metres * 1000.0, 1):g} mm"


def _notch(robot: Robot, diameter: float) -> list[Change]:
    """The slot is longer than the wheel (the chapter's rule)."""
    notch, wanted = robot.plates.notch, diameter + NOTCH_EXTRA_LENGTH
    if notch is None or notch.length >= wanted - 1e-9:
        return []
    return [Change(("plates", "notch", "length"), mm(wanted), "wheels.diameter + 10 mm")]


def _edge(robot: Robot, further: float) -> Values:
    """Parts at the plates' edge, moved outwards by `further`."""
    if abs(further) < 1e-9:
        return {}
    return {
        ("wheels", "separation"): robot.wheels.separation + 2.0 * further,
        ("casters", "offset"): robot.casters.offset + further,
        ("poles", "reach"): robot.poles.reach + further * math.sqrt(0.5),
    }
