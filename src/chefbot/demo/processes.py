"""The demo as several processes over the wire: which node runs where, and the CPU time of each process."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.bridge.attach import open_bridge, open_wire, run_workers, with_namespace
from chefbot.bridge.sim_time_sync import subscribe_to_progress
from chefbot.errors import UserError
from chefbot.fleet.secure_router import ExternalEndpoints
from chefbot.launcher.session import print_notices, start
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.runtime.clock import LeaderClock, wall_ns
from chefbot.runtime.launch import Launch, NodeEntry, load_launch, split_by_process
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.supervision.supervisor import Supervisor
from chefbot.ui.access.visitors import share_secret

MAX_REAL_TIME_FACTOR = 4.0
"""Maximum real-time factor, so that the latency of the wire stays small beside the control period."""
PROCESSES = {
    "slam": ("gmapping", "amcl"),
    "navigation": (
        *("people_tracker", "planner", "controller", "navigator", "explorer", "global_localizer"),
        *("waypoint_follower", "pose_sequence", "following_server"),
    ),
    "service": ("places", "map_server", "delivery", "page"),
}
"""Nodes of each worker process; all others run with the simulator in the demo's own process: drivers,
odometry, the drive base."""
MAIN_PROCESS = "simulator and base"
"""Name of the demo's own process in the table."""
START_TIMEOUT = 60.0
"""Maximum wall time until all processes are on the wire, s."""
POLL_PERIOD_NS = 50_000_000
"""Period of the checks whether all processes are on the wire, ns."""


def split_into_processes(launch: Launch) -> Launch:
    """Return the launch with its nodes divided among PROCESSES, and the operator's node added."""
    process_of = {node: process for process, nodes in PROCESSES.items() for node in nodes}
    nodes = {
        name: msgspec.structs.replace(entry, process=process_of.get(name, ""))
        for name, entry in launch.nodes.items()
    }
    nodes["person"] = NodeEntry(kind="chefbot.demo.operator_node:OperatorDevice")
    return with_namespace(msgspec.structs.replace(launch, args={**launch.args, "wire": "on"}, nodes=nodes))


def cpu_seconds(pid: int) -> float | None:
    """Return the CPU time of a running process, s; None where the system has no /proc."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class DemoProcesses:
    """The worker processes of the demo; `used` is the CPU time of each process by name, s."""

    def __init__(
        self, system: NodeContainer, clock: LeaderClock, console: Console, keeps_running: Callable[[], bool]
    ) -> None:
        """Open the wire. Raises UserError if that fails.

        `keeps_running` returns False once the demo is aborted.
        """
        self.cpu_time: dict[str, float] = {}
        self._system, self._clock, self._keeps_running = system, clock, keeps_running
        self._stack = ExitStack()
        self._running = ExitStack()
        self._supervisor: Supervisor | None = None
        share_secret()
        plan = split_into_processes(load_launch("explore"))
        wire = self._stack.enter_context(open_wire(plan, ExternalEndpoints(), console.print))
        assert wire is not None, "wire:=on"
        self._bridge = self._stack.enter_context(open_bridge(system, plan, wire))
        system.loop.add_observer(print_notices)
        self._missing: set[str] = set()
        self._normal_speed = clock.real_time_factor
        system.loop.add_observer(self._on_process_state)
        namespace = str(plan.args["namespace"]) or "/"
        subscribe_to_progress(
            self._stack.enter_context(RmwNode(wire, "chefbot_pace", namespace)), self._on_progress
        )

    def start(self, launch: Launch) -> None:
        """Replace the nodes of all processes; return when all nodes are on the wire."""
        plan = split_into_processes(launch)
        own_part, worker_parts = split_by_process(plan)
        self._end_children()
        self._clock.set_followers(worker_parts)
        start(self._system, own_part)
        folder = Path.cwd()
        self._supervisor = self._running.enter_context(run_workers(self._bridge, self._system, plan, folder))
        self._wait_for(list(worker_parts))

    def close(self) -> None:
        """End all worker processes and leave the wire."""
        self._end_children()
        own = cpu_seconds(os.getpid())
        if own is not None:
            self.cpu_time[MAIN_PROCESS] = own
        self._stack.close()

    def table(self) -> list[tuple[str, str]]:
        """Return a line for each process: its nodes and its CPU time."""
        lines = [
            (f"process {name}", f"{seconds:.1f} s of CPU; {', '.join(PROCESSES.get(name, ()))}".rstrip("; "))
            for name, seconds in self.cpu_time.items()
        ]
        wait = self._clock.total_wait_ns / 1e9
        waited = f"real-time factor {MAX_REAL_TIME_FACTOR:g} at most; waited {wait:.1f} s for other processes"
        return [*lines, ("pace", waited)]

    def _on_process_state(self, publication: Publication) -> None:
        """Limit the real-time factor to 1 while a process is missing, as its restart takes wall time."""
        if not isinstance(publication.message, String):
            return
        if publication.topic == "process_lost":
            self._missing.add(publication.message.data)
        elif publication.topic == "process_back":
            self._missing.discard(publication.message.data)
        speed = min(1.0, self._normal_speed) if self._missing else self._normal_speed
        self._clock.set_real_time_factor(speed, self._system.loop.now_ns)

    def _on_progress(self, process: str, reached_ns: int) -> None:
        self._clock.report_time(process, reached_ns)
        self._system.loop.wake()

    def _wait_for(self, processes: list[str]) -> None:
        """Run the loop until all processes are on the wire, as they follow its time."""
        loop, deadline_ns = self._system.loop, wall_ns() + round(START_TIMEOUT * 1e9)
        while self._keeps_running() and not all(map(self._bridge.is_process_ready, processes)):
            loop.run(until_ns=loop.now_ns + POLL_PERIOD_NS)
            if wall_ns() > deadline_ns:
                missing = [name for name in processes if not self._bridge.is_process_ready(name)]
                raise UserError(f"process {missing[0]} is not on the wire after {START_TIMEOUT:.0f} s")

    def _end_children(self) -> None:
        for name, pid in (self._supervisor.pids() if self._supervisor else {}).items():
            used = cpu_seconds(pid)
            if used is not None:
                self.cpu_time[name] = self.cpu_time.get(name, 0.0) + used
        self._supervisor = None
        self._running.close()
