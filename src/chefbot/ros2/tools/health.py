"""Graph checks of `chefbot doctor`: number of nodes, duplicate names and incompatible endpoints."""

from __future__ import annotations

import os
from collections import Counter

from chefbot.ros2.rmw.environment import domain_from_environment, port_from_environment
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.session import LOOPBACK, RmwContext
from chefbot.ros2.tools.common import is_hidden, mismatches, settle

LOOK = 0.5
"""Maximum time in which a router on this machine responds, s."""
RMW = "rmw_zenoh_cpp"


def graph_lines() -> list[str]:
    """Return a line on the state of the network, and one for each problem."""
    domain, port = domain_from_environment(), port_from_environment()
    address = f"wire at {LOOPBACK}:{port}, domain {domain}"
    with RmwContext(domain, port=port, router=False) as wire:
        if not wire.graph.wait_for(lambda _: wire.connected, LOOK):
            return [
                f"{address}: no nodes; start a launch, then ROS 2 tools see the robot",
                *_rmw_warnings(),
            ]
        settle(wire.graph)
        return [f"{address}: {_counts_text(wire.graph)}", *_rmw_warnings(), *graph_problems(wire.graph)]


def graph_problems(graph: Graph) -> list[str]:
    """Return a line for each duplicate node name and each pair of incompatible endpoints."""
    names = Counter(node.full_name for node in graph.nodes() if not is_hidden(node.full_name))
    duplicates = [f"! {count} nodes are called {name}" for name, count in names.items() if count > 1]
    return [*duplicates, *(f"! {sentence}" for sentence in mismatches(graph))]


def _counts_text(graph: Graph) -> str:
    nodes = {node.full_name for node in graph.nodes() if not is_hidden(node.full_name)}
    topics = [name for name in graph.topics() if not is_hidden(name)]
    return f"{len(nodes)} nodes, {len(topics)} topics"


def _rmw_warnings() -> list[str]:
    """Return a warning if ROS 2 on this machine uses another RMW implementation."""
    distro, rmw = os.environ.get("ROS_DISTRO"), os.environ.get("RMW_IMPLEMENTATION")
    if not distro or rmw == RMW:
        return []
    return [
        f"! ROS 2 {distro} uses {rmw or 'DDS'} and cannot communicate with chefbot: export RMW_IMPLEMENTATION={RMW}"
    ]
