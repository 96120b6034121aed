"""What `chefbot doctor` says of the wire: who is there, and who of them cannot hear whom."""

from __future__ import annotations

import os
from collections import Counter

from chefbot.ros2.rmw.environment import domain_of_environment, port_of_environment
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.session import LOOPBACK, Wire
from chefbot.ros2.tools.common import hidden, mismatches, settle

LOOK = 0.5
"""Seconds in which a router on this machine answers."""
RMW = "rmw_zenoh_cpp"


def wire_lines() -> list[str]:
    """A line, and one for each thing that is wrong."""
    domain, port = domain_of_environment(), port_of_environment()
    place = f"wire at {LOOPBACK}:{port}, domain {domain}"
    with Wire(domain, port=port, router=False) as wire:
        if not wire.graph.wait_for(lambda _: wire.connected, LOOK):
            return [f"{place}: nobody; a launch opens it, and ROS 2's tools then see the robot", *_ros()]
        settle(wire.graph)
        return [f"{place}: {_crowd(wire.graph)}", *_ros(), *troubles(wire.graph)]


def troubles(graph: Graph) -> list[str]:
    """Names that stand for two nodes, and ends that cannot hear each other."""
    names = Counter(one.full_name for one in graph.nodes() if not hidden(one.full_name))
    twice = [f"! {count} nodes are called {name}" for name, count in names.items() if count > 1]
    return [*twice, *(f"! {one}" for one in mismatches(graph))]


def _crowd(graph: Graph) -> str:
    nodes = {one.full_name for one in graph.nodes() if not hidden(one.full_name)}
    topics = [name for name in graph.topics() if not hidden(name)]
    return f"{len(nodes)} nodes, {len(topics)} topics"


def _ros() -> list[str]:
    """ROS 2 here, but on another wire."""
    distro, rmw = os.environ.get("ROS_DISTRO"), os.environ.get("RMW_IMPLEMENTATION")
    if not distro or rmw == RMW:
        return []
    return [
        f"! ROS 2 {distro} speaks {rmw or 'DDS'} here and does not hear chefbot: export RMW_IMPLEMENTATION={RMW}"
    ]
