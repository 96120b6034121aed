"""`chefbot robot design`: calculations of a robot, suitable parts of the catalogue, a robot file with them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from chefbot.cli.robot.design_json import as_plain
from chefbot.cli.robot.design_print import print_sheet
from chefbot.cli.robot.units import amounts
from chefbot.config import read_bytes
from chefbot.design.sizing.chapter_method import chapter_method
from chefbot.design.sizing.component_selection import Verdict, nearest, settled, verdicts
from chefbot.design.sizing.dependent_dimensions import dependent_changes, moved_sensors
from chefbot.design.sizing.design_sheet import Sheet
from chefbot.design.sizing.requirements import judge
from chefbot.design.sizing.robot_file_editor import Change, changed, headed, value_of
from chefbot.design.sizing.stability import loaded
from chefbot.design.sizing.suggested_fixes import geometry_fixes
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.units import UnitError, to_si
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.load import LIKE, find_robot, parse_robot
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import make_folder, write_atomic

WIDTH = 100
"""Number of columns where the output is not a terminal."""
MAX_DEPENDENT_CHANGES = 20
"""Maximum number of dependent changes, after which the search for a passing design ends."""
_NUMBER = re.compile(r"[+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


class Option(NamedTuple):
    """A value that the command line can override: key of the robot file, unit of a bare number, SI unit."""

    path: tuple[str, ...]
    unit: str
    si: str


OPTIONS = {
    "payload": Option(("body", "payload"), "kg", "kg"),
    "speed": Option(("drive", "max_speed"), "m/s", "m/s"),
    "slope": Option(("drive", "max_slope"), "deg", "rad"),
    "acceleration": Option(("drive", "max_acceleration"), "m/s^2", "m/s^2"),
    "run-time": Option(("power", "run_time"), "h", "s"),
    "wheel": Option(("wheels", "diameter"), "m", "m"),
    "radius": Option(("body", "radius"), "m", "m"),
}


def run_design(robot: str, overrides: Mapping[str, str | None], write: Path | None, as_json: bool) -> None:
    """Print the design sheet and write the robot file.

    Raises UserError for an invalid override, or if a file is requested and no set of parts passes.
    """
    path = find_robot(robot)
    given = {name: value for name, value in overrides.items() if value is not None}
    text, sheet = work_out(path, given)
    if as_json:
        console = Console(width=10**6, highlight=False, markup=False, soft_wrap=True)
        console.print(json.dumps(as_plain(sheet), indent=2))
    else:
        console = Console(highlight=False)
        console.width = min(console.width, WIDTH) if console.is_terminal else WIDTH
        print_sheet(console, sheet)
    if write is not None:
        _write(write, text, sheet)
        if not as_json:
            console.print(f"\nWritten: {write}; next: chefbot robot check {write}", soft_wrap=True)


class _Draft(NamedTuple):
    """A draft of a robot file: its text, the robot that it describes, and the dependent changes."""

    path: Path
    text: str
    robot: Robot
    follows: tuple[Change, ...] = ()

    def with_changes(self, changes: list[Change], requested: bool = False) -> _Draft:
        """Return the draft with the changes and those that depend on them."""
        if not changes:
            return self
        texts = {change.path: change.text for change in changes}
        diameter = _metres(texts.get(("wheels", "diameter")), self.robot.wheels.diameter)
        radius = texts.get(("body", "radius"))
        more = dependent_changes(self.robot, diameter, None if radius is None else to_si(radius, "m"))
        text = changed(self.text, [*changes, *more])
        follows = (*self.follows, *([] if requested else changes), *more)
        return _Draft(self.path, text, parse_robot(text.encode(), self.path), follows)


def _metres(text: str | None, otherwise: float) -> float:
    return otherwise if text is None else to_si(text, "m")


def work_out(path: Path, given: dict[str, str]) -> tuple[str, Sheet]:
    """Return the robot file's text with overrides and dependent changes, and its design sheet.

    Where no set of parts passes only because of the geometry, the geometry is adapted, except for overridden values.
    Raises UserError for an invalid override or robot file.
    """
    draft = _overridden(path, given)
    own = judge(draft.robot, loaded(draft.robot))
    candidates = verdicts(draft.robot, load_catalogue())
    while (chosen := settled(candidates)) is None:
        changes = geometry_fixes(candidates, {OPTIONS[name].path for name in given})
        if not changes or len(draft.follows) > MAX_DEPENDENT_CHANGES:
            break
        draft = draft.with_changes(changes)
        candidates = verdicts(draft.robot, load_catalogue())
    sheet = Sheet(
        path.stem, given, draft.robot, list(draft.follows), own, chapter_method(draft.robot), candidates,
        chosen or nearest(candidates),
    )  # fmt: skip
    return _movable(draft.text, path), sheet


def _movable(text: str, path: Path) -> str:
    """Return the text for a file in another folder: its `like` becomes an absolute path."""
    like = value_of(text, (LIKE,))
    if like is None or not ("/" in like or like.endswith((".yaml", ".yml"))):
        return text
    return changed(text, [Change((LIKE,), str((path.parent / like).resolve()))])


def _overridden(path: Path, given: dict[str, str]) -> _Draft:
    """Return the robot file with the overrides."""
    data = read_bytes(path, "robot file")
    draft = _Draft(path, data.decode(errors="replace"), parse_robot(data, path))
    changes = [
        Change(OPTIONS[name].path, _quantity(name, value), "requested") for name, value in given.items()
    ]
    try:
        return draft.with_changes(changes, requested=True)
    except ChefbotError as error:
        raise UserError(f"with {_options(given)}: {error}") from None


def _quantity(name: str, value: str) -> str:
    """Return `6` as `6 kg`. Raises UserError for a text that is not a quantity of the option's unit."""
    option = OPTIONS[name]
    text = f"{value} {option.unit}" if _NUMBER.fullmatch(value.strip()) else value
    try:
        to_si(text, option.si)
    except UnitError as error:
        raise UserError(f"--{name}: {error}") from None
    return text.strip()


