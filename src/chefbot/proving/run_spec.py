"""A run to be made, complete with the files it needs, so that any machine can make it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Container, Mapping
from functools import cache
from pathlib import Path

import msgspec

import chefbot
from chefbot.config import parse_yaml, read_bytes
from chefbot.design.generation.generate import generate_robot
from chefbot.errors import UserError
from chefbot.proving.record import RunRecord, machine
from chefbot.proving.scenario import DrawnRobot, Scenario
from chefbot.proving.scenario_tasks import DeliverTask, MapLogTask
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.spec import Robot
from chefbot.sim.faults.simulated_robot import check_robot_has
from chefbot.sim.world.load import is_map, load_any_world, with_drawn_places
from chefbot.sim.world.world import World, built_in_worlds
from chefbot.storage.places import places_path

MAX_FILE_BYTES = 500_000_000
TEMPLATE = "chefbot"
"""Robot from which a drawn one has what no number describes, as in `chefbot robot generate`."""
SOURCE_SUFFIXES = (".py", ".yaml")


class RunSpec(msgspec.Struct, frozen=True, kw_only=True):
    """One run: the scenario, its robot, the contents of its files by name, the seed, and the code that must make it.

    key: hash of all that the result depends on. record: whether the run's log is returned as well.
    """

    key: str
    scenario: Scenario
    robot: Robot
    seed: int
    files: dict[str, bytes]
    code: str
    record: bool = False


@cache
def code_hash() -> str:
    """Return a hash of the package's source files; equal for equal code on every machine."""
    root = Path(chefbot.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.suffix in SOURCE_SUFFIXES:
            digest.update(f"{path.relative_to(root).as_posix()}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def run_specs(scenario: Scenario, base: Path, seeds: list[int], record: bool = False) -> list[RunSpec]:
    """Return the runs of a scenario, with the files that it names; relative ones lie in the folder `base`.

    Raises UserError for a file that is missing or invalid, and for a fault of a sensor that the robot lacks: both are
    found here and not on a worker.
    """
    specs: list[RunSpec] = []
    for seed in seeds:
        if specs and isinstance(scenario.robot, str):
            first = specs[0]
            robot, packed, files = first.robot, first.scenario, first.files
        else:
            robot = robot_of(scenario, base, seed)
            for event in scenario.faults:
                check_robot_has(robot, event)
            packed, files = _packed(scenario, robot, base)
        key = _key(packed, robot, files, seed)
        specs.append(
            RunSpec(
                key=key,
                scenario=packed,
                robot=robot,
                seed=seed,
                files=files,
                code=code_hash(),
                record=record,
            )
        )
    return specs


def robot_of(scenario: Scenario, base: Path, seed: int) -> Robot:
    """Load the robot of a scenario, or draw it. Raises UserError for an unknown or impossible one."""
    if isinstance(scenario.robot, DrawnRobot):
        template = load_robot(TEMPLATE)
        return generate_robot(seed, scenario.robot.numbers, template, load_catalogue()).robot
    return load_robot(str(_resolved(scenario.robot, built_in_robots(), base)))


def _key(scenario: Scenario, robot: Robot, files: Mapping[str, bytes], seed: int) -> str:
    digest = hashlib.sha256(f"{code_hash()} {seed}".encode())
    for part in (_what_counts(scenario), robot):
        digest.update(msgspec.json.encode(part, order="deterministic"))
    for name in sorted(files):
        digest.update(name.encode() + b"\0" + hashlib.sha256(files[name]).digest())
    return digest.hexdigest()[:20]


def _what_counts(scenario: Scenario) -> Scenario:
    """Return the scenario without what no result depends on, so that runs stay done when only that changes.

    robot: the robot itself counts, wherever its file lies.
    """
    return msgspec.structs.replace(
        scenario, description="", robot="", claim=0.0, seeds="", known_failure="", peer=""
    )


def _packed(scenario: Scenario, robot: Robot, base: Path) -> tuple[Scenario, dict[str, bytes]]:
    """Return the scenario with the names of its files in a run's folder, and these files."""
    files: dict[str, bytes] = {}
    world, task = scenario.world, scenario.task
    if isinstance(world, str):
        path = _resolved(world, built_in_worlds(), base)
        _check_places(scenario, load_any_world(str(path), robot, start_text(scenario)), robot)
        if world not in built_in_worlds():
            world = _add_world(files, path)
    if isinstance(task, MapLogTask):
        task = _add_log(files, task, base)
    return msgspec.structs.replace(scenario, world=world, task=task), files


def with_absolute_paths(scenario: Scenario, base: Path) -> Scenario:
    """Return the scenario with its files, which lie in the folder `base`, named from anywhere."""
    folder = base.resolve()
    return _with_renamed_files(scenario, lambda name: str(folder / name))


def with_relative_paths(scenario: Scenario, folder: Path) -> Scenario:
    """Return a scenario of absolute paths for a file in `folder`, so that both can move together."""
    return _with_renamed_files(scenario, lambda name: os.path.relpath(name, folder.resolve()))


def _with_renamed_files(scenario: Scenario, rename: Callable[[str], str]) -> Scenario:
    world, task, robot = scenario.world, scenario.task, scenario.robot
    if isinstance(world, str) and not _is_name(world, built_in_worlds()):
        world = rename(world)
    if isinstance(task, MapLogTask):
        relations = rename(task.relations) if task.relations else ""
        task = msgspec.structs.replace(task, log=rename(task.log), relations=relations)
    if isinstance(robot, str) and not _is_name(robot, built_in_robots()):
        robot = rename(robot)
    return msgspec.structs.replace(scenario, world=world, task=task, robot=robot)


def start_text(scenario: Scenario) -> str:
    """Return the start pose as launch argument, empty for that of the world."""
    return "" if scenario.start is None else str(scenario.start)


def _check_places(scenario: Scenario, world: World, robot: Robot) -> None:
    """Raise UserError if the world has no table to deliver to, and no room to draw one."""
    if isinstance(scenario.task, DeliverTask):
        places = with_drawn_places(world, robot, 1).places
        if "kitchen" not in places or not any(name.startswith("table_") for name in places):
            raise UserError(f"world {world.name} has no room for a kitchen and a table to deliver to")


def _resolved(name: str, built_in: Mapping[str, Path], base: Path) -> Path:
    """Return the path of a file, relative to the folder `base`; a name stays as it is."""
    return Path(name) if _is_name(name, built_in) else base / name


def _is_name(name: str, built_in: Container[str]) -> bool:
    return name in built_in or not (name.endswith((".yaml", ".yml")) or "/" in name)


def _add(files: dict[str, bytes], path: Path, name: str) -> str:
    files[name] = read_bytes(path, "file", MAX_FILE_BYTES)
    return name


def _add_world(files: dict[str, bytes], path: Path) -> str:
    """Add a world file, or a map with its image and places."""
    name = _add(files, path, "world.yaml")
    if not is_map(str(path)):
        return name
    image = Path(str(parse_yaml(files[name], f"map {path}")["image"]))
    _add(files, path.parent / image, image.name)
    files[name] = files[name].replace(str(image).encode(), image.name.encode())
    if places_path(path).exists():
        _add(files, places_path(path), "world.places.yaml")
    return name


def _add_log(files: dict[str, bytes], task: MapLogTask, base: Path) -> MapLogTask:
    log = _add(files, base / task.log, Path(task.log).name)
    relations = ""
    if task.relations:  # the log may have the same name in another folder
        relations = _add(files, base / task.relations, f"relations_{Path(task.relations).name}")
    return msgspec.structs.replace(task, log=log, relations=relations)


def crashed(spec: RunSpec, reason: str) -> RunRecord:
    """Return the record of a run that ended without a result."""
    return RunRecord(
        key=spec.key,
        scenario=spec.scenario.name,
        seed=spec.seed,
        success=False,
        failure=reason,
        machine=machine(),
    )
