"""Changes of the geometry if no set of parts passes: larger plates or larger wheels."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from chefbot.design.sizing.component_selection import Verdict
from chefbot.design.sizing.dependent_dimensions import mm, with_radius
from chefbot.design.sizing.requirements import TIPS_LESS, WHEEL, robot_checks
from chefbot.design.sizing.robot_file_editor import Change
from chefbot.design.sizing.sizing import smallest_wheel
from chefbot.design.sizing.stability import loaded
from chefbot.robot.spec import Robot

RADIUS_STEP = 0.005
LARGEST_GROWTH = 2.0
"""Maximum plate radius over the present one."""


def geometry_fixes(candidates: Iterable[Verdict], fixed: set[tuple[str, ...]]) -> list[Change]:
    """Return changes of the geometry, outside of the `fixed` keys, that repair the best set with no other fault.

    None if every set has another fault too.
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
"""Key of a check to the change of geometry that repairs it."""


def stable_radius(robot: Robot) -> float | None:
    """Return the minimum plate radius, in steps of RADIUS_STEP, without tipping.

    None if it is unreasonable, or if the plates are rectangular.
    """
    radius = present = robot.body.radius
    if radius is None or present is None:
        return None
    while radius < LARGEST_GROWTH * present:
        radius += RADIUS_STEP
        grown = with_radius(robot, radius)
        tips = [check for check in robot_checks(grown, loaded(grown)) if check.key == TIPS_LESS]
        if all(check.passed for check in tips):
            return radius
    return None
