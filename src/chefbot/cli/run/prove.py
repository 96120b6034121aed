"""The command `chefbot prove`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli import completion
from chefbot.cli.parameters import ROBOT_OPTION
from chefbot.errors import UserError

SCENARIOS = typer.Argument(help="scenarios by name, or scenario files", autocompletion=completion.scenarios)
SEEDS = typer.Option(
    help="seeds, as 1..100, 7 or 1..9,15; odd ones are held out for evaluation, even ones are for tuning"
)
WORKERS = typer.Option(min=0, help="number of processes on this machine; 0: one per core")
SCHEDULER = typer.Option(help="Dask scheduler to run on, tcp://HOST:PORT")
OUT = typer.Option(help="folder for the results; runs done there are kept")
RESUME = typer.Option("--resume", help="run what is missing in --out")
RECORD = typer.Option("--record", help="keep the log of each run, for `replay`")
SHRINK = typer.Option(
    help="a failing run to minimize, SCENARIO:SEED; the smaller scenario is written into --out"
)
SCOREBOARD = typer.Option(help="run the built-in scenarios on odd seeds and write this page")
MINUTES = typer.Option(min=0, help="time after which no other run of the scoreboard begins, min")
AGAINST = typer.Option(help="folder with older results; exit code 1 if something got worse")


def prove(
    names: Annotated[list[str] | None, SCENARIOS] = None,
    seeds: Annotated[str | None, SEEDS] = None,
    robot: Annotated[str, ROBOT_OPTION] = "",
    workers: Annotated[int, WORKERS] = 0,
    scheduler: Annotated[str, SCHEDULER] = "",
    out: Annotated[Path, OUT] = Path("runs/prove"),
    resume: Annotated[bool, RESUME] = False,
    record: Annotated[bool, RECORD] = False,
    shrink: Annotated[str, SHRINK] = "",
    scoreboard: Annotated[Path | None, SCOREBOARD] = None,
    minutes: Annotated[float, MINUTES] = 30.0,
    against: Annotated[Path | None, AGAINST] = None,
) -> None:
    """Run scenarios with many seeds and judge them.

    Without a name, list the built-in ones.
    """
    from chefbot.proving.prove import ProveOptions, list_scenarios, run_prove
    from chefbot.proving.scoreboard import run_scoreboard
    from chefbot.proving.shrink import run_shrink

    if shrink:
        raise typer.Exit(run_shrink(shrink, out))
    if scoreboard is not None:
        raise typer.Exit(run_scoreboard(scoreboard, out, minutes, workers, scheduler))
    if not names and not resume:
        list_scenarios()
        return
    if resume and (names or seeds is not None or robot):
        raise UserError("--resume takes the scenarios, seeds and robot from --out; leave these out")
    options = ProveOptions(names or [], seeds, robot, workers, scheduler, out, resume, record, against)
    raise typer.Exit(run_prove(options))
