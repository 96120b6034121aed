"""Catalogue of real motors, drivers and batteries that robot files name, each figure with its source."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from chefbot.config import build, parse_yaml, read_bytes
from chefbot.errors import name_hint
from chefbot.robot.drivetrain import Battery, Motor, MotorDriver
from chefbot.robot.errors import RobotFileError
from chefbot.robot.section import RobotSection

FOLDER = Path(__file__).parent
KINDS: dict[str, tuple[str, type[RobotSection]]] = {
    "motor": ("motors.yaml", Motor),
    "driver": ("drivers.yaml", MotorDriver),
    "battery": ("batteries.yaml", Battery),
}
"""Section of a robot file to the catalogue file and the struct of one entry."""


class Catalogue(NamedTuple):
    """Components of the catalogue by name."""

    motors: dict[str, Motor]
    drivers: dict[str, MotorDriver]
    batteries: dict[str, Battery]


@cache
def load_catalogue() -> Catalogue:
    """Return all components that come with the package."""
    return Catalogue(*(_components(section) for section in KINDS))


def component(section: str, name: str, where: str) -> Any:
    """Return the plain data of the catalogue component that a robot file names.

    Raises RobotFileError with the nearest known name if there is no such component.
    """
    entries = _entries(section)
    if name not in entries:
        raise RobotFileError(f"{where}: {section}: the catalogue has no {name!r}{name_hint(name, entries)}")
    return entries[name]


def _components(section: str) -> dict[str, Any]:
    file, kind = KINDS[section]
    return {name: build(entry, kind, f"{FOLDER / file}: {name}") for name, entry in _entries(section).items()}


@cache
def _entries(section: str) -> dict[str, Any]:
    path = FOLDER / KINDS[section][0]
    return dict(parse_yaml(read_bytes(path, "catalogue"), f"catalogue {path}"))
