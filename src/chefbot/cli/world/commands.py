"""The commands of `chefbot world`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli import completion
from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import ROBOT_OPTION, START, UNKNOWN, WORLDS

world_app = new_group("Worlds of the simulator: list, generate by seed, draw.")


@world_app.command("list")
def list_() -> None:
    """List the built-in worlds with size, named places, doors and people."""
    from chefbot.cli.world.built_in import list_worlds

    list_worlds()


@world_app.command("kinds")
def kinds(
    kind: Annotated[
        str,
        typer.Argument(
            help="kind of building to list; default: all", autocompletion=completion.building_kinds
        ),
    ] = "",
) -> None:
    """List the kinds of buildings, and the ranges that their numbers are drawn from."""
    from chefbot.cli.world.kinds import list_kinds

    list_kinds(kind)


@world_app.command("generate")
def generate(
    kind: Annotated[
        str, typer.Argument(help="kind of building, see `kinds`", autocompletion=completion.building_kinds)
    ],
    seed: Annotated[int, typer.Option(min=0, help="random seed; same seed, same building")] = 1,
    size: Annotated[str, typer.Option(help="extent along x and y in metres, as 30x20")] = "",
    numbers: Annotated[
        list[str] | None,
        typer.Option("--set", help="a number to set instead of drawing it, NAME=VALUE; repeatable"),
    ] = None,
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    out: Annotated[Path, typer.Option(help="world file to write; its map is written beside it")] = Path(
        "world.yaml"
    ),
) -> None:
    """Generate a building whose places the robot can reach: a world file, and the true map of it."""
    from chefbot.cli.world.generate import generate_world

    generate_world(kind, seed, size, numbers or [], robot, out)


@world_app.command("draw")
def draw(
    world: Annotated[str, typer.Argument(help=WORLDS, autocompletion=completion.worlds)],
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    out: Annotated[Path, typer.Option(help="picture to write, NAME.png")] = Path("world.png"),
    start: Annotated[str, START] = "",
    unknown: Annotated[str, UNKNOWN] = "auto",
    seed: Annotated[int | None, typer.Option(min=0, help="also draw the places that this seed gives")] = None,
) -> None:
    """Draw a world from above: walls, glass, furniture, holes, carpets, doors and named places."""
    from chefbot.cli.world.draw import draw_world

    draw_world(world, robot, out, start, unknown, seed)
