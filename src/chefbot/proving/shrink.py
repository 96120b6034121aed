"""Implementation of `chefbot prove --shrink`: a failing run made small while it still fails."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.config_text import plain_sections, yaml_text
from chefbot.errors import UserError
from chefbot.kernels.precompile import compile_kernels
from chefbot.plural import number_of
from chefbot.proving.record import RunRecord
from chefbot.proving.reductions import REDUCERS, Reduction
from chefbot.proving.run_spec import run_specs, with_absolute_paths, with_relative_paths
from chefbot.proving.scenario import Scenario, load_scenario
from chefbot.proving.worker import make_run_in_process
from chefbot.storage.atomic_files import write_into_folder

MAX_RUNS = 19
"""Maximum number of runs, with the first."""
console = Console(highlight=False, soft_wrap=True)


def run_shrink(run: str, out: Path) -> int:
    """Make the run SCENARIO:SEED small and write it as a scenario file into the folder `out`; return 0.

    Raises UserError if it does not fail.
    """
    name, _, text = run.rpartition(":")
    if not name or not text.isdecimal():
        raise UserError(f"--shrink {run}: name a scenario and a seed, as in crowd:7")
    seed, base = int(text), Path(name).resolve().parent if Path(name).suffix else Path()
    compile_kernels(console)
    original = with_absolute_paths(load_scenario(name), base)
    first = _made(original, seed)
    if first.success:
        raise UserError(f"{name} with seed {seed} succeeds; only a run that fails can be made smaller")
    console.print(f"{original.name}, seed {seed}: {first.failure}", markup=False)
    small, record, runs = shrink(original, first, lambda scenario: _made(scenario, seed), _report)
    path = out / f"{original.name}_{seed}.yaml"
    write_into_folder(path, regression_text(with_relative_paths(small, out), record, seed).encode())
    console.print(f"{number_of(runs, 'run')}; {path} still fails: {record.failure}", markup=False)
    return 0


def shrink(
    scenario: Scenario,
    record: RunRecord,
    make: Callable[[Scenario], RunRecord],
    report: Callable[[Reduction, bool], None],
) -> tuple[Scenario, RunRecord, int]:
    """Return the smallest scenario found that fails like `record`, its record, and the number of runs with the first.

    make: makes a run of a scenario. report: is called with each reduction and whether it still fails. Of each
    kind of reduction the first that still fails is kept (a greedy form of Zeller & Hildebrandt 2002, "Simplifying and
    isolating failure-inducing input").
    """
    kind, runs = failure_kind(record), 1
    for reducer in REDUCERS:
        for reduction in reducer(scenario, record):
            if runs == MAX_RUNS:
                return scenario, record, runs
            smaller, runs = make(reduction.scenario), runs + 1
            still_fails = not smaller.success and bool(failure_kind(smaller) & kind)
            report(reduction, still_fails)
            if still_fails:
                scenario, record = reduction.scenario, smaller
                break
    return scenario, record, runs


def failure_kind(record: RunRecord) -> set[str]:
    """Return what failed, without numbers and names: equal for runs that fail alike."""
    parts = re.split(r"; ", record.failure.strip().splitlines()[-1] if record.failure else "")
    return {re.sub(r"\S*[\d_]\S*", "", part.partition(",")[0].partition(":")[0]).strip() for part in parts}


def regression_text(scenario: Scenario, record: RunRecord, seed: int) -> str:
    """Return the scenario file of a failure."""
    kept = msgspec.structs.replace(
        scenario,
        name=f"{scenario.name}_{seed}"[:60],
        seeds=str(seed),
        claim=0.0,
        known_failure=record.failure[:300],
    )
    return yaml_text(
        plain_sections(kept), "Made by `chefbot prove --shrink`; empty known_failure once it is fixed."
    )


def _made(scenario: Scenario, seed: int) -> RunRecord:
    spec = run_specs(scenario, Path(), [seed])[0]
    return msgspec.json.decode(make_run_in_process(msgspec.msgpack.encode(spec)).record, type=RunRecord)


def _report(reduction: Reduction, fails: bool) -> None:
    console.print(f"  {reduction.what}: {'still fails' if fails else 'no longer fails this way'}")
