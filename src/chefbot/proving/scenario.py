"""A scenario: world, robot, people, faults, task and criteria of success, read from one YAML file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from chefbot.buildings.parameters import KINDS, BuildingError, draw_numbers
from chefbot.buildings.people_spec import MAX_PEOPLE, PeopleSpec
from chefbot.config import build, find_file, parse_yaml, read_bytes
from chefbot.errors import UserError, name_hint
from chefbot.file_kinds import SCENARIO, check_kind
from chefbot.proving.figures import FIGURES
from chefbot.proving.scenario_tasks import Bounds, MapLogTask, RunLimits, Task
from chefbot.sim.faults.events import FaultEvent

SCENARIO_FOLDER = Path(__file__).parent / "scenarios"
MAX_SEEDS = 100_000
_SEED_RANGE = re.compile(r"\s*([0-9]{1,10})\s*(?:\.\.\s*([0-9]{1,10})\s*)?")


class Building(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A building that is generated with the run's seed; see `chefbot world kinds`."""

    kind: Annotated[str, Meta(description="kind of building")]
    numbers: Annotated[
        dict[str, float],
        Meta(description="numbers that are not drawn, as with `chefbot world generate --set`"),
    ] = {}


class DrawnRobot(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A robot that is generated with the run's seed; see `chefbot robot generate`."""

    numbers: Annotated[
        dict[str, float],
        Meta(description="numbers that are not drawn, as with `chefbot robot generate --set`"),
    ] = {}


class Scenario(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A claim that can be judged: what the robot is to do where, and when a run counts as a success."""

    name: Annotated[str, Meta(pattern=r"^[a-z0-9][a-z0-9_]*$", max_length=60, description="name in results")]
    description: Annotated[str, Meta(description="what it shows, in a sentence")] = ""
    world: Annotated[
        str | Building,
        Meta(
            description="a built-in world, a world file, a ROS map, or a kind of building drawn by the seed"
        ),
    ] = "room"
    robot: Annotated[
        str | DrawnRobot, Meta(description="a built-in robot, a robot file, or a robot drawn by the seed")
    ] = "chefbot_lidar"
    profile: Annotated[
        Literal["perfect", "real", "assembled"], Meta(description="imperfections of the robot")
    ] = "real"
    start: Annotated[list[float] | None, Meta(description="start pose [x, y, yaw] in the world, m, rad")] = (
        None
    )
    people: Annotated[
        Annotated[int, Meta(ge=-1, le=MAX_PEOPLE)] | PeopleSpec,
        Meta(description="number of people, or who they are; -1: as in the world"),
    ] = 0
    faults: Annotated[tuple[FaultEvent, ...], Meta(description="fault events, see docs/faults.md")] = ()
    odometry_error: Annotated[
        float, Meta(ge=0, le=10, description="factor on the errors of wheels, floor and gyro")
    ] = 1.0
    task: Annotated[Task, Meta(description="what the robot does")]
    limits: RunLimits = RunLimits()
    criteria: Annotated[
        dict[str, Bounds], Meta(description="figures with bounds that a successful run keeps")
    ] = msgspec.field(default_factory=lambda: {"collisions": Bounds(max=0.0)})
    claim: Annotated[
        float, Meta(ge=0, le=1, description="smallest share of successful runs; below it the exit code is 1")
    ] = 0.0
    known_failure: Annotated[
        str, Meta(description="why it fails today, in a file of tests/regressions; empty once it is fixed")
    ] = ""
    peer: Annotated[str, Meta(description="figure that others publish for the same, with its source")] = ""
    seeds: Annotated[str, Meta(description="seeds if none are given, as 1..20 or 3,7")] = "1..20"

    @property
    def robot_name(self) -> str:
        """Name of the robot for display."""
        return self.robot if isinstance(self.robot, str) else "drawn by the seed"


def built_in_scenarios() -> dict[str, Path]:
    """Return the files of the scenarios that come with the package by name."""
    return {path.stem: path for path in sorted(SCENARIO_FOLDER.glob("*.yaml"))}


def load_scenario(name_or_path: str) -> Scenario:
    """Load a built-in scenario by name, or a file by path. Raises ConfigError with file, key and reason."""
    path = find_file("scenario", name_or_path, built_in_scenarios(), UserError)
    return parse_scenario(read_bytes(path, "scenario"), f"scenario {path}")


def parse_scenario(data: bytes, where: str) -> Scenario:
    """Parse a scenario from YAML text; `where` begins every error message."""
    content = parse_yaml(data, where)
    check_kind(content, SCENARIO, where, UserError)
    _check_criteria(content, where)
    scenario = build(content, Scenario, where)
    if isinstance(scenario.task, MapLogTask) and "criteria" not in content:
        scenario = msgspec.structs.replace(scenario, criteria={})  # a log has no collisions
    _check(scenario, where)
    return scenario


def _check_criteria(content: object, where: str) -> None:
    """Name the figure whose bounds are wrong, which the validation of the whole does not."""
    criteria = content.get("criteria") if isinstance(content, dict) else None
    for figure, bounds in criteria.items() if isinstance(criteria, dict) else ():
        build(bounds, Bounds, f"{where}: criteria: {figure}")


def _check(scenario: Scenario, where: str) -> None:
    parse_seeds(scenario.seeds, f"{where}: seeds")
    for figure, bounds in scenario.criteria.items():
        if figure not in FIGURES:
            raise UserError(f"{where}: criteria: there is no figure {figure!r}{name_hint(figure, FIGURES)}")
        if not bounds.can_be_kept:
            raise UserError(f"{where}: criteria: {figure} needs a min, or a max that is not below it")
    if isinstance(scenario.world, Building) and scenario.world.kind not in KINDS:
        kind = scenario.world.kind
        raise UserError(f"{where}: world: there is no kind of building {kind!r}{name_hint(kind, KINDS)}")
    if isinstance(scenario.world, Building):
        _check_numbers(scenario.world, where)
    if scenario.start is not None and len(scenario.start) != 3:
        raise UserError(f"{where}: start: must be three numbers [x, y, yaw], in metres and radians")


def _check_numbers(building: Building, where: str) -> None:
    """Find a wrong number of a building here, and not in the first run."""
    try:
        draw_numbers(building.kind, building.numbers, np.random.default_rng(0))
    except BuildingError as error:
        raise UserError(f"{where}: world: {error}") from None


def parse_seeds(text: str, where: str) -> list[int]:
    """Return the seeds of '1..20', '3' or '1..5,9', each once, in order. Raises UserError for anything else."""
    seeds: list[int] = []
    for part in text.split(","):
        match = _SEED_RANGE.fullmatch(part)
        if match is None:
            raise UserError(f"{where} {text[:60]!r}: give seeds as 1..20, 7 or 1..5,9")
        first, last = int(match[1]), int(match[2] or match[1])
        if last < first or last - first >= MAX_SEEDS or last >= 2**31:
            raise UserError(
                f"{where} {text[:60]!r}: {part.strip()} is not a range of at most {MAX_SEEDS} seeds"
            )
        seeds += range(first, last + 1)
    return sorted(set(seeds))


def is_judging(seed: int) -> bool:
    """Return whether runs with a seed are for judging: odd ones are, even ones are for tuning."""
    return seed % 2 == 1
