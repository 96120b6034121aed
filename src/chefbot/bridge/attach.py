"""Connection of a launch to the wire: whether it is requested, and whether it is possible."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import msgspec

from chefbot.bridge.bridge import Bridge
from chefbot.bridge.local_only import MAIN_NODE_NAME
from chefbot.bridge.membership_health import MembershipHealth
from chefbot.bridge.ports import launch_ports
from chefbot.errors import UserError
from chefbot.fleet.identity import Identity
from chefbot.fleet.keyring import Keyring, keys_folder
from chefbot.fleet.secure_router import ExternalEndpoints, SecureRouter
from chefbot.ros2.rmw.environment import domain_from_environment, port_from_environment
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.names import check_namespace
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.launch import Launch, node_class, node_params, split_by_process
from chefbot.runtime.node_container import NodeContainer
from chefbot.supervision.state_handover import StateHandover
from chefbot.supervision.supervisor import Supervisor, SupervisorCallbacks
from chefbot.supervision.worker_process import WorkerSpec

WIRE_CHOICES = ("auto", "on", "off")
DISCOVERY_TIME = 1.0
"""Time in which participants that are already on the wire discover a new one, s."""


def wire_requested(launch: Launch) -> bool:
    """Return whether the launch's argument `wire` requests a connection.

    `auto` is on unless simulated time runs as fast as possible. Raises UserError for an unknown value.
    """
    choice = str(launch.args["wire"])
    if choice not in WIRE_CHOICES:
        raise UserError(f"launch {launch.name}: wire:={choice} must be one of {', '.join(WIRE_CHOICES)}")
    live = launch.clock != "simulation" or float(launch.args["speed"]) > 0
    return choice == "on" or (choice == "auto" and live)


@contextmanager
def open_wire(
    launch: Launch, endpoints: ExternalEndpoints, log: Callable[[str], None]
) -> Iterator[RmwContext | None]:
    """Open the wire and the connections to other machines for a launch; yield None where it stays off.

    `launch` is as returned by `with_namespace`; `endpoints` are the endpoints to other machines.

    Two launches with nodes of the same names would receive each other's sensor data: the second one stays off
    the wire and logs this with `log`; with `wire:=on` a UserError is raised. A launch that joins a robot may
    first have to wait for it.
    """
    if not wire_requested(launch):
        if endpoints != ExternalEndpoints() or launch.clock == "robot":
            raise UserError(f"launch {launch.name}: other machines need the wire; set wire:=on")
        yield None
        return
    with RmwContext(domain_from_environment(), port=port_from_environment()) as wire:
        joins_robot = launch.clock == "robot"  # the robot that it joins may not be reachable yet
        conflict = "" if joins_robot else _name_conflict(wire, launch)
        if conflict and launch.args["wire"] == "on":
            raise UserError(f"launch {launch.name}: {conflict}")
        if conflict:
            log(f"Without ROS 2, RViz and other processes: {conflict}")
            yield None
            return
        with _secure_router(wire, endpoints, log):
            yield wire


@contextmanager
def open_bridge(
    system: NodeContainer, launch: Launch, wire: RmwContext, joined_name: str = ""
) -> Iterator[Bridge]:
    """Bridge the system to the wire; call `represent` on the bridge once the nodes exist.

    `joined_name`: this process's node name if it is a part of a robot that runs elsewhere; it does not
    publish /clock then.
    """
    namespace = str(launch.args["namespace"]) or "/"
    simulated = launch.clock == "simulation"
    bridge = Bridge(
        system,
        wire,
        namespace,
        simulated=simulated,
        publishes_clock=not joined_name,
        node_name=joined_name or MAIN_NODE_NAME,
        membership=_membership(),
    )
    try:
        yield bridge
    finally:
        bridge.close()


def with_namespace(launch: Launch) -> Launch:
    """Return the launch with its namespace resolved.

    It is the launch's argument, or else the robot's name in its fleet. Raises UserError if it is invalid.
    """
    own_identity = identity()
    namespace = str(launch.args["namespace"]).strip("/")
    if not namespace and own_identity is not None and own_identity.role == "robot":
        namespace = own_identity.name
    try:
        full_namespace = check_namespace(f"/{namespace}") if namespace else ""
    except RmwError as error:
        raise UserError(f"launch {launch.name}: namespace:={namespace}: {error}") from None
    return msgspec.structs.replace(launch, args={**launch.args, "namespace": full_namespace})


def identity() -> Identity | None:
    """Return this machine's identity in its fleet, if it belongs to one."""
    ring = _own_ring()
    return None if ring is None else ring.identity()


