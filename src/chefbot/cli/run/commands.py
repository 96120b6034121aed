"""The commands `chefbot demo`, `chefbot launch`, `chefbot replay` and `chefbot sim`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chefbot.cli import completion
from chefbot.cli.parameters import JOIN, KEY_VALUES, LAN, ROBOT_OPTION, START, UNKNOWN, WORLDS


def demo(
    world: Annotated[str, typer.Option(help=WORLDS, autocompletion=completion.worlds)] = "hotel",
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    seed: Annotated[int, typer.Option(min=0, help="random seed; same seed, same run")] = 1,
    headless: Annotated[bool, typer.Option("--headless", help="run without the web UI")] = False,
    speed: Annotated[str, typer.Option(help="real-time factor, or max")] = "max",
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("runs/demo"),
    profile: Annotated[
        str, typer.Option(help="realism of the simulation: real, perfect or assembled")
    ] = "real",
    people: Annotated[int, typer.Option(min=0, max=50, help="number of simulated people")] = 0,
    port: Annotated[int, typer.Option(min=1, max=65535, help="port of the web UI")] = 8080,
    processes: Annotated[
        bool, typer.Option("--processes", help="run as four processes, at a real-time factor of 4 at most")
    ] = False,
    lan: Annotated[bool, LAN] = False,
    start: Annotated[str, START] = "",
    unknown: Annotated[str, UNKNOWN] = "auto",
    bytes_: Annotated[
        bool, typer.Option("--bytes", help="decode the bytes of an emulated lidar by the robot's driver")
    ] = False,
) -> None:
    """See a robot map a hotel, localize on the map and deliver food.

    It explores a simulated world alone, saves the map, restarts, localizes, serves the tables, returns home and
    writes a report.
    """
    from chefbot.cli.launch_arguments import hints_at_options
    from chefbot.demo.demo import DemoOptions
    from chefbot.demo.run import driver_of, run_demo
    from chefbot.sim.world.load import unknown_cells

    options = DemoOptions(
        world,
        robot,
        seed,
        headless,
        speed,
        out,
        profile,
        people,
        port,
        processes,
        lan,
        start,
        unknown_cells(unknown),
        driver_of(robot) if bytes_ else "",
    )
    with hints_at_options():
        code = run_demo(options)
    raise typer.Exit(code)


def launch(
    name: Annotated[
        str,
        typer.Argument(
            help="a launch, such as gmapping_demo, or a launch file", autocompletion=completion.launches
        ),
    ] = "",
    arguments: Annotated[list[str] | None, KEY_VALUES] = None,
    join: Annotated[list[str] | None, JOIN] = None,
    listen: Annotated[
        list[str] | None,
        typer.Option(
            help="address at which to accept connections without keys or encryption, tcp/ADDRESS; repeatable"
        ),
    ] = None,
    host: Annotated[
        str,
        typer.Option(help="machine whose nodes to run, a `host:` of the launch file; default: this machine"),
    ] = "",
    lan: Annotated[bool, LAN] = False,
    supervised: Annotated[
        bool,
        typer.Option("--supervised", help="restart the launch when it crashes or hangs; see `robot service`"),
    ] = False,
) -> None:
    """Run a launch file: NAME key:=value ...; without NAME, list all."""
    from chefbot.launcher.launch import list_launches, run_launch

    if not name:
        list_launches()
        return
    if supervised:
        from chefbot.cli.run.supervised import run_again_after_crashes

        raise typer.Exit(run_again_after_crashes())
    raise typer.Exit(run_launch(name, arguments or [], join or [], listen or [], host, lan))


def replay(
    log: Annotated[Path, typer.Argument(help="log of a run, run.mcap")],
    check: Annotated[
        bool, typer.Option("--check", help="exit with code 1 unless every output is bit-identical")
    ] = False,
    show: Annotated[
        bool, typer.Option("--show", help="show the log in the web UI instead; an incident is always shown")
    ] = False,
    port: Annotated[int, typer.Option(min=1, max=65535, help="port of the web UI")] = 8080,
) -> None:
    """Run the nodes again on a recorded log, or show it in the web UI."""
    from chefbot.cli.run.replay import run_replay

    raise typer.Exit(run_replay(log, check=check, show=show, port=port))


def sim(
    world: Annotated[str, typer.Argument(help=WORLDS, autocompletion=completion.worlds)] = "empty",
    arguments: Annotated[
        list[str] | None,
        typer.Argument(help="arguments of the launch, key:=value ..., such as people:=3 or headless:=true"),
    ] = None,
    robot: Annotated[str, ROBOT_OPTION] = "chefbot",
    start: Annotated[str, START] = "",
    unknown: Annotated[str, UNKNOWN] = "auto",
) -> None:
    """Run a simulated robot in a world and drive it manually.

    Without a map and navigation.
    """
    from chefbot.cli.launch_arguments import hints_at_options
    from chefbot.launcher.launch import run_launch

    given = [
        f"world:={world}",
        f"robot:={robot}",
        f"start:={start}",
        f"unknown:={unknown}",
        *(arguments or []),
    ]
    with hints_at_options():
        code = run_launch("chefbot_empty_world", given)
    raise typer.Exit(code)
