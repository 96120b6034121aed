"""The units of the matrix: the smallest parts that can be run, drawn in an order that changes with the commit."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import Any, NamedTuple

import msgspec
from tests.chaos.matrix.rows import Row, RunCheck, SoakCheck, SuiteCheck

from chefbot.buildings.parameters import KINDS
from chefbot.errors import UserError
from chefbot.proving.scenario import Building, Scenario
from chefbot.proving.scenario_tasks import Bounds, RunLimits
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.sim.faults.events import FaultEvent, LastingFault
from chefbot.sim.faults.simulated_robot import check_robot_has

FAULT_TIMES = (15.0, 30.0), (18.0, 33.0)
"""Begin and end of the first and the second fault of a run, s; by then the robot drives."""
LIMITS = RunLimits(time=600.0, wall_time=900.0)


class Unit(NamedTuple):
    """One test file, one run, or the soak. seed: of a run, odd, drawn by the unit's name."""

    row: str
    name: str
    work: SuiteCheck | Scenario | SoakCheck
    seed: int = 0


def units_of(row: Row) -> Iterator[Unit]:
    """Yield the units of a row."""
    for check in row.checks:
        match check:
            case SuiteCheck():
                for path in check.paths:
                    yield Unit(row.id, path, SuiteCheck(paths=[path], select=check.select))
            case RunCheck():
                yield from _runs(row.id, check)
            case SoakCheck():
                yield Unit(row.id, f"{check.robot} in {check.world} for {check.hours:g} h", check)


def rotated(units: Sequence[Unit], commit: str) -> list[Unit]:
    """Return the units in the order of this commit: another one for each, the same on every machine."""
    return sorted(units, key=lambda unit: zlib.crc32(f"{commit} {unit.row} {unit.name}".encode()))


def _runs(row: str, check: RunCheck) -> Iterator[Unit]:
    faults = list(combinations(check.faults, 2)) if check.pairs else [(fault,) for fault in check.faults]
    robots = {robot: load_robot(robot) for robot in check.robots}
    for robot, world, given in product(check.robots, check.worlds, faults):
        events = tuple(_event(fault, *times) for fault, times in zip(given, FAULT_TIMES, strict=False))
        if not _possible(robots[robot], events):
            continue
        name = f"{robot} in {world}: {' and '.join(map(_title, given))}" + (
            f", {check.people} people" if check.people else ""
        )
        scenario = Scenario(
            name="chaos",
            world=Building(kind=world) if world in KINDS else world,
            robot=robot,
            people=check.people,
            task=check.task,
            faults=events,
            limits=LIMITS,
            criteria={"contact_speed": Bounds(max=check.contact_speed)},
        )
        yield Unit(row, name, scenario, 1 + 2 * (zlib.crc32(name.encode()) % 500))


def _possible(robot: Robot, events: Sequence[FaultEvent]) -> bool:
    """Return whether the robot has the sensors of the faults."""
    try:
        for event in events:
            check_robot_has(robot, event)
    except UserError:
        return False
    return True


def _title(fault: dict[str, Any]) -> str:
    """Return a fault in words, such as 'offset lidar yaw 0.3'."""
    return " ".join(
        str(value) if isinstance(value, str) else f"{key} {value}" for key, value in fault.items()
    )


def _event(fault: dict[str, Any], begin: float, end: float) -> FaultEvent:
    """Return the event that lasts from `begin` to `end`, s, or happens at `begin`."""
    event: FaultEvent = msgspec.convert({**fault, "at": begin}, FaultEvent)
    return msgspec.structs.replace(event, until=end) if isinstance(event, LastingFault) else event
