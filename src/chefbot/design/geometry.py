"""What must follow in a robot's geometry: of other wheels or plates, of a load that tips it, of a thick motor."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import msgspec

from chefbot.design.checks import TIPS_LESS, WHEEL, robot_checks
from chefbot.design.robot_text import Change
from chefbot.design.selection import Verdict
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


def following(robot: Robot, diameter: float, radius: float) -> list[Change]:
    """Changes that keep the robot in proportion when it gets wheels of `diameter` and plates of `radius`, metres."""
    edge = _edge(robot, radius - robot.body.radius)
    moved = [Change(path, mm(value), "moves with body.radius") for path, value in edge.items()]
    return [*_notch(robot, diameter), *moved]


def remedies(candidates: Iterable[Verdict], fixed: set[tuple[str, ...]]) -> list[Change]:
    """Changes of the geometry, outside of the `fixed` keys, that mend the best set that nothing else is wrong with.

    None where every set has another fault too.
    """
    ways = {key: way for key, way in WAYS.items() if tuple(key.split(".")) not in fixed}
    for verdict in sorted(candidates, key=lambda verdict: (verdict.mass, verdict.power)):
        keys = sorted({check.key for check in verdict.failures})
        if keys and all(key in ways for key in keys):
            changes = [ways[key](verdict.robot) for key in keys]
            if None not in changes:
                return [change for change in changes if change is not None]
    return []


def _wheel(robot: Robot) -> Change:
    return Change(("wheels", "diameter"), mm(smallest_wheel(robot)), "for the motor's clearance")


def _radius(robot: Robot) -> Change | None:
    radius = stable_radius(robot)
    return None if radius is None else Change(("body", "radius"), mm(radius), "so that it does not tip")


WAYS: dict[str, Callable[[Robot], Change | None]] = {TIPS_LESS: _radius, WHEEL: _wheel}
"""Key of a check to how the geometry mends it."""


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


def _notch(robot: Robot, diameter: float) -> list[Change]:
    """The slot is longer than the wheel (the chapter's rule)."""
    notch, wanted = robot.plates.notch, diameter + NOTCH_LONGER
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
