"""The sheets of a robot: by name, each a function of robot and scale factor."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from chefbot.design.drawing.drawing import Plan
from chefbot.design.drawing.paper import Drawing, compose
from chefbot.design.drawing.sheets.assembly import assembly
from chefbot.design.drawing.sheets.caster import caster
from chefbot.design.drawing.sheets.clamp import motor_clamp
from chefbot.design.drawing.sheets.plates import base_plate, upper_plate
from chefbot.design.drawing.sheets.turned import turned
from chefbot.design.errors import DesignError
from chefbot.errors import name_hint
from chefbot.robot.geometry.solids import solids

if TYPE_CHECKING:
    from chefbot.robot.spec import Robot

SHEETS: dict[str, Callable[[Robot, float], Plan]] = {
    "base_plate": base_plate,
    "middle_plate": lambda robot, factor: upper_plate(robot, "middle_plate", factor),
    "top_plate": lambda robot, factor: upper_plate(robot, "top_plate", factor),
    "pole": lambda robot, factor: turned(robot, "pole", factor),
    "tube": lambda robot, factor: turned(robot, "tube", factor),
    "motor_clamp": motor_clamp,
    "caster": caster,
    "assembly": assembly,
}
ALL = "all"


def sheets_of(robot: Robot) -> list[str]:
    """Return the names of the sheets of this robot's parts."""
    kinds = {part.kind for part in solids(robot)} | {"assembly"}
    return [name for name in SHEETS if name in kinds]


def selected_sheets(robot: Robot, names: list[str]) -> list[str]:
    """Return the selected sheets, all for `all`; DesignError for a name that is unknown or not of this robot."""
    has = sheets_of(robot)
    for name in names:
        if name not in SHEETS and name != ALL:
            raise DesignError(f"no sheet is called {name!r}{name_hint(name, [*SHEETS, ALL])}")
        if name not in has and name != ALL:
            raise DesignError(
                f"{robot.name} has no {name.replace('_', ' ')}; its sheets are {', '.join(has)}"
            )
    return has if ALL in names else list(dict.fromkeys(names))


def draw(robot: Robot, name: str) -> Drawing:
    """Return one sheet at the scale and on the paper that fit it."""
    return compose(name, lambda factor: SHEETS[name](robot, factor))
