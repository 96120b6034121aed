"""SVG drawing of a graph: nodes blue, topics white, actions violet, backward edges orange."""

from __future__ import annotations

import itertools
from html import escape
from typing import Any

from chefbot.ros2.tools.graph_layout import Edge, Layout, LayoutBox, lay_out

FONT, SMALL, LINE = 13.0, 11.0, 15.0
CHARACTER = 0.6
"""Mean character width in font sizes; slightly more than that of sans-serif fonts."""
PAD, MARGIN = 9.0, 24.0
INTO = "\N{LEFTWARDS ARROW}"
BACK_SHIFT = 9.0
"""Horizontal offset of backward edges, which are drawn beside the forward ones, px."""
NODE, TOPIC, ACTION = "node", "topic", "action"
STYLE = """
text{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;fill:#1d2733}
.name{font-size:13px}.small{font-size:11px;fill:#5b6773}.bold{font-weight:bold}
.node{fill:#dfeaf7;stroke:#3b6fb5;stroke-width:1.5}.topic{fill:#fff;stroke:#9aa5b1}.action{fill:#efe6f8;stroke:#7d55a8}
.line{fill:none;stroke:#6b7785;stroke-width:1.3}.back{stroke:#c9741c}
.head{fill:#6b7785}.headback{fill:#c9741c}.wrong{font-size:12px;fill:#b3261e}
"""
Texts = dict[str, list[str]]


def to_svg(graph: dict[str, Any]) -> str:
    """Return an SVG picture of the graph that `chefbot graph --json` prints."""
    kinds, texts, edges = _parts(graph)
    sizes = {name: _size(lines) for name, lines in texts.items()}
    layout = _with_isolated(sizes, edges)
    mismatches = graph["mismatches"]
    width = (
        max(layout.width, *(CHARACTER * 12 * len(sentence) for sentence in mismatches), 200.0) + 2 * MARGIN
    )
    height = layout.height + 2 * MARGIN + LINE * (len(mismatches) + 1)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="{-MARGIN:.0f} {-MARGIN:.0f} {width:.0f} {height:.0f}">',
        f"<style>{STYLE}</style><defs>{_arrow('head')}{_arrow('headback')}</defs>",
        f'<rect x="{-MARGIN}" y="{-MARGIN}" width="100%" height="100%" fill="#fff"/>',
        *(_line(points) for points in layout.lines.values()),
        *(_box(kinds[name], layout.boxes[name], texts[name]) for name in texts),
        *(
            f'<text class="wrong" x="0" y="{layout.height + LINE * (number + 2):.0f}">! {escape(sentence)}</text>'
            for number, sentence in enumerate(mismatches)
        ),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _with_isolated(sizes: dict[str, tuple[float, float]], edges: list[Edge]) -> Layout:
    """Lay out the graph, with unconnected nodes in a row at the bottom."""
    joined = {name for edge in edges for name in edge}
    shown = _transposed(lay_out({name: sizes[name][::-1] for name in sizes if name in joined}, edges))
    boxes, x, y = dict(shown.boxes), 0.0, shown.height + (MARGIN if joined else 0.0)
    for name, (width, height) in sizes.items():
        if name not in joined:
            boxes[name] = LayoutBox(x, y, width, height)
            x += width + MARGIN
    bottom = max((box.y + box.height for box in boxes.values()), default=0.0)
    return Layout(boxes, shown.lines, max(shown.width, x), bottom)


def _transposed(layout: Layout) -> Layout:
    """Transpose the layout so that layers go downward.

    Boxes are wide and flat; side by side they would form a long strip.
    """
    boxes = {name: LayoutBox(box.y, box.x, box.height, box.width) for name, box in layout.boxes.items()}
    lines = {edge: [(y, x) for x, y in points] for edge, points in layout.lines.items()}
    return Layout(boxes, lines, layout.height, layout.width)


