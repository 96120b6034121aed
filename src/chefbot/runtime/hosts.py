"""One launch file for several machines: each machine is started with the same file and runs its own part."""

from __future__ import annotations

import msgspec

from chefbot.errors import UserError, name_hint
from chefbot.runtime.launch import Launch


def hosts_of(launch: Launch) -> dict[str, list[str]]:
    """Return the nodes by machine, without the nodes that have no `host:` and run on the robot."""
    nodes_by_host: dict[str, list[str]] = {}
    for name, entry in launch.nodes.items():
        if entry.host:
            nodes_by_host.setdefault(entry.host, []).append(name)
    return nodes_by_host


def part_for_machine(launch: Launch, machine: str) -> Launch:
    """Return the part of the launch that runs on `machine`, prepared to join the robot.

    For a machine that no entry names, this is the robot's own part.
    """
    hosts = hosts_of(launch)
    host = machine if machine in hosts else ""
    nodes = {name: entry for name, entry in launch.nodes.items() if entry.host == host}
    return msgspec.structs.replace(launch, clock="robot" if host else launch.clock, nodes=nodes)


def check_host(launch: Launch, requested: str, machine: str, *, may_be_robot: bool) -> None:
    """UserError if `--host` names a machine without nodes, or if this machine must have nodes and has none.

    `requested`: the value of `--host`, empty without it; `machine`: the name of this machine.
    """
    hosts = hosts_of(launch)
    if requested and not hosts:
        raise UserError(
            f"launch {launch.name}: none of its nodes has `host:`, so --host {requested} has no effect"
        )
    if requested and requested not in hosts:
        raise UserError(
            f"launch {launch.name}: nothing runs on host {requested!r}{name_hint(requested, hosts)}"
        )
    if hosts and not requested and machine not in hosts and not may_be_robot:
        raise UserError(
            f"launch {launch.name}: {machine} is not a robot and nothing has it as its host; "
            f"say --host with one of {', '.join(sorted(hosts))}"
        )
