"""One run of a scenario with one seed, in this process."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

from chefbot.buildings.generate import generate
from chefbot.buildings.world_text import world_text
from chefbot.launcher.session import session
from chefbot.maths.grid import FREE, Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.proving.record import LOG_NAME, GoalRecord, RunRecord, machine
from chefbot.proving.run_spec import RunSpec, start_text
from chefbot.proving.scenario import Building, Scenario
from chefbot.proving.scenario_tasks import (
    BuiltTask,
    DeliverTask,
    DriveRandomlyTask,
    ExploreTask,
    GoTask,
    LocalizeTask,
    MapLogTask,
    PassDoorTask,
    makes_map,
)
from chefbot.proving.simulated_run import SimulatedRun, Site, TaskFailedError
from chefbot.proving.tasks.built import drive_built
from chefbot.proving.tasks.deliver import deliver
from chefbot.proving.tasks.drive import drive_randomly
from chefbot.proving.tasks.explore import explore, map_figures
from chefbot.proving.tasks.go import go
from chefbot.proving.tasks.localize import localize
from chefbot.proving.tasks.map_log import map_log
from chefbot.proving.tasks.pass_door import draw_passage, pass_door
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import wall_ns
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.free_floor import MARGIN
from chefbot.sim.world.load import load_any_world, with_drawn_places
from chefbot.sim.world.world import World
from chefbot.storage.map_files import map_png

TASK_FUNCTIONS = {
    ExploreTask: explore,
    LocalizeTask: localize,
    GoTask: go,
    PassDoorTask: pass_door,
    DeliverTask: deliver,
    DriveRandomlyTask: drive_randomly,
}
PLAN_CELLS = 400
"""Cells of a side from which a plan is coarser than the world's map."""


class Outcome(NamedTuple):
    """What a task left: a sentence if it failed, figures and the path."""

    failure: str
    figures: dict[str, float]
    run: SimulatedRun | None = None
    path: Sequence[tuple[float, float, float]] = ()
    goals: Sequence[GoalRecord] = ()


def make_run(spec: RunSpec, folder: Path) -> RunRecord:
    """Make one run in an empty folder and return its record. Raises UserError if it cannot begin.

    With `spec.record` the folder then holds the log, run.mcap.
    """
    began_ns, cpu = wall_ns(), process_time()
    for name, content in spec.files.items():
        (folder / Path(name).name).write_bytes(content)
    scenario, task = spec.scenario, spec.scenario.task
    if isinstance(task, MapLogTask):
        figures, path = map_log(task, spec.seed, folder)
        outcome = Outcome("", figures, None, path)
    elif isinstance(task, BuiltTask):
        outcome = _drive_built(spec, folder)
    else:
        outcome = _simulate(spec, folder)
    broken = broken_criteria(scenario, outcome.figures)
    failure = "; ".join(sentence for sentence in (broken, outcome.failure) if sentence)
    run = outcome.run
    return RunRecord(
        key=spec.key,
        scenario=scenario.name,
        seed=spec.seed,
        success=not failure,
        failure=failure,
        figures={name: round(value, 6) for name, value in outcome.figures.items() if math.isfinite(value)},
        goals=run.goals if run else list(outcome.goals),
        path=run.safety.path if run else list(outcome.path),
        incidents=run.safety.incidents if run else [],
        plan=map_png(_coarse(run.safety.obstacles)) if run else b"",
        plan_extent=_extent(run.safety.obstacles) if run else (0.0, 1.0, 0.0, 1.0),
        messages=run.messages.hexdigest() if run else "",
        sim_time=outcome.figures["time"],
        wall_time=round((wall_ns() - began_ns) / 1e9, 2),
        cpu_time=round(process_time() - cpu, 2),
        machine=machine(),
    )


def _coarse(grid: Grid) -> Grid:
    """Return every second cell of a large grid, a fourth of a larger one: a picture needs no more."""
    step = 1 + max(grid.cells.shape) // PLAN_CELLS
    return Grid(grid.cells[::step, ::step], grid.resolution * step, grid.origin_x, grid.origin_y)


def _extent(grid: Grid) -> tuple[float, float, float, float]:
    right = grid.origin_x + grid.width * grid.resolution
    top = grid.origin_y + grid.height * grid.resolution
    return grid.origin_x, right, grid.origin_y, top


