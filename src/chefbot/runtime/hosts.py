"""One launch file for several machines: each is started with the same file and runs its own part of it."""

from __future__ import annotations

import msgspec

from chefbot.errors import UserError, nearest
from chefbot.runtime.launch import Launch


def hosts_of(launch: Launch) -> dict[str, list[str]]:
    """Machine to the nodes that run there; what says no `host:` runs on the robot and is not here."""
    found: dict[str, list[str]] = {}
    for name, entry in launch.nodes.items():
        if entry.host:
            found.setdefault(entry.host, []).append(name)
    return found


def part_on(launch: Launch, machine: str) -> Launch:
    """What runs on `machine`, ready to join the robot; on a machine that no entry names, the robot's own part."""
    hosts = hosts_of(launch)
    mine = machine if machine in hosts else ""
    nodes = {name: entry for name, entry in launch.nodes.items() if entry.host == mine}
    if mine:
        return msgspec.structs.replace(launch, clock="robot", nodes=nodes)
    return msgspec.structs.replace(launch, nodes=nodes)


def check_host(launch: Launch, asked: str, machine: str, *, may_be_robot: bool) -> None:
    """UserError when `--host` names a machine that has no part, or when this one must have a part and has none.

    `asked`: what `--host` says, empty without it; `machine`: this one then.
    """
    hosts = hosts_of(launch)
    if asked and not hosts:
        raise UserError(f"launch {launch.name}: no node of it has `host:`, so --host {asked} means nothing")
    if asked and asked not in hosts:
        raise UserError(f"launch {launch.name}: nothing runs on host {asked!r}{nearest(asked, hosts)}")
    if hosts and not asked and machine not in hosts and not may_be_robot:
        raise UserError(
            f"launch {launch.name}: {machine} is no robot and nothing has it as its host; "
            f"say --host with one of {', '.join(sorted(hosts))}"
        )
