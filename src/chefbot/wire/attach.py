"""A launch on the wire: whether it wants to be, and whether it can."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from chefbot.errors import UserError
from chefbot.runtime.launch import Launch, node_class, node_params, split
from chefbot.runtime.system import System
from chefbot.wire.bridge import Bridge
from chefbot.wire.environment import domain_of_environment, port_of_environment
from chefbot.wire.ports import latched_topics
from chefbot.wire.session import Wire
from chefbot.wire.supervisor import Order, Supervisor

CHOICES = ("auto", "on", "off")


def wants_wire(launch: Launch) -> bool:
    """By its argument `wire`; `auto` is on unless time runs as fast as may be. UserError for another word."""
    wish = str(launch.args["wire"])
    if wish not in CHOICES:
        raise UserError(f"launch {launch.name}: wire:={wish} must be one of {', '.join(CHOICES)}")
    live = launch.clock == "wall" or float(launch.args["speed"]) > 0
    return wish == "on" or (wish == "auto" and live)


@contextmanager
def attached(system: System, launch: Launch, tell: Callable[[str], None]) -> Iterator[Bridge | None]:
    """The system on the wire, or None: call `represent` on it once the nodes are there.

    Two launches with nodes of the same names would hear each other's sensors: the second stays off the wire and
    says so with `tell`; with `wire:=on` it is a UserError.
    """
    if not wants_wire(launch):
        yield None
        return
    with Wire(domain_of_environment(), port=port_of_environment()) as wire:
        rival = _taken(wire, launch)
        if rival and launch.args["wire"] == "on":
            raise UserError(f"launch {launch.name}: {rival}")
        if rival:
            tell(f"Not on the wire: {rival}")
            yield None
            return
        bridge = Bridge(system, wire, simulated=launch.clock == "simulation")
        try:
            yield bridge
        finally:
            bridge.close()


@contextmanager
def others(bridge: Bridge, system: System, launch: Launch, folder: Path) -> Iterator[Supervisor]:
    """The launch's nodes seen on the wire, and its other processes running, until this is left.

    UserError when something in the others does not fit: said here, where people look.
    """
    for name, entry in launch.nodes.items():
        where = f"launch {launch.name}: node {name}"
        node_params(node_class(entry.kind, where), entry.params, where)
    bridge.represent(system.nodes.values(), latched_topics(launch))
    domain, port = domain_of_environment(), port_of_environment()
    names = split(launch)[1]
    orders = [Order(launch, name, str(folder.resolve()), domain, port) for name in names]
    supervisor = Supervisor(orders, partial(bridge.remark, "processes"))
    try:
        yield supervisor
    finally:
        supervisor.close()


def _taken(wire: Wire, launch: Launch) -> str:
    """Why this launch cannot join; empty if it can."""
    wire.graph.refresh()
    there = {node.name for node in wire.graph.nodes() if node.namespace == "/"}
    both = sorted(there & launch.nodes.keys())
    if not both:
        return ""
    return f"/{both[0]} runs on this machine already; stop that launch, set ROS_DOMAIN_ID, or say wire:=off"
