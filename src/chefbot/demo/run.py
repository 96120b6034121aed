"""Implementation of `chefbot demo`: set up the simulation, run the demo, write its summary and report."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import numpy as np
from rich.table import Table

from chefbot.demo.demo import ABORTED, Demo, DemoOptions, console
from chefbot.demo.processes import MAX_REAL_TIME_FACTOR, DemoProcesses
from chefbot.demo.report import write_report
from chefbot.demo.summary import DemoResult, summarize
from chefbot.errors import UserError
from chefbot.kernels.precompile import start_compilation
from chefbot.launcher.design_errors import print_design_errors
from chefbot.launcher.session import session
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import LeaderClock
from chefbot.signals import INTERRUPTED, stop_on_signals
from chefbot.sim.realism import check_profile
from chefbot.sim.world.load import load_any_world, with_drawn_places
from chefbot.sim.world.world import World
from chefbot.storage.atomic_files import make_folder, write_atomic

TABLES = 3
"""Number of tables that order."""


def run_demo(options: DemoOptions) -> int:
    """Run the demo; return the exit code: 0 if all was delivered without a collision, 130 after Ctrl-C, else 1."""
    speed = _speed(options.speed)
    check_profile(options.profile)
    clock = (
        LeaderClock(min(speed or MAX_REAL_TIME_FACTOR, MAX_REAL_TIME_FACTOR)) if options.processes else None
    )
    robot = load_robot(options.robot)
    print_design_errors(console, options.robot, robot)
    world = load_any_world(options.world, robot, options.start, options.unknown)
    world = with_drawn_places(world, robot, options.seed)
    tables = chosen_tables(world, options.seed)
    make_folder(options.out)
    warming = start_compilation(console, None if options.headless or options.lan else options.port)
    log = options.out / "run.mcap"
    with session(robot, options.seed, "simulation", speed, log, clock) as system, ExitStack() as stack:
        demo = Demo(system, robot, world, options, tables, warming)
        if clock is not None:
            warming.wait()
            demo.processes = DemoProcesses(system, clock, console, demo.is_running)
            stack.callback(demo.processes.close)
        with stop_on_signals(demo.abort, notice="Ending; the report of what is done is written."):
            demo.run()
    result = summarize(demo)
    write_atomic(options.out / "summary.json", result.to_json().encode())
    write_report(options.out, result, demo.scorer, world, robot)
    _print(result, demo.processes, options.out)
    if not demo.is_running():
        return INTERRUPTED
    return 0 if result.success else 1


def chosen_tables(world: World, seed: int) -> list[str]:
    """Return the tables that order: three at random, or all where the world has fewer."""
    tables = sorted(name for name in world.places if name.startswith("table_"))
    if not tables or "kitchen" not in world.places:
        raise UserError(
            f"world {world.name} has no room for a kitchen and a table; the demo has nowhere to go"
        )
    rng = np.random.default_rng([seed, TABLES])
    return [tables[i] for i in rng.choice(len(tables), min(TABLES, len(tables)), replace=False)]


def driver_of(robot: str) -> str:
    """Return the driver of a robot's lidar, by the robot's name or path. Raises UserError if there is none."""
    lidar = load_robot(robot).sensors.lidar
    if lidar is None or not lidar.driver:
        raise UserError(
            f"robot {robot} has no lidar with a driver (sensors.lidar.driver), whose bytes there are"
        )
    return lidar.driver


def _speed(text: str) -> float:
    try:
        speed = 0.0 if text == "max" else float(text)
    except ValueError:
        raise UserError(f"--speed {text!r} must be 'max' or a real-time factor") from None
    if not 0.0 <= speed <= 1000.0:
        raise UserError(f"--speed {text} must lie between 0 and 1000")
    return speed


def _print(result: DemoResult, processes: DemoProcesses | None, out: Path) -> None:
    table = Table(box=None, show_header=False)
    for name, value in [*result.table(), *(processes.table() if processes else [])]:
        table.add_row(name, value)
    console.print(table)
    verdict = "[green]success[/]" if result.success else f"[red]failed[/]: {result.failure}"
    verdict = ABORTED.capitalize() if result.failure == ABORTED else verdict
    console.print(f"{verdict}; pictures in {out / 'report.html'}")