def _own_ring() -> Keyring | None:
    """Return this machine's key folder if it belongs to a fleet."""
    ring = Keyring(keys_folder())
    return ring if ring.is_member else None


def _membership() -> MembershipHealth | None:
    ring = _own_ring()
    return None if ring is None else MembershipHealth(ring)


@contextmanager
def _secure_router(
    wire: RmwContext, endpoints: ExternalEndpoints, log: Callable[[str], None]
) -> Iterator[None]:
    """Run the secure router where this machine is in a fleet or has endpoints to open.

    Rejected messages are counted with those of the wire.
    """
    ring = _own_ring()
    if ring is None and endpoints == ExternalEndpoints():
        yield
        return
    with SecureRouter(ring, endpoints, port_from_environment(), wire.rejected) as gate:
        if ring is not None and (warning := ring.warning(datetime.now(UTC))):
            log(f"Warning: {warning}.")
        if gate.listen_endpoints:
            log(f"Other machines may join: {', '.join(gate.listen_endpoints)}")
        if endpoints.join:
            log(f"Joined with {', '.join(endpoints.join)}.")
        yield


@contextmanager
def run_workers(bridge: Bridge, system: NodeContainer, launch: Launch, folder: Path) -> Iterator[Supervisor]:
    """Represent the launch's nodes on the wire and run its other processes until the context is left.

    Raises UserError when the parameters of any node are wrong, also of nodes in other processes: reported
    here, where the user sees it.
    """
    _check_params(launch)
    bridge.represent(system.nodes.values(), launch_ports(launch))
    orders = _worker_specs(launch, folder)
    with RmwNode(bridge.wire, f"_{bridge.node_name}_memory", str(launch.args["namespace"]) or "/") as node:
        handover = StateHandover(node, launch, system)
        hooks = _supervisor_callbacks(bridge, handover)
        supervisor = Supervisor(orders, partial(bridge.publish_notice, "processes"), hooks=hooks)
        try:
            yield supervisor
        finally:
            supervisor.close()


def _check_params(launch: Launch) -> None:
    for name, entry in launch.nodes.items():
        where = f"launch {launch.name}: node {name}"
        node_params(node_class(entry.kind, where), entry.params, where)


def _worker_specs(launch: Launch, folder: Path) -> list[WorkerSpec]:
    domain, port = domain_from_environment(), port_from_environment()
    names = split_by_process(launch)[1]
    return [WorkerSpec(launch, name, str(folder.resolve()), domain, port) for name in names]


def _supervisor_callbacks(bridge: Bridge, handover: StateHandover) -> SupervisorCallbacks:
    return SupervisorCallbacks(
        on_down=bridge.report_process_down,
        is_ready=bridge.is_process_ready,
        on_up=bridge.report_process_up,
        restored_messages=handover.restored_messages,
    )


def conflicting_node_names(graph: Graph, launch: Launch) -> list[str]:
    """Return the names of the launch's nodes that other nodes on the wire have already."""
    namespace = str(launch.args["namespace"]) or "/"
    return sorted({node.name for node in graph.nodes() if node.namespace == namespace} & launch.nodes.keys())


def _name_conflict(wire: RmwContext, launch: Launch) -> str:
    """Return why this launch cannot be on the wire, or an empty string if it can."""

    def conflicts(graph: Graph) -> list[str]:
        return conflicting_node_names(graph, launch)

    prefix = str(launch.args["namespace"]).rstrip("/")
    wire.graph.refresh()
    if (
        not wire.is_router
    ):  # an earlier process has the router, and may announce its nodes only after discovery
        wire.graph.wait_for(conflicts, DISCOVERY_TIME)
    if not (names := conflicts(wire.graph)):
        return ""
    return (
        f"another launch with a node {prefix}/{names[0]} runs on this machine, and each would receive the other's"
        " data; stop that launch, set another ROS_DOMAIN_ID for this one, or set wire:=off"
    )