def _options(given: dict[str, str]) -> str:
    return " ".join(
        f"--{name} {value!r}" if " " in value else f"--{name} {value}" for name, value in given.items()
    )


def _write(path: Path, text: str, sheet: Sheet) -> None:
    """Write the file with the selected parts. Raises UserError if no set passes."""
    if not sheet.chosen.passed:
        failure = sheet.chosen.failures[0]
        have, bound = amounts(failure.have, failure.bound, failure.unit)
        raise UserError(
            f"{path} is not written: no set of parts in the catalogue passes; the nearest fails at {failure.name}: "
            f"{have}, the bound is {bound}; "
            f"change {failure.key} or reduce the requirements"
        )
    text = chosen_text(text, path.stem, sheet)
    parse_robot(text.encode(), path)
    make_folder(path.parent)
    write_atomic(path, text.encode())


def chosen_text(text: str, stem: str, sheet: Sheet) -> str:
    """Return the robot file with the selected motor, driver and battery, and a heading with its origin."""
    verdict: Verdict = sheet.chosen
    robot = verdict.robot
    parts = [
        Change(("motor",), verdict.parts.motor, robot.motor.title),
        Change(("driver",), verdict.parts.driver, robot.driver.title),
        Change(("battery",), verdict.parts.battery, robot.battery.title),
    ]
    parts += moved_sensors(sheet.robot, robot)
    if _NAME.fullmatch(stem):
        parts.insert(0, Change(("name",), stem))
    heading = [
        f"Made by `chefbot robot design {sheet.name} {_options(sheet.given)}`.".replace(" `.", "`."),
        f"{robot.body.payload:.3g} kg at {robot.drive.max_speed:.3g} m/s; {verdict.load.mass:.2f} kg with payload.",
        "A quantity is a number and a unit.",
    ]
    return headed(changed(text, parts), heading)
