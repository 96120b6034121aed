"""`chefbot design`: the sums of a robot, the parts of the catalogue that do, and a robot file with the choice."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from chefbot.commands.design_json import as_plain
from chefbot.commands.design_print import print_sheet
from chefbot.commands.units import amount
from chefbot.config import read_bytes
from chefbot.design.chapter_method import chapter_method
from chefbot.design.checks import judge
from chefbot.design.geometry import following, remedies
from chefbot.design.robot_text import Change, changed, headed, holds
from chefbot.design.selection import Verdict, choose, nearest, verdicts
from chefbot.design.sheet import Sheet
from chefbot.design.stability import loaded
from chefbot.errors import UserError
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.load import parse_robot, robot_path
from chefbot.robot.spec import Robot
from chefbot.robot.units import to_si
from chefbot.runtime.files import write_atomic

WIDTH = 100
"""Columns where there is no terminal that says another."""
MOST_FOLLOWING = 20
_NUMBER = re.compile(r"[+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


class Option(NamedTuple):
    """A value that the command line may override: key of the robot file, unit of a bare number, SI unit."""

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


def run_design(robot: str, overrides: Mapping[str, str | None], write: Path | None, as_json: bool) -> int:
    """Print the sheet and write the file; UserError where a file was asked for and no set of parts does."""
    path = robot_path(robot)
    given = {name: value for name, value in overrides.items() if value is not None}
    text, sheet = work_out(path, given)
    if as_json:
        console = Console(width=10**6, highlight=False, markup=False, soft_wrap=True)
        console.print(json.dumps(as_plain(sheet), indent=2))
    else:
        console = Console(highlight=False)
        console.width = min(console.width, WIDTH) if console.is_terminal else WIDTH
        print_sheet(console, sheet)
    return _write(write, text, sheet, console, as_json) if write else 0


class _Draft(NamedTuple):
    """A robot file in the making: its text, the robot that it describes, and what followed from something else."""

    text: str
    robot: Robot
    where: str
    follows: tuple[Change, ...] = ()

    def with_changes(self, changes: list[Change], asked: bool = False) -> _Draft:
        """With the changes, and with what follows from them in turn."""
        if not changes:
            return self
        text = changed(self.text, changes)
        robot = parse_robot(text.encode(), self.where)
        more = [change for change in following(self.robot, robot) if holds(text, change.path)]
        text = changed(text, more)
        follows = (*self.follows, *([] if asked else changes), *more)
        return _Draft(text, parse_robot(text.encode(), self.where), self.where, follows)


def work_out(path: Path, given: dict[str, str]) -> tuple[str, Sheet]:
    """The sheet of a robot file with overrides, and the file's text with them and all that follows.

    Where no set passes and only the geometry is in the way, the geometry follows, unless the owner asked for it.
    """
    text = read_bytes(path, "robot file").decode()
    where = f"robot file {path}" + (f" with {_options(given)}" if given else "")
    asked = [Change(OPTIONS[name].path, _quantity(name, value), "asked for") for name, value in given.items()]
    draft = _Draft(text, parse_robot(text.encode(), f"robot file {path}"), where).with_changes(
        asked, asked=True
    )
    own = judge(draft.robot, loaded(draft.robot))
    candidates = verdicts(draft.robot, load_catalogue())
    while choose(candidates) is None:
        verdict = nearest(candidates)
        fixed = {OPTIONS[name].path for name in given}
        changes = [c for c in remedies(verdict.robot, verdict.failures) if c.path not in fixed]
        if not changes or len(draft.follows) > MOST_FOLLOWING:
            break
        draft = draft.with_changes(changes)
        candidates = verdicts(draft.robot, load_catalogue())
    chosen = choose(candidates) or nearest(candidates)
    chapter = chapter_method(draft.robot)
    return draft.text, Sheet(
        path.stem, given, draft.robot, list(draft.follows), own, chapter, candidates, chosen
    )


def _quantity(name: str, value: str) -> str:
    """`6` as `6 kg`. UserError for what is no quantity of the option's unit."""
    option = OPTIONS[name]
    text = f"{value} {option.unit}" if _NUMBER.fullmatch(value.strip()) else value
    try:
        to_si(text, option.si)
    except UserError as error:
        raise UserError(f"--{name}: {error}") from None
    return text.strip()


def _options(given: dict[str, str]) -> str:
    return " ".join(
        f"--{name} {value!r}" if " " in value else f"--{name} {value}" for name, value in given.items()
    )


def _write(path: Path, text: str, sheet: Sheet, console: Console, quiet: bool) -> int:
    """The file with the chosen parts; a set that fails is not written."""
    if not sheet.chosen.passed:
        failure = sheet.chosen.failures[0]
        raise UserError(
            f"{path} is not written: no set of the catalogue passes; the nearest lacks {failure.name}, "
            f"{amount(failure.have, failure.unit)} where {amount(failure.bound, failure.unit)} is the bound; "
            f"change {failure.key}"
        )
    text = chosen_text(text, path.stem, sheet)
    robot = parse_robot(text.encode(), f"robot file {path}")
    if robot.motor != sheet.chosen.robot.motor:
        raise AssertionError("the written file does not hold the chosen motor")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"folder {path.parent} cannot be made: {error.strerror}") from None
    write_atomic(path, text.encode())
    if not quiet:
        console.print(f"\nWritten: {path}; next: chefbot check {path}", soft_wrap=True)
    return 0


def chosen_text(text: str, stem: str, sheet: Sheet) -> str:
    """The robot file with the chosen motor, driver and battery, and a heading that says where it is from."""
    verdict: Verdict = sheet.chosen
    robot = verdict.robot
    parts = [
        Change(("motor",), verdict.parts.motor, robot.motor.title),
        Change(("driver",), verdict.parts.driver, robot.driver.title),
        Change(("battery",), verdict.parts.battery, robot.battery.title),
    ]
    if _NAME.fullmatch(stem):
        parts.insert(0, Change(("name",), stem))
    heading = [
        f"Made by `chefbot design {sheet.name} {_options(sheet.given)}`.".replace(" `.", "`."),
        f"{robot.body.payload:.3g} kg at {robot.drive.max_speed:.3g} m/s; {verdict.load.mass:.2f} kg with payload.",
        "A quantity is a number and a unit.",
    ]
    return headed(changed(text, parts), heading)
