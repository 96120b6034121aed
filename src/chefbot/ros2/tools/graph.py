"""`chefbot graph`: nodes, topics and what flows between them, measured; as a picture or as JSON."""

from __future__ import annotations

import json
import threading
import time
from pathlib import Path
from typing import Any

from chefbot.ros2.rmw.graph import Endpoint, Graph, Named
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.tools.common import console, hidden, mismatches, on_wire, stopping
from chefbot.ros2.tools.graph_svg import to_svg
from chefbot.ros2.tools.listen import Hear, listen
from chefbot.ros2.tools.meter import Meter, Rate
from chefbot.ros2.tools.topic_info import seen
from chefbot.storage.atomic_files import write_into_folder

HOUSEKEEPING = {"/rosout", "/parameter_events"}
"""What every node of ROS 2 has, and what says nothing about this robot."""


def run_graph(out: Path, as_json: bool, seconds: float) -> None:
    """Measure for so long, then write the picture, or print the numbers."""
    with on_wire("graph") as node, stopping() as stop:
        rates = measure_rates(node, seconds, stop)
        found = describe(node.wire.graph, rates)
    if as_json:
        console.print(json.dumps(found, indent=2))
        return
    write_into_folder(out, to_svg(found).encode())
    console.print(f"{out}: {len(found['nodes'])} nodes, {len(found['topics'])} topics")
    for sentence in found["mismatches"]:
        console.print(f"! {sentence}")


def measure_rates(node: WireNode, seconds: float, stop: threading.Event) -> dict[str, dict[str, float | int]]:
    """Topic to messages, Hz and bytes per second; nothing is measured in no time."""
    if seconds <= 0:
        return {}
    meters: dict[str, Meter] = {}
    for one in node.wire.graph.topics().values():
        if one.givers and _shown(one):
            meters[one.name] = Meter()
            listen(node, one, _counter(meters[one.name]))
    stop.wait(seconds)
    return {name: _plain(meter.rate()) for name, meter in meters.items()}


def _counter(meter: Meter) -> Hear:
    return lambda _, data: meter.add(time.monotonic(), len(data))


def _plain(rate: Rate) -> dict[str, float | int]:
    return {
        "messages": rate.messages,
        "hz": round(rate.hz, 2),
        "bytes_per_second": round(rate.bytes_per_second),
    }


def describe(graph: Graph, rates: dict[str, dict[str, float | int]]) -> dict[str, Any]:
    """Plain data: nodes, topics with their ends and rates, services, actions, mismatches."""
    nodes = sorted({one.full_name for one in graph.nodes() if not hidden(one.full_name)})
    topics = [
        {**_ends(one, "publishers", "subscriptions"), **rates.get(one.name, {}), "latched": _latched(one)}
        for one in graph.topics().values()
        if _shown(one) and (seen(one.givers) or seen(one.takers))
    ]
    services = [_ends(one, "servers", "clients") for one in graph.services().values() if not hidden(one.name)]
    actions = [_ends(one, "servers", "clients") for one in graph.actions().values()]
    return {
        "nodes": nodes,
        "topics": topics,
        "services": services,
        "actions": actions,
        "mismatches": mismatches(graph),
    }


def _shown(named: Named) -> bool:
    return not hidden(named.name) and named.name not in HOUSEKEEPING


def _latched(named: Named) -> bool:
    return any(one.end.qos.latched for one in named.givers)


def _ends(named: Named, givers: str, takers: str) -> dict[str, Any]:
    return {
        "name": named.name,
        "types": list(dict.fromkeys(kind.name for kind in named.types)),
        givers: _names(named.givers),
        takers: _names(named.takers),
    }


def _names(ends: tuple[Endpoint, ...]) -> list[str]:
    return sorted({one.node.full_name for one in seen(ends)})
