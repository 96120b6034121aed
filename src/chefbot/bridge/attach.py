"""A launch on the wire: whether it wants to be, and whether it can."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import msgspec

from chefbot.bridge.bridge import Bridge
from chefbot.bridge.local_only import LEADER
from chefbot.bridge.ports import latched_topics
from chefbot.errors import UserError
from chefbot.fleet.keyring import Identity, Keyring, keys_folder
from chefbot.fleet.secure_router import Doors, Gate
from chefbot.ros2.rmw.environment import domain_of_environment, port_of_environment
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.names import check_namespace
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.session import Wire
from chefbot.runtime.launch import Launch, node_class, node_params, split
from chefbot.runtime.node_container import System
from chefbot.supervision.state_handover import LastWords
from chefbot.supervision.supervisor import Hooks, Supervisor
from chefbot.supervision.worker_process import Order

CHOICES = ("auto", "on", "off")
SETTLING = 1.0
"""Seconds in which those who are on the wire already find who comes."""


def wants_wire(launch: Launch) -> bool:
    """By its argument `wire`; `auto` is on unless time runs as fast as may be. UserError for another word."""
    wish = str(launch.args["wire"])
    if wish not in CHOICES:
        raise UserError(f"launch {launch.name}: wire:={wish} must be one of {', '.join(CHOICES)}")
    live = launch.clock != "simulation" or float(launch.args["speed"]) > 0
    return wish == "on" or (wish == "auto" and live)


@contextmanager
def wired(launch: Launch, doors: Doors, tell: Callable[[str], None]) -> Iterator[Wire | None]:
    """The wire for a launch with the ways to other machines open, or None where it stays off.

    `launch` is as `in_fleet` gives it. `doors`: to other machines.

    Two launches with nodes of the same names would hear each other's sensors: the second stays off the wire and
    says so with `tell`; with `wire:=on` it is a UserError. Who joins a robot may first have to wait for it.
    """
    if not wants_wire(launch):
        if doors != Doors() or launch.clock == "robot":
            raise UserError(f"launch {launch.name}: other machines need the wire; say wire:=on")
        yield None
        return
    with Wire(domain_of_environment(), port=port_of_environment()) as wire:
        joins = launch.clock == "robot"  # whom it joins may be far still
        rival = "" if joins else _taken(wire, launch)
        if rival and launch.args["wire"] == "on":
            raise UserError(f"launch {launch.name}: {rival}")
        if rival:
            tell(f"Not on the wire: {rival}")
            yield None
            return
        with _gate(wire, doors, tell):
            yield wire


@contextmanager
def bridged(system: System, launch: Launch, wire: Wire, joins: str = "") -> Iterator[Bridge]:
    """The system on the wire: call `represent` on it once the nodes are there.

    `joins`: it is a part of a robot that runs elsewhere; then its own node is called so, and it tells no /clock.
    """
    space = str(launch.args["namespace"]) or "/"
    simulated = launch.clock == "simulation"
    bridge = Bridge(system, wire, space, simulated=simulated, leads=not joins, own=joins or LEADER)
    try:
        yield bridge
    finally:
        bridge.close()


@contextmanager
def attached(
    system: System, launch: Launch, doors: Doors, tell: Callable[[str], None]
) -> Iterator[Bridge | None]:
    """`wired` and `bridged` in one, for a launch that joins nobody; None where it stays off the wire."""
    with wired(launch, doors, tell) as wire:
        if wire is None:
            yield None
            return
        with bridged(system, launch, wire) as bridge:
            yield bridge


def in_fleet(launch: Launch) -> Launch:
    """With its namespace written out: as its argument says, else a robot's name in its fleet. UserError if wrong."""
    me = identity()
    space = str(launch.args["namespace"]).strip("/")
    if not space and me is not None and me.role == "robot":
        space = me.name
    try:
        full = check_namespace(f"/{space}") if space else ""
    except WireError as error:
        raise UserError(f"launch {launch.name}: namespace:={space}: {error}") from None
    return msgspec.structs.replace(launch, args={**launch.args, "namespace": full})


def identity() -> Identity | None:
    """Who this machine is in its fleet."""
    ring = Keyring(keys_folder())
    return ring.identity() if ring.is_member else None


@contextmanager
def _gate(wire: Wire, doors: Doors, tell: Callable[[str], None]) -> Iterator[None]:
    """Open where this machine belongs to a fleet or is told to; whom it turns away is counted with the wire's."""
    me = identity()
    if me is None and doors == Doors():
        yield
        return
    with Gate(me, doors, port_of_environment(), wire.refused) as gate:
        if gate.listens:
            tell(f"Other machines may join: {', '.join(gate.listens)}")
        if doors.join:
            tell(f"Joined with {', '.join(doors.join)}.")
        yield


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
    with WireNode(bridge.wire, f"_{bridge.own}_memory", str(launch.args["namespace"]) or "/") as node:
        memory = LastWords(node, launch, system)
        hooks = Hooks(lost=bridge.lose, ready=bridge.sees, back=bridge.regain, last_words=memory.of)
        supervisor = Supervisor(orders, partial(bridge.remark, "processes"), hooks=hooks)
        try:
            yield supervisor
        finally:
            supervisor.close()


def same_names(graph: Graph, launch: Launch) -> list[str]:
    """Nodes of the launch whose names others on the wire have already."""
    space = str(launch.args["namespace"]) or "/"
    return sorted({one.name for one in graph.nodes() if one.namespace == space} & launch.nodes.keys())


def _taken(wire: Wire, launch: Launch) -> str:
    """Why this launch cannot be on the wire; empty if it can."""

    def both(graph: Graph) -> list[str]:
        return same_names(graph, launch)

    space = str(launch.args["namespace"]).rstrip("/")
    wire.graph.refresh()
    if not wire.is_router:  # somebody was here before, and may tell of its nodes only when it has found us
        wire.graph.wait_for(both, SETTLING)
    if not (rivals := both(wire.graph)):
        return ""
    return f"{space}/{rivals[0]} runs on this machine already; stop that launch, set ROS_DOMAIN_ID, or say wire:=off"
