"""Implementation of `chefbot prove`: make the runs of scenarios, and write tables and a page."""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
from rich.console import Console
from rich.table import Table

from chefbot.errors import ChefbotError, UserError
from chefbot.kernels.precompile import compile_kernels
from chefbot.plural import number_of
from chefbot.proving.cluster import check_address, cluster
from chefbot.proving.collect import collect
from chefbot.proving.comparison import FigureChange, changes
from chefbot.proving.page import page
from chefbot.proving.progress import run_progress
from chefbot.proving.record import CANNOT_RUN, RunRecord
from chefbot.proving.results_folder import Request, ResultsFolder, write_tables
from chefbot.proving.run_spec import RunSpec, run_specs
from chefbot.proving.scenario import Scenario, built_in_scenarios, is_judging, load_scenario, parse_seeds
from chefbot.proving.statistics import wilson
from chefbot.robot.load import built_in_robots, find_robot
from chefbot.runtime.clock import wall_ns
from chefbot.storage.atomic_files import write_atomic

PAGE = "index.html"
BATCH = 4
"""Runs per worker between two looks at the time."""
console = Console(highlight=False, soft_wrap=True)


class ProveOptions(NamedTuple):
    """The options of `chefbot prove`."""

    names: Sequence[str]
    seeds: str | None
    robot: str
    workers: int
    scheduler: str
    out: Path
    resume: bool
    record: bool
    against: Path | None


def list_scenarios() -> None:
    """Print name, robot and description of the built-in scenarios."""
    for name in built_in_scenarios():
        scenario = load_scenario(name)
        console.print(f"{name:22} {scenario.robot_name:18} {scenario.description}")


def run_prove(options: ProveOptions) -> int:
    """Make the runs that are not done yet; return 1 if a claim is missed or something got worse, else 0."""
    results = ResultsFolder(options.out)
    old = ResultsFolder(options.against).records() if options.against else []
    request = results.request() if options.resume and not options.names else requested(options)
    specs = specs_of(request, options.record)
    check_common_runs(options, old, specs)
    results.create(request)
    done = {spec.key: record for spec in specs if (record := _done(results, spec, options.record))}
    missing = [spec for spec in specs if spec.key not in done]
    try:
        make_missing(results, missing, done, options.workers, options.scheduler)
    finally:
        made = [done[spec.key] for spec in specs if spec.key in done]
        if made:
            differences = changes(old, made)
            write_results(options, request.scenarios, made, differences)
    print_summary(request.scenarios, made, differences)
    if old and not any(change.is_better or change.is_worse for change in differences):
        pairs = max(change.difference.pairs for change in differences)
        console.print(
            f"{number_of(pairs, 'run')} compared with {options.against}: nothing changed significantly"
        )
    console.print(f"page in {options.out / PAGE}, tables beside it")
    missed = claims_missed(request.scenarios, made) or any_that_could_not_run(made)
    return int(missed or any(change.is_worse for change in differences))


def specs_of(request: Request, record: bool) -> list[RunSpec]:
    """Return the runs of all scenarios. Raises UserError that names the scenario with bad input."""
    specs: list[RunSpec] = []
    for scenario, folder, seeds in zip(request.scenarios, request.folders, request.seeds, strict=True):
        try:
            specs += run_specs(scenario, Path(folder), seeds, record)
        except ChefbotError as error:
            raise UserError(f"scenario {scenario.name}: {error}") from None
    return specs


def check_common_runs(options: ProveOptions, old: Sequence[RunRecord], specs: Sequence[RunSpec]) -> None:
    """Raise UserError if the older results have no run to compare with."""
    known = {(record.scenario, record.seed) for record in old}
    if old and not any((spec.scenario.name, spec.seed) in known for spec in specs):
        raise UserError(
            f"--against {options.against}: it has no run of these scenarios with one of these seeds"
        )


def requested(options: ProveOptions) -> Request:
    """Return the scenarios and seeds of the command line. Raises UserError for unknown ones."""
    scenarios = [_with_robot(load_scenario(name), options.robot) for name in options.names]
    names = [scenario.name for scenario in scenarios]
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"two scenarios are called {name}; a name must be unique in the results")
    built_in = built_in_scenarios()
    folders = ["." if name in built_in else str(Path(name).resolve().parent) for name in options.names]
    seeds = [
        parse_seeds(scenario.seeds if options.seeds is None else options.seeds, "--seeds")
        for scenario in scenarios
    ]
    return Request(scenarios=scenarios, folders=folders, seeds=seeds)


