"""The command `chefbot why`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def why(
    log: Annotated[
        Path | None, typer.Option(help="folder of a run, or its log; default: the newest log in runs/")
    ] = None,
    last: Annotated[int, typer.Option(min=1, help="number of causes to print, the newest ones")] = 20,
    everything: Annotated[bool, typer.Option("--all", help="print all causes of the run")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print the chains as JSON, one per line")] = False,
    picture: Annotated[
        Path | None, typer.Option(help="PNG file in which to draw the causes on the map", show_default=False)
    ] = None,
    history: Annotated[
        bool, typer.Option(help="print the causes of all runs, as the web UI recorded them")
    ] = False,
    robot: Annotated[
        str,
        typer.Option(
            help="name of the robot whose history to print; not needed if it is the only one",
            show_default=False,
        ),
    ] = "",
) -> None:
    """Show why a robot slowed down, stopped or failed.

    Each line names the check, the obstacle with its place, the sensor that marked it, and when.
    """
    from chefbot.cli.why.reasons import print_reasons
    from chefbot.cli.why.recorded import print_recorded

    if history:
        print_recorded(robot, None if everything else last)
        return
    print_reasons(log, None if everything else last, as_json, picture)
