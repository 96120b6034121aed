"""Smaller variants of a scenario: fewer people, faults and goals, less time, less in the building."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.proving.record import RunRecord
from chefbot.proving.scenario import Building, Scenario
from chefbot.proving.scenario_tasks import DeliverTask, DriveRandomlyTask, GoTask

EMPTY_NUMBERS = {
    "clutter": 0.0,
    "moved_chairs": 0.0,
    "boards": 0,
    "steps": 0,
    "holes": 0,
    "mirrors": 0,
    "glass": 0.0,
    "carpets": 0.0,
}
"""Numbers of a building without what stands, hangs or lies about."""
FEW_PEOPLE = (0, 1, 2, 4, 6)
TIME_AFTER_FAILURE = 5.0
"""Time that a run continues after its last incident, s."""


class Reduction(NamedTuple):
    """A smaller scenario, and what was left out."""

    scenario: Scenario
    what: str


def fewer_faults(scenario: Scenario, _: RunRecord) -> Iterator[Reduction]:
    """Yield no fault, then each alone, then all but one."""
    faults = scenario.faults
    if faults:
        yield _with(scenario, "without faults", faults=())
    if len(faults) > 1:
        for fault in faults:
            yield _with(scenario, "with one fault", faults=(fault,))
    if len(faults) > 2:
        for left_out in range(len(faults)):
            rest = tuple(fault for i, fault in enumerate(faults) if i != left_out)
            yield _with(scenario, "with one fault fewer", faults=rest)


def fewer_people(scenario: Scenario, _: RunRecord) -> Iterator[Reduction]:
    """Yield scenarios without people, then with more and more of them."""
    people = scenario.people
    count = people.count if isinstance(people, PeopleSpec) else people
    for fewer in FEW_PEOPLE:
        if fewer < count or count < 0:  # as many as in the world
            smaller = (
                msgspec.structs.replace(people, count=fewer) if isinstance(people, PeopleSpec) else fewer
            )
            yield _with(scenario, f"{fewer} people", people=smaller)


def smaller_task(scenario: Scenario, _: RunRecord) -> Iterator[Reduction]:
    """Yield a task with one goal, or with half the time."""
    task = scenario.task
    if isinstance(task, GoTask) and task.goals > 1:
        yield _with(scenario, "one goal", task=GoTask(goals=1))
    elif isinstance(task, DeliverTask) and task.tables > 1:
        yield _with(scenario, "one table", task=msgspec.structs.replace(task, tables=1))
    elif isinstance(task, DriveRandomlyTask) and task.duration > 20.0:
        shorter = msgspec.structs.replace(task, duration=task.duration / 2)
        yield _with(scenario, "half the time to drive", task=shorter)


def emptier_building(scenario: Scenario, _: RunRecord) -> Iterator[Reduction]:
    """Yield a building without clutter and hazards, then without each of them."""
    world = scenario.world
    if not isinstance(world, Building):
        return
    if not EMPTY_NUMBERS.items() <= world.numbers.items():
        yield _with_numbers(scenario, world, "without clutter and hazards", EMPTY_NUMBERS)
    for name, number in EMPTY_NUMBERS.items():
        if world.numbers.get(name) != number:
            yield _with_numbers(scenario, world, f"without {name.replace('_', ' ')}", {name: number})


def perfect_robot(scenario: Scenario, _: RunRecord) -> Iterator[Reduction]:
    """Yield a robot without imperfections."""
    if scenario.profile != "perfect":
        yield _with(scenario, "a perfect robot", profile="perfect")


def shorter(scenario: Scenario, record: RunRecord) -> Iterator[Reduction]:
    """Yield a drive that ends soon after the last incident; a time limit would be a failure of its own."""
    task = scenario.task
    last = max((time for time, *_ in record.incidents), default=record.sim_time)
    ends = float(round(last + TIME_AFTER_FAILURE))
    if isinstance(task, DriveRandomlyTask) and ends < task.duration:
        yield _with(scenario, f"{ends:.0f} s", task=msgspec.structs.replace(task, duration=ends))


REDUCERS = (fewer_faults, fewer_people, smaller_task, emptier_building, perfect_robot, shorter)
"""Functions of a failing scenario and its record that yield smaller scenarios, those that leave out more first."""


def _with(scenario: Scenario, what: str, **changes: object) -> Reduction:
    return Reduction(msgspec.structs.replace(scenario, **changes), what)


def _with_numbers(scenario: Scenario, world: Building, what: str, numbers: dict[str, float]) -> Reduction:
    smaller = msgspec.structs.replace(world, numbers={**world.numbers, **numbers})
    return _with(scenario, what, world=smaller)
