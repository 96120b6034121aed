"""The demo as several processes over the wire: who runs where, and what each cost."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.bridge.attach import attached, in_fleet, others
from chefbot.bridge.bridge import Bridge
from chefbot.bridge.sim_time_sync import hear_followers
from chefbot.errors import UserError
from chefbot.fleet.secure_router import Doors
from chefbot.launcher.session import show_remarks, start
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import WireNode
from chefbot.runtime.clock import LeadingClock, wall_ns
from chefbot.runtime.launch import Launch, NodeEntry, load_launch, split
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import System
from chefbot.supervision.supervisor import Supervisor

SPEED = 4.0
"""Times real time at most: so that what the wire takes stays small beside what control waits anyway."""
PROCESSES = {
    "slam": ("gmapping", "amcl"),
    "navigation": ("planner", "controller", "navigator", "explorer", "finder"),
    "service": ("places", "map_file", "delivery", "page"),
}
"""All others run with the simulator in the demo's own process: drivers, odometry, the gate before the wheels."""
OWN = "simulator and base"
PATIENCE = 60.0
"""Wall seconds until all processes must be there."""
LOOK_NS = 50_000_000


def in_processes(launch: Launch) -> Launch:
    """Its nodes divided among PROCESSES, and the person beside them."""
    homes = {node: process for process, nodes in PROCESSES.items() for node in nodes}
    nodes = {
        name: msgspec.structs.replace(entry, process=homes.get(name, ""))
        for name, entry in launch.nodes.items()
    }
    nodes["person"] = NodeEntry(kind="chefbot.demo.operator_node:PersonDevice")
    return in_fleet(msgspec.structs.replace(launch, args={**launch.args, "wire": "on"}, nodes=nodes))


def cpu_seconds(pid: int) -> float | None:
    """CPU time of a running process so far; None where the system has no /proc."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Processes:
    """`start(launch)` replaces the nodes of all processes; `used` is what they cost, CPU seconds by name."""

    def __init__(
        self, system: System, clock: LeadingClock, console: Console, going: Callable[[], bool]
    ) -> None:
        """UserError if the wire cannot be had. `going`: False as soon as somebody gives up."""
        self.used: dict[str, float] = {}
        self._system, self._clock, self._going = system, clock, going
        self._stack = ExitStack()
        self._running = ExitStack()
        self._supervisor: Supervisor | None = None
        plan = in_processes(load_launch("explore"))
        bridge = self._stack.enter_context(attached(system, plan, Doors(), console.print))
        assert bridge is not None, "wire:=on"
        self._bridge: Bridge = bridge
        system.loop.tap(show_remarks)
        self._missing: set[str] = set()
        self._usual_speed = clock.speed
        system.loop.tap(self._notice)
        space = str(plan.args["namespace"]) or "/"
        hear_followers(self._stack.enter_context(WireNode(bridge.wire, "chefbot_pace", space)), self._hear)

    def start(self, launch: Launch) -> None:
        """The former processes end before the new begin; returns when all nodes are on the wire."""
        plan = in_processes(launch)
        own, rest = split(plan)
        self._end_children()
        self._clock.follow(rest)
        start(self._system, own)
        folder = Path.cwd()
        self._supervisor = self._running.enter_context(others(self._bridge, self._system, plan, folder))
        self._await(list(rest))

    def close(self) -> None:
        """End all but this one."""
        self._end_children()
        own = cpu_seconds(os.getpid())
        if own is not None:
            self.used[OWN] = own
        self._stack.close()

    def table(self) -> list[tuple[str, str]]:
        """A line for each process: what runs in it, its CPU."""
        lines = [
            (f"process {name}", f"{seconds:.1f} s of CPU; {', '.join(PROCESSES.get(name, ()))}".rstrip("; "))
            for name, seconds in self.used.items()
        ]
        waited = f"at {SPEED:g} x real time at most; {self._clock.waited_ns / 1e9:.1f} s waited for followers"
        return [*lines, ("pace", waited)]

    def _notice(self, publication: Publication) -> None:
        """While a process is missing time does not hurry: starting it again takes what it takes of the wall's."""
        if not isinstance(publication.message, String):
            return
        if publication.topic == "process_lost":
            self._missing.add(publication.message.data)
        elif publication.topic == "process_back":
            self._missing.discard(publication.message.data)
        pace = min(1.0, self._usual_speed) if self._missing else self._usual_speed
        self._clock.change_pace(pace, self._system.loop.now_ns)

    def _hear(self, process: str, reached_ns: int) -> None:
        self._clock.tell(process, reached_ns)
        self._system.loop.wake()

    def _await(self, processes: list[str]) -> None:
        """Time goes on meanwhile: they follow it."""
        loop, until = self._system.loop, wall_ns() + round(PATIENCE * 1e9)
        while self._going() and not all(map(self._bridge.sees, processes)):
            loop.run(until_ns=loop.now_ns + LOOK_NS)
            if wall_ns() > until:
                missing = [name for name in processes if not self._bridge.sees(name)]
                raise UserError(f"process {missing[0]} is not on the wire after {PATIENCE:.0f} s")

    def _end_children(self) -> None:
        for name, pid in (self._supervisor.pids() if self._supervisor else {}).items():
            used = cpu_seconds(pid)
            if used is not None:
                self.used[name] = self.used.get(name, 0.0) + used
        self._supervisor = None
        self._running.close()
