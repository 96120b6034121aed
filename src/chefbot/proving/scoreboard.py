"""Implementation of `chefbot prove --scoreboard`: all built-in scenarios on odd seeds, as a page in Markdown."""

from __future__ import annotations

import statistics
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from chefbot import __version__
from chefbot.plural import number_of
from chefbot.proving.prove import make_missing
from chefbot.proving.record import RunRecord
from chefbot.proving.results_folder import Request, ResultsFolder, write_tables
from chefbot.proving.run_spec import RunSpec, code_hash, run_specs
from chefbot.proving.scenario import Scenario, built_in_scenarios, load_scenario
from chefbot.proving.scenario_tasks import BuiltTask
from chefbot.proving.statistics import wilson
from chefbot.storage.atomic_files import write_into_folder

SEEDS = list(range(1, 40, 2))
"""Odd seeds: nothing was tuned on them."""
LONG_RUN_TIME = 3600.0
"""Limit of the simulated time from which the runs of a scenario are long, s."""
console = Console(highlight=False, soft_wrap=True)


def run_scoreboard(page: Path, out: Path, minutes: float, workers: int, scheduler: str) -> int:
    """Make as many runs as the time allows, all scenarios with the first seed first; write the page, return 0.

    Long runs are made after the others, and last those in real time: one takes as long as all others of a seed.
    """
    scenarios = [load_scenario(name) for name in built_in_scenarios()]
    results = ResultsFolder(out)
    results.create(
        Request(scenarios=scenarios, folders=["."] * len(scenarios), seeds=[SEEDS] * len(scenarios))
    )
    specs = _specs(scenarios)
    done = {spec.key: record for spec in specs if (record := results.find(spec.key)) is not None}
    missing = [spec for spec in specs if spec.key not in done]
    make_missing(results, missing, done, workers, scheduler, minutes)
    made = [done[spec.key] for spec in specs if spec.key in done]
    if made:
        write_tables(out, made)
    write_into_folder(page, scoreboard_text(scenarios, made).encode())
    console.print(f"{len(made)} of {number_of(len(specs), 'run')}; scoreboard in {page}")
    return 0


def _specs(scenarios: Sequence[Scenario]) -> list[RunSpec]:
    by_scenario = [run_specs(scenario, Path(), SEEDS) for scenario in scenarios]
    specs = [spec for same_seed in zip(*by_scenario, strict=True) for spec in same_seed]
    return sorted(specs, key=lambda spec: _duration_class(spec.scenario))


def _duration_class(scenario: Scenario) -> int:
    """Return 0 for a usual scenario, 1 for one with long runs, and 2 for one in real time."""
    if isinstance(scenario.task, BuiltTask):
        return 2
    return 1 if scenario.limits.time >= LONG_RUN_TIME else 0


def scoreboard_text(scenarios: Sequence[Scenario], records: Sequence[RunRecord]) -> str:
    """Return the page in Markdown: in order of success, the lowest first."""
    rows = sorted(
        (_row_of(scenario, [r for r in records if r.scenario == scenario.name]) for scenario in scenarios),
        key=lambda row: row[0],
    )
    made = datetime.now(UTC).strftime("%Y-%m-%d")
    hosts = sorted({f"{r.machine.get('processor', '?')}" for r in records})
    return (
        "# Scoreboard\n\n"
        "Every built-in scenario with odd seeds, on which nothing was tuned; in order of success, the lowest first.\n"
        f"Written by `make scoreboard` on {made}, chefbot {__version__}, commit {_commit()}, code {code_hash()},\n"
        f"processors {', '.join(hosts) or 'none'}. The interval of the share is Wilson's, 95 %.\n\n"
        "| scenario | robot | runs | success | interval | median time, s | collisions a run |"
        " usual failure |\n"
        "|---|---|---|---|---|---|---|---|\n" + "".join(line for _, line in rows) + "\n"
        "## What the scenarios show\n\n"
        + "".join(f"- `{one.name}`: {one.description}{_peer(one)}\n" for one in scenarios)
    )


def _row_of(scenario: Scenario, records: Sequence[RunRecord]) -> tuple[float, str]:
    """Return the share of successes, and the line of a scenario."""
    if not records:
        return 2.0, f"| `{scenario.name}` | {scenario.robot_name} | 0 | not run | | | | |\n"
    share = wilson(sum(record.success for record in records), len(records))
    median_time = statistics.median(record.sim_time for record in records)
    collisions = sum(record.figures.get("collisions", 0.0) for record in records) / len(records)
    return share.value, (
        f"| `{scenario.name}` | {scenario.robot_name} | {share.total} | {share.value:.0%} |"
        f" {share.low:.0%} to {share.high:.0%} | {median_time:.0f} | {collisions:.2f} |"
        f" {_usual_failure(records)} |\n"
    )


def _usual_failure(records: Sequence[RunRecord]) -> str:
    failures = [record.failure.strip().splitlines()[-1] for record in records if not record.success]
    if not failures:
        return ""
    kinds = [failure.partition(";")[0].partition(":")[0] for failure in failures]
    usual = max(sorted(set(kinds)), key=kinds.count)
    example = failures[kinds.index(usual)].replace("|", "/")
    return f"{kinds.count(usual)} x {example[:120]}"


def _peer(scenario: Scenario) -> str:
    return f" Published elsewhere: {scenario.peer}" if scenario.peer else ""


def _commit() -> str:
    """Return the commit of the checkout, or `unknown` outside of one."""
    try:
        run = subprocess.run(
            ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"],
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return run.stdout.strip()
