"""`chefbot launch`: nodes from a launch file, until stopped."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from chefbot.commands.session import session, start, stop_on_signals
from chefbot.commands.warm import warm_kernels
from chefbot.errors import UserError
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import Launch, built_in_launches, load_launch
from chefbot.runtime.system import System

console = Console(highlight=False)


def list_launches() -> None:
    """Name and purpose of each."""
    table = Table("launch", "what it does", "arguments", box=None)
    for name in built_in_launches():
        one = load_launch(name)
        if one.about:
            own = [f"{key}:={value}" for key, value in one.args.items()]
            table.add_row(name, one.about, " ".join(own))
    console.print(table)


def parse_arguments(texts: Sequence[str]) -> dict[str, str]:
    """`key:=value` texts. UserError for anything else."""
    given: dict[str, str] = {}
    for text in texts:
        key, separator, value = text.partition(":=")
        if not separator or not key:
            raise UserError(f"{text!r} is not an argument of a launch; write key:=value")
        given[key] = value
    return given


def run_launch(name: str, texts: Sequence[str]) -> None:
    """Until Ctrl-C, or for `duration:=` seconds of its clock."""
    launch = load_launch(name, parse_arguments(texts))
    robot = load_robot(str(launch.args["robot"]))
    record = Path(str(launch.args["record"])) if launch.args["record"] else None
    warm_kernels(console)
    seed, speed = int(launch.args["seed"]), float(launch.args["speed"])
    with session(robot, seed, launch.clock, speed, record) as system:
        start(system, launch)
        _announce(system, launch)
        _run(system, float(launch.args["duration"]))
    if record:
        console.print(f"recorded {record}")


def _announce(system: System, launch: Launch) -> None:
    console.print(f"[bold]{launch.name}[/]: {launch.about}")
    for node in system.nodes.values():
        sentence = getattr(node, "announcement", "")
        if sentence:
            console.print(f"  {sentence}")


def _run(system: System, duration: float) -> None:
    loop = system.loop
    until = loop.now_ns + round(duration * 1e9) if duration > 0 else None
    with stop_on_signals(loop.stop):
        loop.run(until_ns=until)
