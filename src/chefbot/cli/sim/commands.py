"""The commands of `chefbot sim`."""

from __future__ import annotations

from typing import Annotated

import typer

from chefbot.cli import completion
from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import ROBOT_OPTION, WORLDS

sim_app = new_group("Simulator: run a robot in a world.")


@sim_app.command("run")
def run(
    world: Annotated[str, typer.Argument(help=WORLDS, autocompletion=completion.worlds)] = "empty",
    arguments: Annotated[
        list[str] | None, typer.Argument(help="key:=value ..., such as people:=3 or headless:=true")
    ] = None,
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
) -> None:
    """Run a simulated robot in a world, to be driven manually; without a map and navigation."""
    from chefbot.launcher.launch import run_launch

    given = [f"world:={world}", f"robot:={robot}", *(arguments or [])]
    raise typer.Exit(run_launch("chefbot_empty_world", given))