def broken_criteria(scenario: Scenario, figures: dict[str, float]) -> str:
    """Return a sentence about the criteria that the figures do not keep, or an empty one."""
    broken = []
    for name, bounds in scenario.criteria.items():
        value = figures.get(name, math.nan)
        if bounds.violated_by(value):
            limit = (
                f"at most {bounds.max:g}"
                if bounds.max is not None and not value < bounds.max
                else (f"at least {bounds.min:g}")
            )
            broken.append(f"{name} is {value:.3g}, expected {limit}")
    return "; ".join(broken)


def _simulate(spec: RunSpec, folder: Path) -> Outcome:
    scenario, robot = spec.scenario, spec.robot
    site = site_of(spec, folder)
    log = folder / LOG_NAME if spec.record else None
    failure = ""
    with session(robot, spec.seed, "simulation", 0.0, log) as system:
        run = SimulatedRun(system, scenario, spec.seed, site, folder)
        try:
            TASK_FUNCTIONS[type(scenario.task)](run)
        except TaskFailedError as error:
            failure = str(error)
        faults = system.faults.counts if system.faults else {}
    if failure and run.time >= scenario.limits.time:
        failure += f" (the limit of {scenario.limits.time:g} s was reached)"
    fault = run.fault or next(iter(faults), "")
    return Outcome(f"a node failed: {fault}" if fault else failure, figures_of(run), run)


def _drive_built(spec: RunSpec, folder: Path) -> Outcome:
    site = site_of(spec, folder)
    failure, left = drive_built(spec, site.world, site.name, folder)
    return Outcome(failure, left.figures, None, left.path, left.goals)


def site_of(spec: RunSpec, folder: Path) -> Site:
    """Load or generate the world of a run; its start is drawn by the seed where the robot has to localize."""
    scenario, robot = spec.scenario, spec.robot
    name = world_name(spec, folder)
    world = load_any_world(name, robot, start_text(scenario))
    if isinstance(scenario.task, LocalizeTask) and scenario.start is None:
        world = load_any_world(name, robot, str(list(_drawn_start(world, robot, spec.seed))))
    world = with_drawn_places(world, robot, spec.seed)
    if isinstance(scenario.task, PassDoorTask):
        start = draw_passage(world, robot, spec.seed).start
        world = replace(world, places={**world.places, "home": start})
    return Site(world, name, world.start if makes_map(scenario.task) else IDENTITY)


def _drawn_start(world: World, robot: Robot, seed: int) -> SE2:
    """Return a pose on the floor that the robot can get to."""
    floor = reachable(world, robot, MARGIN)
    rng = np.random.default_rng([seed, 0x57A7])
    row, column = rng.choice(np.argwhere(floor.cells == FREE))
    x, y = floor.origin_x + (column + 0.5) * floor.resolution, floor.origin_y + (row + 0.5) * floor.resolution
    return SE2(round(float(x), 3), round(float(y), 3), round(float(rng.uniform(-math.pi, math.pi)), 3))


def world_name(spec: RunSpec, folder: Path) -> str:
    """Return the name or path of the run's world; a building is generated by the seed and written first."""
    world = spec.scenario.world
    if isinstance(world, Building):
        building = generate(world.kind, spec.seed, world.numbers, spec.robot.circumscribed_radius)
        (folder / "world.yaml").write_text(world_text(building, f"{world.kind}, seed {spec.seed}"))
        return str(folder / "world.yaml")
    return str(folder / world) if world in spec.files else world


def figures_of(run: SimulatedRun) -> dict[str, float]:
    """Return the figures that the observers of a run have measured."""
    mapping, localized = run.scorer.mapping.errors(), run.scorer.delivering.errors()
    figures = {
        "time": run.time,
        "path_length": run.scorer.path_length,
        "collisions": float(len(run.scorer.collisions)),
        "contact_speed": run.safety.contact_speed,
        "near_misses": float(run.safety.near_misses),
        "min_clearance": run.safety.min_clearance,
        "near_people": run.safety.seconds_near_people,
        "recoveries": float(run.scorer.recoveries),
        "wrongly_localized": run.wrong_claims.seconds,
        "odometry_drift": run.drift.drift(),
    }
    if run.goals:
        figures["goals_reached"] = sum(goal.reached for goal in run.goals) / len(run.goals)
    for name, errors in (("map_error", mapping), ("localization_error", localized)):
        if len(errors):
            figures[f"{name}_median"] = float(np.median(errors))
            figures[f"{name}_max"] = float(errors.max())
    figures.update(run.figures)
    if makes_map(run.scenario.task):
        figures.update(map_figures(run))
    return figures
