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
from chefbot.errors import ChefbotError, UserError
from chefbot.fleet.secure_router import ExternalEndpoints, endpoint
from chefbot.kernels.precompile import compile_kernels, compile_kernels_of
from chefbot.launcher.design_errors import print_design_errors
from chefbot.launcher.join import join_robot, joining_node_name, watch_robot
from chefbot.launcher.lan_access import ALL_ADDRESSES, HOST_ARGUMENT, with_ui_address
from chefbot.launcher.launch_changer import (
    accepted_arguments,
    changed_arguments,
    parse_arguments,
    requested_launch,
    with_changer,
    withdraw_request,
)
from chefbot.launcher.session import announce, keep_loop_alive, print_notices, session, start
from chefbot.msgs.chefbot_msgs import LaunchRequest
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
from chefbot.supervision.service_manager import ServiceReports, reports_to_service_manager
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


def run_launch(
    name: str,
    texts: Sequence[str],
    join: Sequence[str] = (),
    listen: Sequence[str] = (),
    host: str = "",
    lan: bool = False,
) -> int:
    """Run a launch until Ctrl-C, or for `duration:=` seconds of its clock, and then what is requested in its place.

    Returns the exit code: 1 if a node raised an unexpected exception, 0 if Ctrl-C ended the launch at any time.

    `join`, `listen`: endpoints to other machines. `host`: which machine this is, for launch files with parts
    for several. `lan`: serve the web UI to the network.
    """
    endpoints = ExternalEndpoints(tuple(map(endpoint, join)), tuple(map(endpoint, listen)) or None)
    arguments = parse_arguments(texts)
    address = arguments.pop(HOST_ARGUMENT, ALL_ADDRESSES if lan else "")
    try:
        with reports_to_service_manager() as reports:
            runner = LaunchRunner(endpoints, host, address, reports)
            request = runner.run(name, arguments)
            while request is not None:
                name, arguments, request = _run_requested(runner, name, arguments, request)
            return min(runner.faults, 1)
    except KeyboardInterrupt:
        console.print("\nThe launch was ended.")
        return 0


def _run_requested(
    runner: LaunchRunner, name: str, arguments: dict[str, str], request: LaunchRequest
) -> tuple[str, dict[str, str], LaunchRequest | None]:
    """Run the requested launch, or the one before if that cannot run.

    Returns the launch that has run, its arguments, and the request for which it has ended.
    """
    changed = changed_arguments(arguments, request)
    console.print(f"{request.launch} runs in place of {name}.")
    try:
        accepted = accepted_arguments(request.launch, changed)
        return request.launch, changed, runner.run(request.launch, accepted)
    except ChefbotError as error:
        notice = f"Warning: {request.launch} cannot run, so {name} runs again: {error}"
        console.print(notice)
        return name, arguments, runner.run(name, accepted_arguments(name, arguments), notice)


class LaunchRunner:
    """Runs launches on one robot, one after the other, with the same endpoints and address of the web UI."""

    def __init__(
        self, endpoints: ExternalEndpoints, host: str, address: str, reports: ServiceReports
    ) -> None:
        self._endpoints, self._host, self._address, self._reports = endpoints, host, address, reports
        self.faults = 0
        """Number of unexpected exceptions of nodes, of all launches."""

    def run(self, name: str, arguments: dict[str, str], notice: str = "") -> LaunchRequest | None:
        """Run a launch to its end, and return what is requested in its place, if that is why it has ended.

        notice: why it runs, for the operator. Raises ChefbotError if it cannot run.
        """
        launch = load_launch(name, arguments)
        if self._address:
            launch = with_ui_address(launch, self._address)
        launch = with_changer(with_namespace(_part(launch, self._host)), notice)
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
        kinds = {entry.kind for entry in launch.nodes.values()}
        if launch.clock == "robot":  # it joins a robot, and hardly has algorithms of its own
            compile_kernels_of(console, kinds)
        else:
            compile_kernels(console, kinds=kinds)
        return self._run_on_wire(launch, robot, folder)

    def _run_on_wire(self, launch: Launch, robot: Robot, folder: Path) -> LaunchRequest | None:
        """Open the wire if the launch has one, and run the launch."""
        with open_wire(launch, self._endpoints, console.print) as wire:
            if launch.clock != "robot":
                return self._run_robot(launch, robot, wire, folder)
            if wire is not None:
                self._run_joined(launch, robot, wire, folder)
            return None

    def _run_robot(
        self, launch: Launch, robot: Robot, wire: RmwContext | None, folder: Path
    ) -> LaunchRequest | None:
        """Run a launch that joins no robot."""
        if wire is None and any(entry.process or entry.host for entry in launch.nodes.values()):
            console.print(
                "All nodes run in this one process: there is no wire to others (off at speed:=0 unless wire:=on)."
            )
        with _session(launch, robot) as system:
            self._run_nodes(system, launch, wire, folder)
            request = requested_launch(system)
        self.faults += _faults_of(system)
        return request

    def _run_joined(self, launch: Launch, robot: Robot, wire: RmwContext, folder: Path) -> None:
        """Run a launch that joins a robot, again after its restarts."""
        name = joining_node_name(launch)
        while (meeting := join_robot(wire, launch, robot, console.print)) is not None:
            namespace = str(meeting.launch.args["namespace"]) or "/"
            with RmwNode(wire, f"_{name}_clock", namespace) as node:
                time = RobotTime(node) if meeting.launch.clock == "simulation" else None
                with (
                    _session(meeting.launch, robot, time) as system,
                    watch_robot(wire, meeting, system.loop.stop) as restarted,
                ):
                    self._run_nodes(system, meeting.launch, wire, folder, name)
            self.faults += _faults_of(system)
            if not restarted.is_set():
                break
            console.print("The robot was restarted, and so are the nodes here.")

    def _run_nodes(
        self,
        system: NodeContainer,
        launch: Launch,
        wire: RmwContext | None,
        folder: Path,
        joined_name: str = "",
    ) -> None:
        """Run nodes and worker processes, on the wire if there is one; `joined_name` is as for `open_bridge`."""
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
            self._run_loop(system, float(launch.args["duration"]))

    def _run_loop(self, system: NodeContainer, duration: float) -> None:
        loop = system.loop
        until = loop.now_ns + round(duration * 1e9) if duration > 0 else None
        with (
            stop_on_signals(loop.stop, last=True, notice="Ending the launch.") as signalled,
            self._reports.watching(loop),
        ):
            loop.run(until_ns=until)
        if signalled.is_set():
            withdraw_request(system)


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


def _faults_of(system: NodeContainer) -> int:
    return system.faults.bug_count if system.faults else 0


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
