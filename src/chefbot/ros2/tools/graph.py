"""The command `chefbot node graph`: nodes, topics and measured data rates, drawn by Graphviz or as JSON."""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

from chefbot.ros2.rmw.graph import Endpoint, EndpointGroup, Graph
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.tools.common import ToolError, console, graph_node, is_hidden, mismatches, stop_event
from chefbot.ros2.tools.graph_dot import to_dot
from chefbot.ros2.tools.meter import Meter, Rate
from chefbot.ros2.tools.subscribe import TypedSampleCallback, subscribe_any
from chefbot.ros2.tools.topic_info import without_tools
from chefbot.storage.atomic_files import write_into_folder

HOUSEKEEPING = {"/rosout", "/parameter_events"}
"""Topics that every ROS 2 node has and that are not specific to this robot."""


def run_graph(out: Path, as_json: bool, seconds: float) -> None:
    """Measure rates for `seconds`, then draw the graph into `out`, or print it as JSON."""
    with graph_node("graph") as node, stop_event() as stop:
        rates = measure_rates(node, seconds, stop)
        graph = describe(node.wire.graph, rates)
    if as_json:
        console.print(json.dumps(graph, indent=2))
        return
    note = write_graph(out, to_dot(graph))
    console.print(f"{len(graph['nodes'])} nodes, {len(graph['topics'])} topics: {note}")
    for sentence in graph["mismatches"]:
        console.print(f"! {sentence}")


def write_graph(out: Path, dot: str) -> str:
    """Draw DOT text into `out` by Graphviz, and return a note on what was written.

    The suffix of `out` chooses the format (svg, png, pdf, dot). The text itself is written if it is `.dot`, or,
    beside `out`, if Graphviz is not installed. ToolError if Graphviz does not know the format.
    """
    program = shutil.which("dot")
    text = out.with_suffix(".dot")
    if out == text or program is None:
        write_into_folder(text, dot.encode())
        if out == text:
            return str(text)
        draw = f"dot -T{_format(out)} {text} -o {out}"
        return f"{text}; install Graphviz (sudo apt-get install graphviz) and draw it by `{draw}`"
    command = [program, f"-T{_format(out)}"]
    drawn = subprocess.run(command, input=dot.encode(), capture_output=True)
    if drawn.returncode != 0:
        reason = " ".join(drawn.stderr.decode(errors="replace").split())
        raise ToolError(f"Graphviz does not draw {out}: {reason}")
    write_into_folder(out, drawn.stdout)
    return str(out)


def _format(out: Path) -> str:
    return out.suffix[1:] or "svg"


def measure_rates(node: RmwNode, seconds: float, stop: threading.Event) -> dict[str, dict[str, float | int]]:
    """Return messages, Hz and bytes per second of each topic; empty if `seconds` is 0."""
    if seconds <= 0:
        return {}
    meters: dict[str, Meter] = {}
    for topic in node.wire.graph.topics().values():
        if topic.providers and _shown(topic):
            meters[topic.name] = Meter()
            subscribe_any(node, topic, _counter(meters[topic.name]), stored=False)
    stop.wait(seconds)
    return {name: _rate_fields(meter.rate()) for name, meter in meters.items()}


def _counter(meter: Meter) -> TypedSampleCallback:
    return lambda _, data: meter.add(time.monotonic(), len(data))


def _rate_fields(rate: Rate) -> dict[str, float | int]:
    return {
        "messages": rate.messages,
        "hz": round(rate.hz, 2),
        "bytes_per_second": round(rate.bytes_per_second),
    }


def describe(graph: Graph, rates: dict[str, dict[str, float | int]]) -> dict[str, Any]:
    """Return nodes, topics, services, actions and mismatches of the graph as JSON data.

    Tools, hidden names and `HOUSEKEEPING` topics are left out.
    """
    nodes = sorted({node.full_name for node in graph.nodes() if not is_hidden(node.full_name)})
    topics = [
        {
            **_entry(topic, "publishers", "subscriptions"),
            **rates.get(topic.name, {}),
            "latched": _latched(topic),
        }
        for topic in graph.topics().values()
        if _shown(topic) and (without_tools(topic.providers) or without_tools(topic.consumers))
    ]
    services = [
        _entry(service, "servers", "clients")
        for service in graph.services().values()
        if not is_hidden(service.name)
    ]
    actions = [_entry(action, "servers", "clients") for action in graph.actions().values()]
    return {
        "nodes": nodes,
        "topics": topics,
        "services": services,
        "actions": actions,
        "mismatches": mismatches(graph),
    }


def _shown(named: EndpointGroup) -> bool:
    return not is_hidden(named.name) and named.name not in HOUSEKEEPING


def _latched(named: EndpointGroup) -> bool:
    return any(publisher.info.qos.latched for publisher in named.providers)


def _entry(named: EndpointGroup, providers: str, consumers: str) -> dict[str, Any]:
    return {
        "name": named.name,
        "types": list(dict.fromkeys(kind.name for kind in named.types)),
        providers: _node_names(named.providers),
        consumers: _node_names(named.consumers),
    }


def _node_names(endpoints: tuple[Endpoint, ...]) -> list[str]:
    return sorted({endpoint.node.full_name for endpoint in without_tools(endpoints)})
