"""The data flow of a launch as SVG: nodes are columns, topics and actions are rows, arrows show the direction."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from html import escape
from itertools import permutations
from pathlib import Path
from typing import NamedTuple

from chefbot.runtime.launch import load_launch, node_class
from generate.launches import ports_of

OPERATOR = ("page",)
"""Nodes of the operator, which exchange messages with nearly all others: the last columns."""
IGNORED = ("tf", "tf_static", "clock", "rosout", "parameter_events", "diagnostics")
"""Topics of the infrastructure, which would connect everything with everything."""
LEFT, COLUMN, ROW, TOP = 330, 84, 22, 126
"""Width of the labels, distance of columns and of rows, height of the heading, px."""
CHARACTER = 7
"""Mean width of a character of a node's name, px."""
FORWARD, BACKWARD, ACTION = "#1f6feb", "#b35900", "#1a7f37"
SENDS = ("publisher", "action client")
RECEIVES = ("subscription", "action server")


class Flow(NamedTuple):
    """One topic or action of a launch with the nodes that send and receive."""

    name: str
    type: str
    senders: tuple[str, ...]
    receivers: tuple[str, ...]

    @property
    def is_action(self) -> bool:
        """Whether goals are sent instead of messages."""
        return "/action/" in self.type


def flows_of(launch_name: str) -> tuple[dict[str, str], list[Flow]]:
    """Return module and class of each node of a launch by name, and its flows between different nodes."""
    launch = load_launch(launch_name, {"headless": "false"})
    nodes = {name: entry.kind for name, entry in launch.nodes.items()}
    ends: dict[tuple[str, str], tuple[list[str], list[str]]] = {}
    for name, entry in launch.nodes.items():
        for port in ports_of(node_class(entry.kind, launch_name)):
            topic = entry.remap.get(port.name, port.name)
            senders, receivers = ends.setdefault((topic, port.type), ([], []))
            (senders if port.role in SENDS else receivers).append(name)
    flows = [
        Flow(topic, kind, tuple(senders), tuple(receivers))
        for (topic, kind), (senders, receivers) in ends.items()
        if topic not in IGNORED and any(a != b for a in senders for b in receivers)
    ]
    used = {node for flow in flows for node in (*flow.senders, *flow.receivers)}
    return {name: kind for name, kind in nodes.items() if name in used}, flows


def column_order(nodes: Iterable[str], flows: Sequence[Flow]) -> list[str]:
    """Return the order of nodes with the fewest backward arrows that exchanging neighbours finds."""
    last = [node for node in nodes if node in OPERATOR]
    order = [node for node in nodes if node not in OPERATOR]
    flows = [
        flow._replace(senders=_without(flow.senders, last), receivers=_without(flow.receivers, last))
        for flow in flows
    ]

    def cost(candidate: Sequence[str]) -> int:
        place = {node: index for index, node in enumerate(candidate)}
        pairs = [(place[a], place[b]) for f in flows for a in f.senders for b in f.receivers if a != b]
        return sum(1000 * (a > b) + abs(a - b) for a, b in pairs)

    improved = True
    while improved:
        improved = False
        for a, b in permutations(range(len(order)), 2):
            candidate = order.copy()
            candidate.insert(b, candidate.pop(a))
            if cost(candidate) < cost(order):
                order, improved = candidate, True
    return order + last


def _without(nodes: tuple[str, ...], left_out: list[str]) -> tuple[str, ...]:
    return tuple(node for node in nodes if node not in left_out)


def draw(launch_name: str) -> str:
    """Return the figure of a launch as SVG text."""
    nodes, flows = flows_of(launch_name)
    order = column_order(nodes, flows)
    place = {node: index for index, node in enumerate(order)}
    flows = sorted(flows, key=lambda f: (min(place[node] for node in f.senders), f.is_action, f.name))
    width, height = LEFT + COLUMN * len(order) + 80, TOP + ROW * len(flows) + 20
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="12">',
        _markers(),
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    parts += [_column(node, nodes[node], x_of(place[node]), height) for node in order]
    for index, flow in enumerate(flows):
        parts.append(_row(flow, TOP + ROW * index + ROW / 2, place, index % 2 == 0, width))
    return "\n".join([*parts, "</svg>", ""])


def x_of(index: int) -> float:
    """Return the middle of a column, px."""
    return LEFT + COLUMN * (index + 0.5)


def _markers() -> str:
    shape = (
        '<marker id="{0}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
    )
    shape += '<path d="M0 0 L8 4 L0 8 z" fill="{1}"/></marker>'
    colours = {"forward": FORWARD, "backward": BACKWARD, "action": ACTION}
    return "<defs>" + "".join(shape.format(name, colour) for name, colour in colours.items()) + "</defs>"


def _column(node: str, kind: str, x: float, height: float) -> str:
    module = kind.partition(":")[0].removeprefix("chefbot.")
    device = not module.startswith("nodes.")
    fill = "#eef4ee" if device else "#eaf1fd"
    box = 14 + CHARACTER * len(node)
    return (
        f'<line x1="{x}" y1="{TOP - 6}" x2="{x}" y2="{height - 14}" stroke="#c9d1d9" stroke-width="1.5"/>'
        f'<g transform="translate({x} {TOP - 10}) rotate(-40)">'
        f'<rect x="-6" y="-13" width="{box}" height="20" rx="4" fill="{fill}" stroke="#8c959f"/>'
        f'<text x="1" y="1" font-weight="bold">{escape(node)}</text></g>'
    )


def _row(flow: Flow, y: float, place: dict[str, int], shaded: bool, width: float) -> str:
    parts = (
        [f'<rect x="0" y="{y - ROW / 2}" width="{width}" height="{ROW}" fill="#f6f8fa" fill-opacity="0.6"/>']
        if shaded
        else []
    )
    kind = flow.type.replace("/msg/", "/").replace("/action/", "/")
    parts.append(
        f'<text x="10" y="{y + 4}">{escape(flow.name)} '
        f'<tspan fill="#6e7781" font-size="10">{escape(kind)}</tspan></text>'
    )
    for sender in flow.senders:
        targets = [x_of(place[node]) for node in flow.receivers if node != sender]
        parts += [_arrow(x_of(place[sender]), target, y, flow.is_action) for target in targets]
        parts.append(f'<circle cx="{x_of(place[sender])}" cy="{y}" r="4" fill="#24292f"/>')
    return "".join(parts)


def _arrow(start: float, end: float, y: float, is_action: bool) -> str:
    name = "action" if is_action else "forward" if end > start else "backward"
    colour = {"forward": FORWARD, "backward": BACKWARD, "action": ACTION}[name]
    dash = ' stroke-dasharray="5 3"' if is_action else ""
    style = f'stroke="{colour}" stroke-width="1.6"{dash} marker-end="url(#{name})"'
    return f'<line x1="{start}" y1="{y}" x2="{end}" y2="{y}" {style}/>'


def write_data_flow(path: Path, launch_name: str) -> None:
    """Write the figure of a launch."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(draw(launch_name))


if __name__ == "__main__":
    write_data_flow(Path(sys.argv[2]), sys.argv[1])
