"""Implementation of `chefbot launch`: run the nodes of a launch file until stopped."""

from __future__ import annotations

import math
import socket
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import get_args

from rich.console import Console
from rich.table import Table

from chefbot.bridge.attach import (
    identity,
    open_bridge,
    open_wire,
    run_workers,
    wire_requested,
    with_namespace,
)
from chefbot.bridge.robot_time import RobotTime
from chefbot.devices.maps.map_file import MAP_FILE_KIND, SAVED_MAP_KIND, given_map
from chefbot.errors import UserError
from chefbot.fleet.secure_router import ExternalEndpoints, endpoint
from chefbot.kernels.precompile import compile_kernels, compile_kernels_of
from chefbot.launcher.design_errors import print_design_errors
from chefbot.launcher.join import join_robot, joining_node_name, watch_robot
from chefbot.launcher.lan_access import ALL_ADDRESSES, HOST_ARGUMENT, with_ui_address
from chefbot.launcher.session import announce, keep_loop_alive, print_notices, session, start
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.hosts import check_host, hosts_of, part_for_machine
from chefbot.runtime.launch import (
    STANDARD_ARGS,
    ArgValue,
    Launch,
    built_in_launches,
    checked_node,
    find_launch,
    load_launch,
    split_by_process,
)
from chefbot.runtime.node_container import NodeContainer
from chefbot.signals import stop_on_signals
from chefbot.storage.atomic_files import rename_existing
from chefbot.storage.map_files import load_map
from chefbot.storage.mapped_drives import load_drives
from chefbot.supervision.service_manager import reports_to_service_manager
from chefbot.ui.access.visitors import share_secret

MAX_SPEED = 1000.0
console = Console(highlight=False)


def list_launches() -> None:
    """Print the name, purpose and arguments of each built-in launch."""
    table = Table("launch", "what it does", "its arguments", box=None)
    for name in built_in_launches():
        launch = load_launch(name)
        if launch.description:
            own_args = {key: value for key, value in launch.args.items() if key not in STANDARD_ARGS}
            table.add_row(name, launch.description, _as_command_line(own_args))
    console.print(table)
    console.print(f"\nArguments of all launches: {_as_command_line(STANDARD_ARGS)}")


def _as_command_line(arguments: Mapping[str, ArgValue]) -> str:
    """Return the arguments as written on the command line."""
    texts = {
        key: str(value).lower() if isinstance(value, bool) else value for key, value in arguments.items()
    }
    return " ".join(f"{key}:={value}" for key, value in texts.items())


def parse_arguments(texts: Sequence[str]) -> dict[str, str]:
    """Parse texts of the form `key:=value`. Raises UserError for anything else."""
    arguments: dict[str, str] = {}
    for text in texts:
        key, separator, value = text.partition(":=")
        if not separator or not key:
            raise UserError(f"{text!r} is not an argument of a launch; write key:=value")
        arguments[key] = value
    return arguments


def run_launch(
    name: str,
    texts: Sequence[str],
    join: Sequence[str] = (),
    listen: Sequence[str] = (),
    host: str = "",
    lan: bool = False,
) -> int:
    """Run a launch until Ctrl-C, or for `duration:=` seconds of its clock.

    Returns the exit code: 1 if a node raised an unexpected exception, 0 if Ctrl-C ended the launch at any time.

    `join`, `listen`: endpoints to other machines. `host`: which machine this is, for launch files with parts
    for several. `lan`: serve the web UI to the network.
    """
    endpoints = ExternalEndpoints(tuple(map(endpoint, join)), tuple(map(endpoint, listen)) or None)
    arguments = parse_arguments(texts)
    address = arguments.pop(HOST_ARGUMENT, ALL_ADDRESSES if lan else "")
    launch = load_launch(name, arguments)
    if address:
        launch = with_ui_address(launch, address)
    launch = with_namespace(_part(launch, host))
    _check(launch)
    folder = find_launch(name).parent.resolve()
    sys.path.append(str(folder))  # user node classes are beside the launch file
    robot = load_robot(str(launch.args["robot"]))
    print_design_errors(console, str(launch.args["robot"]), robot)
    # Before minutes are spent on kernels:
    if launch.clock == "simulation":
        _check_world(launch, robot)
    _check_nodes(launch)
    _check_map(launch)
    try:
        kinds = {entry.kind for entry in launch.nodes.values()}
        if launch.clock == "robot":  # it joins a robot, and hardly has algorithms of its own
            compile_kernels_of(console, kinds)
        else:
            compile_kernels(console, kinds=kinds)
        return min(_run_on_wire(launch, robot, endpoints, folder), 1)
    except KeyboardInterrupt:
        console.print("\nThe launch was ended.")
        return 0


def _run_on_wire(launch: Launch, robot: Robot, endpoints: ExternalEndpoints, folder: Path) -> int:
    """Open the wire if the launch has one, and run the launch; return the number of node faults."""
    with open_wire(launch, endpoints, console.print) as wire:
        if launch.clock != "robot":
            return _run_robot(launch, robot, wire, folder)
        return _run_joined(launch, robot, wire, folder) if wire is not None else 0


def _part(launch: Launch, host: str) -> Launch:
    """Return this machine's part of the launch, or all of it without a wire; UserError for a wrong host."""
    own_identity = identity()
    machine = host or (own_identity.name if own_identity else socket.gethostname())
    check_host(launch, host, machine, may_be_robot=own_identity is None or own_identity.role == "robot")
    if not host and not wire_requested(launch):
        return launch
    part = part_for_machine(launch, machine)
    for other, nodes in hosts_of(launch).items():
        if other != machine:
            console.print(f"On host {other}: {', '.join(nodes)}.")
    return part