def _parts(graph: dict[str, Any]) -> tuple[dict[str, str], Texts, list[Edge]]:
    """Return kinds, text lines and edges.

    A topic with endpoints on one side only is listed in the box of its node.
    """
    kinds: dict[str, str] = {}
    texts: Texts = {}
    edges: dict[Edge, None] = {}
    for name in graph["nodes"]:
        kinds[name], texts[name] = NODE, [name]
    for topic in graph["topics"]:
        publishers, subscribers = topic["publishers"], topic["subscriptions"]
        if not subscribers or subscribers == publishers:
            for publisher in publishers:
                texts[publisher].append(f"{topic['name']}{_dot(_rate(topic))}")
            continue
        if not publishers and len(subscribers) == 1:
            texts[subscribers[0]].append(f"{INTO} {topic['name']}")
            continue
        key = f"topic {topic['name']}"
        kinds[key], texts[key] = TOPIC, [topic["name"], f"{_short(topic['types'])}{_dot(_rate(topic))}"]
        _join(edges, publishers, key, subscribers)
    for action in graph["actions"]:
        key = f"action {action['name']}"
        if action["servers"] and action["clients"]:
            kinds[key], texts[key] = ACTION, [action["name"], _short(action["types"])]
            _join(edges, action["clients"], key, action["servers"])
        else:
            for server in action["servers"]:
                texts[server].append(f"{action['name']} (action)")
    return kinds, texts, list(edges)


def _join(edges: dict[Edge, None], tails: list[str], middle: str, heads: list[str]) -> None:
    edges.update(dict.fromkeys((tail, middle) for tail in tails))
    edges.update(dict.fromkeys((middle, head) for head in heads))


def _rate(topic: dict[str, Any]) -> str:
    count, hz = topic.get("messages"), topic.get("hz", 0.0)
    if count is None:
        return ""
    if topic["latched"] and count <= len(topic["publishers"]):
        return "latched"
    if not count:
        return "silent"
    return f"{hz:.3g} Hz" if hz else "once"


def _dot(text: str) -> str:
    return f" \N{MIDDLE DOT} {text}" if text else ""


def _short(types: list[str]) -> str:
    return ", ".join(name.replace("/msg/", "/").replace("/action/", "/") for name in types)


def _size(lines: list[str]) -> tuple[float, float]:
    widths = [CHARACTER * FONT * len(lines[0]), *(CHARACTER * SMALL * 0.95 * len(line) for line in lines[1:])]
    return max(widths) + 2 * PAD, LINE * len(lines) + PAD


def _box(kind: str, box: LayoutBox, lines: list[str]) -> str:
    round_off = 10 if kind == NODE else 2
    text = [
        f'<rect class="{kind}" x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" '
        f'rx="{round_off}"/>'
    ]
    for number, line in enumerate(lines):
        style = "small" if number else f"name{' bold' if kind == NODE else ''}"
        y = box.y + PAD / 2 + LINE * (number + 0.78)
        text.append(
            f'<text class="{style}" x="{box.x + box.width / 2:.1f}" y="{y:.1f}" text-anchor="middle">'
            f"{escape(line)}</text>"
        )
    return "".join(text)


def _line(points: list[tuple[float, float]]) -> str:
    """Draw an edge that is vertical where it meets boxes and curved between them."""
    back = points[0][1] > points[-1][1]
    points = [(x + BACK_SHIFT * back, y) for x, y in points]
    path = f"M{points[0][0]:.1f},{points[0][1]:.1f}"
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        middle = (y0 + y1) / 2
        path += f"C{x0:.1f},{middle:.1f} {x1:.1f},{middle:.1f} {x1:.1f},{y1:.1f}"
    style, head = ("line back", "headback") if back else ("line", "head")
    return f'<path class="{style}" d="{path}" marker-end="url(#{head})"/>'


def _arrow(name: str) -> str:
    return (
        f'<marker id="{name}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" '
        f'orient="auto"><path class="{name}" d="M0,1L10,5L0,9z"/></marker>'
    )
