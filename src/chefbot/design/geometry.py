"""What must follow in a robot's geometry: of other wheels or plates, of a load that tips it, of a thick motor."""

from __future__ import annotations

import math

import msgspec

from chefbot.design.checks import TIPS_LESS, WHEEL, Check, robot_checks
from chefbot.design.robot_text import Change
from chefbot.design.sizing import smallest_wheel
from chefbot.design.stability import loaded
from chefbot.robot.spec import Robot

NOTCH_LONGER = 0.01
"""Metres: the chapter's slot of 10 cm for a wheel of 9 cm."""
RADIUS_STEP = 0.005
LARGEST_GROWTH = 2.0
"""Times the radius; a robot that tips still is another robot."""
Values = dict[tuple[str, str], float]
"""Section and field to a length in metres."""


def following(before: Robot, after: Robot) -> list[Change]:
    """Changes that keep `after`, which has another wheel or radius than `before`, in proportion."""
    edge = _edge(before, after.body.radius - before.body.radius)
    moved = [Change(path, mm(value), "moves with body.radius") for path, value in edge.items()]
    return [*_notch(after), *moved]


def remedies(robot: Robot, failures: list[Check]) -> list[Change]:
    """Changes of the geometry that mend every failure; none where one of them has another cause."""
    keys = {check.key for check in failures}
    if not keys or not keys <= {TIPS_LESS, WHEEL}:
        return []
    changes = []
    if WHEEL in keys:
        changes.append(Change(("wheels", "diameter"), mm(smallest_wheel(robot)), "for the motor's clearance"))
    if TIPS_LESS in keys:
        radius = stable_radius(robot)
        if radius is None:
            return []
        changes.append(Change(("body", "radius"), mm(radius), "so that it does not tip"))
    return changes


def stable_radius(robot: Robot) -> float | None:
    """The smallest radius of the plates, in steps of RADIUS_STEP, at which nothing tips; None beyond reason."""
    radius = robot.body.radius
    while radius < LARGEST_GROWTH * robot.body.radius:
        radius += RADIUS_STEP
        grown = with_radius(robot, radius)
        tips = [check for check in robot_checks(grown, loaded(grown)) if check.key == TIPS_LESS]
        if all(check.passed for check in tips):
            return radius
    return None


def with_radius(robot: Robot, radius: float) -> Robot:
    """The robot with larger or smaller plates, and what stands at their edge moved with it."""
    values = {("body", "radius"): radius, **_edge(robot, radius - robot.body.radius)}
    for (section, field), value in values.items():
        part = msgspec.structs.replace(getattr(robot, section), **{field: value})
        robot = msgspec.structs.replace(robot, **{section: part})
    return robot


def _notch(after: Robot) -> list[Change]:
    """The slot is longer than the wheel (the chapter's rule)."""
    notch, wanted = after.plates.notch, after.wheels.diameter + NOTCH_LONGER
    if notch is None or notch.length >= wanted - 1e-9:
        return []
    return [Change(("plates", "notch", "length"), mm(wanted), "wheels.diameter + 10 mm")]


def _edge(robot: Robot, further: float) -> Values:
    """What stands at the plates' edge, `further` out."""
    if abs(further) < 1e-9:
        return {}
    return {
        ("wheels", "separation"): robot.wheels.separation + 2.0 * further,
        ("casters", "offset"): robot.casters.offset + further,
        ("poles", "reach"): robot.poles.reach + further * math.sqrt(0.5),
    }


def mm(metres: float) -> str:
    """`mm(0.09) == "90 mm"`."""
    return f"{round(metres * 1000.0, 1):g} mm"
