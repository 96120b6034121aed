"""A graph in DOT, the language of Graphviz: nodes blue, topics white, actions violet."""

from __future__ import annotations

from typing import Any

STYLE = """\
  graph [fontname="Helvetica", fontcolor="#b3261e"]
  node [fontname="Helvetica", fontsize=11, shape=box, style="rounded,filled"]
  edge [color="#6b7785"]"""
NODE = 'fillcolor="#dfeaf7", color="#3b6fb5"'
TOPIC = 'fillcolor="#ffffff", color="#9aa5b1", style=filled'
ACTION = 'fillcolor="#efe6f8", color="#7d55a8", style=filled'


def to_dot(graph: dict[str, Any]) -> str:
    """Return the graph that `chefbot node graph --json` prints as DOT text.

    A topic or action with endpoints on one side only is listed in the box of its node.
    """
    labels = {name: [name] for name in graph["nodes"]}
    statements: list[str] = []
    for topic in graph["topics"]:
        publishers, subscribers = topic["publishers"], topic["subscriptions"]
        if not subscribers or subscribers == publishers:
            for name in publishers:
                labels[name].append(" · ".join([topic["name"], *_rate(topic)]))
        elif not publishers and len(subscribers) == 1:
            labels[subscribers[0]].append(f"← {topic['name']}")
        else:
            label = [topic["name"], " · ".join([_types(topic), *_rate(topic)])]
            statements += _joined(f"topic {topic['name']}", label, TOPIC, publishers, subscribers)
    for action in graph["actions"]:
        if action["servers"] and action["clients"]:
            label = [action["name"], _types(action)]
            statements += _joined(
                f"action {action['name']}", label, ACTION, action["clients"], action["servers"]
            )
        else:
            for name in action["servers"]:
                labels[name].append(f"{action['name']} (action)")
    boxes = [_box(name, label, NODE) for name, label in labels.items()]
    mismatches = _quoted(*(f"! {sentence}" for sentence in graph["mismatches"]))
    return "\n".join(["digraph {", STYLE, f"  label={mismatches}", *boxes, *statements, "}"]) + "\n"


def _joined(key: str, label: list[str], style: str, tails: list[str], heads: list[str]) -> list[str]:
    """Return a box with the edges to it and from it."""
    edges = [(tail, key) for tail in tails] + [(key, head) for head in heads]
    return [_box(key, label, style), *(f"  {_quoted(tail)} -> {_quoted(head)}" for tail, head in edges)]


def _box(key: str, label: list[str], style: str) -> str:
    return f"  {_quoted(key)} [label={_quoted(*label)}, {style}]"


def _quoted(*lines: str) -> str:
    escaped = (line.replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return '"' + "\\n".join(escaped) + '"'


def _rate(topic: dict[str, Any]) -> list[str]:
    count, hz = topic.get("messages"), topic.get("hz", 0.0)
    if count is None:
        return []
    if topic["latched"] and count <= len(topic["publishers"]):
        return ["latched"]
    if not count:
        return ["silent"]
    return [f"{hz:.3g} Hz" if hz else "once"]


def _types(interface: dict[str, Any]) -> str:
    return ", ".join(name.replace("/msg/", "/").replace("/action/", "/") for name in interface["types"])