def _run_robot(launch: Launch, robot: Robot, wire: RmwContext | None, folder: Path) -> int:
    """Run a launch that joins no robot; return the number of node faults."""
    if wire is None and any(entry.process or entry.host for entry in launch.nodes.values()):
        console.print(
            "All nodes run in this one process: there is no wire to others (off at speed:=0 unless wire:=on)."
        )
    with _session(launch, robot) as system:
        _run_nodes(system, launch, wire, folder)
    return _faults_of(system)


def _faults_of(system: NodeContainer) -> int:
    return system.faults.bug_count if system.faults else 0


def _run_joined(launch: Launch, robot: Robot, wire: RmwContext, folder: Path) -> int:
    """Run a launch that joins a robot, again after its restarts; return the number of node faults."""
    name, faults = joining_node_name(launch), 0
    while (meeting := join_robot(wire, launch, robot, console.print)) is not None:
        namespace = str(meeting.launch.args["namespace"]) or "/"
        with RmwNode(wire, f"_{name}_clock", namespace) as node:
            time = RobotTime(node) if meeting.launch.clock == "simulation" else None
            with (
                _session(meeting.launch, robot, time) as system,
                watch_robot(wire, meeting, system.loop.stop) as restarted,
            ):
                _run_nodes(system, meeting.launch, wire, folder, name)
        faults += _faults_of(system)
        if not restarted.is_set():
            break
        console.print("The robot was restarted, and so are the nodes here.")
    return faults


@contextmanager
def _session(launch: Launch, robot: Robot, time: RobotTime | None = None) -> Iterator[NodeContainer]:
    seed, speed = int(launch.args["seed"]), float(launch.args["speed"])
    record = Path(str(launch.args["record"])) if launch.args["record"] else None
    if record and (kept := rename_existing(record)):
        console.print(f"{record} exists; it is kept as {kept}")
    clock, start_ns = (time.clock, time.start_ns) if time else (None, None)
    with session(robot, seed, launch.clock, speed, record, clock, start_ns) as system:
        if time is not None:
            time.attach(system.loop)
        yield system
    if record:
        console.print(f"recorded {record}")


def _run_nodes(
    system: NodeContainer, launch: Launch, wire: RmwContext | None, folder: Path, joined_name: str = ""
) -> None:
    """Run nodes and worker processes, on the wire if there is one; `joined_name` is as for `bridged`."""
    with ExitStack() as stack:
        system.loop.add_observer(print_notices)
        if wire is None:
            start(system, launch)
        else:
            share_secret()
            bridge = stack.enter_context(open_bridge(system, launch, wire, joined_name))
            start(system, split_by_process(launch)[0])
            stack.enter_context(run_workers(bridge, system, launch, folder))
            keep_loop_alive(system.loop)
        _announce(system, launch)
        _run(system, float(launch.args["duration"]))


def _check(launch: Launch) -> None:
    """Check the bounds of the standard arguments."""
    seed, speed, duration = (launch.args[key] for key in ("seed", "speed", "duration"))
    if int(seed) < 0:
        raise UserError(f"launch {launch.name}: seed:={seed} must not be below 0")
    if not 0.0 <= float(speed) <= MAX_SPEED:
        raise UserError(
            f"launch {launch.name}: speed:={speed} must lie between 0 (as fast as possible) and {MAX_SPEED:.0f}"
        )
    if not 0.0 <= float(duration) < math.inf:
        raise UserError(f"launch {launch.name}: duration:={duration} must be seconds, or 0 for no end")


def _check_nodes(launch: Launch) -> None:
    """Raise UserError for a wrong kind or parameter of a node of this process; others are not imported here."""
    for name, entry in launch.nodes.items():
        if not entry.process:
            checked_node(launch.name, name, entry)


def _check_world(launch: Launch, robot: Robot) -> None:
    """Raise UserError for a world that the simulator cannot load."""
    # imported here: the processes of a built robot have no simulator
    from chefbot.sim.faults.node_faults import SIMULATOR_KIND
    from chefbot.sim.world.load import load_any_world
    from chefbot.sim.world.map_world import UnknownCells

    for entry in launch.nodes.values():
        params = {"start": "", "unknown": "auto"} | entry.params
        if entry.kind == SIMULATOR_KIND and "world" in params and params["unknown"] in get_args(UnknownCells):
            load_any_world(str(params["world"]), robot, str(params["start"]), params["unknown"])


def _check_map(launch: Launch) -> None:
    """Raise UserError for a map that a node here cannot load, or where there is none to localize on."""
    for entry in launch.nodes.values():
        if entry.kind == MAP_FILE_KIND:
            given_map(str(entry.params["map"]))
        if entry.kind == SAVED_MAP_KIND:
            from chefbot.sim.world.load import map_to_localize_on

            map_to_localize_on(str(entry.params["world"]), str(entry.params["map"]))
    if earlier := str(launch.args.get("continue_map", "")):
        load_drives(Path(earlier))
    map_file = str(launch.args.get("map_file", ""))
    if map_file and any(entry.params.get("map") == map_file for entry in launch.nodes.values()):
        load_map(Path(map_file))


def _announce(system: NodeContainer, launch: Launch) -> None:
    console.print(f"[bold]{launch.name}[/]: {launch.description}")
    announce(console, system.nodes.values())


def _run(system: NodeContainer, duration: float) -> None:
    loop = system.loop
    until = loop.now_ns + round(duration * 1e9) if duration > 0 else None
    with stop_on_signals(loop.stop, last=True, notice="Ending the launch."), reports_to_service_manager(loop):
        loop.run(until_ns=until)
