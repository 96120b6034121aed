"""`chefbot launch`: nodes from a launch file, until stopped."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from rich.console import Console
from rich.table import Table

from chefbot.commands.session import announce, session, start, stop_on_signals
from chefbot.commands.warm import warm_kernels
from chefbot.errors import UserError
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import (
    STANDARD_ARGS,
    ArgValue,
    Launch,
    built_in_launches,
    find_launch,
    load_launch,
    split,
)
from chefbot.runtime.loop import Publication
from chefbot.runtime.system import System
from chefbot.wire.attach import attached, in_fleet, others
from chefbot.wire.gate import Doors, endpoint

MAX_SPEED = 1000.0
console = Console(highlight=False)


def list_launches() -> None:
    """Name, purpose and arguments of each."""
    table = Table("launch", "what it does", "its arguments", box=None)
    for name in built_in_launches():
        one = load_launch(name)
        if one.about:
            own = {key: value for key, value in one.args.items() if key not in STANDARD_ARGS}
            table.add_row(name, one.about, _written(own))
    console.print(table)
    console.print(f"\nAll understand {_written(STANDARD_ARGS)}")


def _written(arguments: Mapping[str, ArgValue]) -> str:
    """As a person writes them on the command line."""
    texts = {
        key: str(value).lower() if isinstance(value, bool) else value for key, value in arguments.items()
    }
    return " ".join(f"{key}:={value}" for key, value in texts.items())


def parse_arguments(texts: Sequence[str]) -> dict[str, str]:
    """`key:=value` texts. UserError for anything else."""
    given: dict[str, str] = {}
    for text in texts:
        key, separator, value = text.partition(":=")
        if not separator or not key:
            raise UserError(f"{text!r} is not an argument of a launch; write key:=value")
        given[key] = value
    return given


def run_launch(name: str, texts: Sequence[str], join: Sequence[str] = (), listen: Sequence[str] = ()) -> None:
    """Until Ctrl-C, or for `duration:=` seconds of its clock. `join`, `listen`: ways to other machines."""
    doors = Doors(tuple(map(endpoint, join)), tuple(map(endpoint, listen)) or None)
    launch = in_fleet(load_launch(name, parse_arguments(texts)))
    _check(launch)
    sys.path.append(str(find_launch(name).parent.resolve()))  # an owner's classes lie beside the launch file
    robot = load_robot(str(launch.args["robot"]))
    record = Path(str(launch.args["record"])) if launch.args["record"] else None
    warm_kernels(console)
    seed, speed = int(launch.args["seed"]), float(launch.args["speed"])
    with (
        session(robot, seed, launch.clock, speed, record) as system,
        attached(system, launch, doors, console.print) as bridge,
        ExitStack() as processes,
    ):
        system.loop.tap(show_remarks)
        own = launch if bridge is None else split(launch)[0]
        if bridge is None and any(entry.process for entry in launch.nodes.values()):
            console.print("All nodes run in this one process: `process:` needs the wire.")
        start(system, own)
        if bridge is not None:
            processes.enter_context(others(bridge, system, launch, find_launch(name).parent))
        _announce(system, launch)
        _run(system, float(launch.args["duration"]))
    if record:
        console.print(f"recorded {record}")


def _check(launch: Launch) -> None:
    """The bounds of what every launch understands."""
    seed, speed, duration = (launch.args[key] for key in ("seed", "speed", "duration"))
    if int(seed) < 0:
        raise UserError(f"launch {launch.name}: seed:={seed} must not be below 0")
    if not 0.0 <= float(speed) <= MAX_SPEED:
        raise UserError(
            f"launch {launch.name}: speed:={speed} must lie between 0 (as fast as may be) and {MAX_SPEED:.0f}"
        )
    if not 0.0 <= float(duration) < math.inf:
        raise UserError(f"launch {launch.name}: duration:={duration} must be seconds, or 0 for no end")


def _announce(system: System, launch: Launch) -> None:
    console.print(f"[bold]{launch.name}[/]: {launch.about}")
    announce(console, system.nodes.values())


def show_remarks(publication: Publication) -> None:
    """What devices have to say to the person who started them."""
    if publication.topic.endswith("/remark") and isinstance(publication.message, String):
        console.print(f"  {publication.message.data}", markup=False)


def _run(system: System, duration: float) -> None:
    loop = system.loop
    until = loop.now_ns + round(duration * 1e9) if duration > 0 else None
    with stop_on_signals(loop.stop):
        loop.run(until_ns=until)