def make_missing(
    results: ResultsFolder,
    missing: list[RunSpec],
    done: dict[str, RunRecord],
    workers: int,
    scheduler: str,
    minutes: float = math.inf,
) -> None:
    """Make the runs that have no record, and add theirs to `done`; begin no more after `minutes`.

    workers: processes of this machine, 0 for one per core.
    """
    if not missing or minutes <= 0.0:
        return
    check_address(scheduler)
    compile_kernels(console)  # once for all workers of this machine
    total = len(done) + len(missing)
    last = "" if math.isinf(minutes) else f"; after {minutes:g} min no other begins"
    console.print(f"{number_of(total, 'run')}, {len(done)} of them done already{last}")
    workers = min(workers or os.cpu_count() or 1, len(missing))
    batch = len(missing) if math.isinf(minutes) else BATCH * workers
    began_ns = wall_ns()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # `kill` keeps what is done, as Ctrl-C does
    try:
        with (
            run_progress(console, total, done.values()) as progress,
            cluster(scheduler, workers) as connected,
        ):

            def add(record: RunRecord, log: bytes) -> None:
                results.add(record, log)
                done[record.key] = record
                progress.add(record)

            try:
                for first in range(0, len(missing), batch):
                    if wall_ns() - began_ns > minutes * 60e9:
                        break
                    collect(connected, missing[first : first + batch], add)
            except KeyboardInterrupt:
                console.print("\nEnding the workers.")  # at once, as that takes seconds
                raise
    except KeyboardInterrupt:
        console.print(
            f"{len(done)} of {number_of(total, 'run')} are done and kept; "
            f"`chefbot prove --resume --out {results.folder}` resumes"
        )
        raise


def write_results(
    options: ProveOptions,
    scenarios: Sequence[Scenario],
    made: Sequence[RunRecord],
    differences: Sequence[FigureChange],
) -> None:
    """Write the tables and the page."""
    write_tables(options.out, list(made))
    write_atomic(options.out / PAGE, page(scenarios, made, differences, options.out).encode())


def print_summary(
    scenarios: Sequence[Scenario], made: Sequence[RunRecord], differences: Sequence[FigureChange]
) -> None:
    """Print success with its interval, odd seeds and even ones apart, and what changed significantly."""
    table = Table("scenario", "seeds", "success", "95 % interval", box=None)
    for scenario in scenarios:
        for judging in (True, False):
            group = [r for r in made if r.scenario == scenario.name and is_judging(r.seed) == judging]
            if group:
                share = wilson(sum(record.success for record in group), len(group))
                table.add_row(
                    scenario.name,
                    "odd, judged" if judging else "even, not judged",
                    f"{share.successes} of {share.total}",
                    f"{share.low:.0%} to {share.high:.0%}",
                )
    console.print(table)
    _print_changes(differences)


def _print_changes(differences: Sequence[FigureChange]) -> None:
    for change in differences:
        if change.is_better or change.is_worse:
            verdict = "better" if change.is_better else "[red]worse[/]"
            console.print(
                f"{verdict}: {change.scenario}, {change.figure}: {change.old:.4g} -> {change.new:.4g}"
                f" ({change.difference.low:+.3g} to {change.difference.high:+.3g})"
            )


def claims_missed(scenarios: Sequence[Scenario], made: Sequence[RunRecord]) -> bool:
    """Return whether the judged runs of a scenario succeed less often than it claims; print which."""
    missed = False
    for scenario in scenarios:
        judged = [r.success for r in made if r.scenario == scenario.name and is_judging(r.seed)]
        if scenario.claim and not judged:
            console.print(
                f"{scenario.name} claims {scenario.claim:.0%} success: not judged without odd seeds"
            )
        if judged and sum(judged) / len(judged) < scenario.claim:
            console.print(
                f"[red]claim missed[/]: {scenario.name} claims {scenario.claim:.0%} success, {sum(judged)} of"
                f" {number_of(len(judged), 'judged run')} succeeded"
            )
            missed = True
    return missed


def any_that_could_not_run(made: Sequence[RunRecord]) -> bool:
    """Return whether a run could not begin, which is not a failure of the robot; print how many, and why."""
    reasons = [record.failure for record in made if record.failure.startswith(CANNOT_RUN)]
    if reasons:
        console.print(f"[red]{len(reasons)} of {number_of(len(made), 'run')} could not begin[/]: ", end="")
        console.print(reasons[0].removeprefix(CANNOT_RUN), markup=False)
    return bool(reasons)


def _done(results: ResultsFolder, spec: RunSpec, needs_log: bool) -> RunRecord | None:
    """Return the record of a run that need not be made again."""
    record = results.find(spec.key)
    if record is None or (needs_log and not results.log_path(record).exists()):
        return None
    return record


def _with_robot(scenario: Scenario, robot: str) -> Scenario:
    """Return the scenario with the robot of the command line, whose file is named from the current folder."""
    if not robot:
        return scenario
    is_name = robot in built_in_robots()
    return msgspec.structs.replace(scenario, robot=robot if is_name else str(find_robot(robot).resolve()))
