"""Layered layout of a directed graph, from left to right (Sugiyama, Tagawa, Toda 1981)."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

SWEEPS = 12
GAP_X, GAP_Y = 42.0, 22.0
DUMMY_HEIGHT = 4.0

Edge = tuple[str, str]


class LayoutBox(NamedTuple):
    """A rectangle: left, top, width and height in px, y down."""

    x: float
    y: float
    width: float
    height: float


class Layout(NamedTuple):
    """Boxes by name, and polylines by edge from tail to head, in px."""

    boxes: dict[str, LayoutBox]
    lines: dict[Edge, list[tuple[float, float]]]
    width: float
    height: float


def lay_out(sizes: Mapping[str, tuple[float, float]], edges: Sequence[Edge]) -> Layout:
    """Lay out the boxes and edges of a graph.

    `sizes` are (width, height) in px by name; edges join names, and none joins a name to itself. Connected
    components are stacked vertically: in one layout they would push each other apart without end.
    """
    boxes: dict[str, LayoutBox] = {}
    lines: dict[Edge, list[tuple[float, float]]] = {}
    width = top = 0.0
    for part in _components(sizes, edges):
        names = set(part)
        shown = _lay_out_component(
            {name: sizes[name] for name in part}, [edge for edge in edges if edge[0] in names]
        )
        boxes |= {name: box._replace(y=box.y + top) for name, box in shown.boxes.items()}
        lines |= {edge: [(x, y + top) for x, y in points] for edge, points in shown.lines.items()}
        width, top = max(width, shown.width), top + shown.height + GAP_X
    return Layout(boxes, lines, width, max(0.0, top - GAP_X))


def _components(names: Iterable[str], edges: Sequence[Edge]) -> list[list[str]]:
    """Return the connected components, the largest first."""
    neighbours = _neighbours([*edges, *((b, a) for a, b in edges)])[1]
    remaining, parts = dict.fromkeys(names), list[list[str]]()
    while remaining:
        part = [next(iter(remaining))]
        del remaining[part[0]]
        for name in part:  # breadth-first search: the list grows while it is iterated
            found = [other for other in dict.fromkeys(neighbours.get(name, [])) if other in remaining]
            part += found
            for other in found:
                del remaining[other]
        parts.append(part)
    return sorted(parts, key=len, reverse=True)


def _lay_out_component(sizes: Mapping[str, tuple[float, float]], edges: Sequence[Edge]) -> Layout:
    """Lay out one connected component."""
    # 1. Make the graph acyclic by reversing some edges
    backward = _feedback_edges(sizes, edges)
    forward = [(b, a) if (a, b) in backward else (a, b) for a, b in edges]
    # 2. Assign layers, and split long edges with dummy nodes
    layer_of = _assign_layers(sizes, forward)
    layers, chains = _with_dummies(layer_of, list(dict.fromkeys(forward)))
    below = [edge for chain in chains.values() for edge in itertools.pairwise(chain)]
    # 3. Order the nodes within layers to reduce crossings
    _order_layers(layers, below)
    heights = {name: sizes[name][1] if name in sizes else DUMMY_HEIGHT for layer in layers for name in layer}
    # 4. Assign coordinates
    centres = _centres(layers, below, heights)
    lefts, width = _columns(layers, sizes)
    boxes = {
        name: LayoutBox(lefts[layer_of[name]], centres[name] - size[1] / 2, *size)
        for name, size in sizes.items()
    }
    lines = {}
    for edge in edges:
        chain = chains[edge[::-1] if edge in backward else edge]
        points = _points(chain, boxes, centres, lefts, layer_of)
        lines[edge] = points[::-1] if edge in backward else points
    return Layout(boxes, lines, width, max((box.y + box.height for box in boxes.values()), default=0.0))


def _feedback_edges(names: Iterable[str], edges: Sequence[Edge]) -> set[Edge]:
    """Return a small set of edges whose removal breaks all cycles (Eades, Lin, Smyth 1993)."""
    remaining, order, sinks = dict.fromkeys(names), list[str](), list[str]()
    while remaining:
        out_degree = dict.fromkeys(remaining, 0)
        in_degree = dict.fromkeys(remaining, 0)
        for a, b in edges:
            if a in remaining and b in remaining:
                out_degree[a] += 1
                in_degree[b] += 1
        sink = next((name for name in remaining if not out_degree[name]), None)
        source = next((name for name in remaining if not in_degree[name]), None)
        # Remove a source or a sink, else the node of maximum out-degree minus in-degree
        best = source or sink or max(remaining, key=lambda name: out_degree[name] - in_degree[name])
        (sinks if source is None and sink is not None else order).append(best)
        del remaining[best]
    rank = {name: index for index, name in enumerate([*order, *reversed(sinks)])}
    return {(a, b) for a, b in edges if rank[a] > rank[b]}


def _assign_layers(names: Iterable[str], edges: Sequence[Edge]) -> dict[str, int]:
    """Assign layers by the longest path from a source, then move sources right next to their successors."""
    heads: dict[str, list[str]] = {name: [] for name in names}
    waiting = dict.fromkeys(heads, 0)
    for a, b in edges:
        heads[a].append(b)
        waiting[b] += 1
    layer = dict.fromkeys(heads, 0)
    # Longest-path layering in topological order
    ready = [name for name, count in waiting.items() if not count]
    sources = list(ready)
    for name in ready:
        for head in heads[name]:
            layer[head] = max(layer[head], layer[name] + 1)
            waiting[head] -= 1
            if not waiting[head]:
                ready.append(head)
    for name in sources:
        if heads[name]:
            layer[name] = min(layer[head] for head in heads[name]) - 1
    return layer


def _with_dummies(
    layer_of: Mapping[str, int], edges: Sequence[Edge]
) -> tuple[list[list[str]], dict[Edge, list[str]]]:
    """Return the names by layer, and each edge as a chain of names with dummy nodes in the layers between."""
    layers: list[list[str]] = [[] for _ in range(max(layer_of.values(), default=-1) + 1)]
    for name, layer in layer_of.items():
        layers[layer].append(name)
    chains = {}
    for a, b in edges:
        chain = [a]
        for layer in range(layer_of[a] + 1, layer_of[b]):
            chain.append(f"{a}\n{b}\n{layer}")
            layers[layer].append(chain[-1])
        chains[a, b] = [*chain, b]
    return layers, chains


def _neighbours(edges: Iterable[Edge]) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    tails: dict[str, list[str]] = {}
    heads: dict[str, list[str]] = {}
    for a, b in edges:
        heads.setdefault(a, []).append(b)
        tails.setdefault(b, []).append(a)
    return tails, heads


def _order_layers(layers: list[list[str]], edges: list[Edge]) -> None:
    """Order each layer by the barycenter of its neighbours, sweeping right and left alternately.

    The order with the fewest crossings is kept.
    """
    tails, heads = _neighbours(edges)
    best, fewest = [list(layer) for layer in layers], _crossings(layers, heads)
    for sweep in range(SWEEPS):
        neighbours, indices = (
            (tails, range(1, len(layers))) if sweep % 2 == 0 else (heads, range(len(layers) - 2, -1, -1))
        )
        for index in indices:
            other = layers[index - 1 if sweep % 2 == 0 else index + 1]
            place = {name: number for number, name in enumerate(other)}
            own = {name: number for number, name in enumerate(layers[index])}
            layers[index].sort(
                key=lambda name: _mean([place[other] for other in neighbours.get(name, [])], own[name])
            )
        if (crossings := _crossings(layers, heads)) < fewest:
            best, fewest = [list(layer) for layer in layers], crossings
    layers[:] = best


def _mean(values: list[int], default: float) -> float:
    return sum(values) / len(values) if values else default


def _crossings(layers: list[list[str]], heads: Mapping[str, list[str]]) -> int:
    count = 0
    for left, right in itertools.pairwise(layers):
        place = {name: number for number, name in enumerate(right)}
        ends = [place[head] for name in left for head in sorted(heads.get(name, []), key=place.__getitem__)]
        count += sum(a > b for index, a in enumerate(ends) for b in ends[index + 1 :])
    return count


def _centres(layers: list[list[str]], edges: list[Edge], heights: Mapping[str, float]) -> dict[str, float]:
    """Return the vertical centres of the nodes: each close to the mean of its neighbours, without overlap."""
    tails, heads = _neighbours(edges)
    centre: dict[str, float] = {}
    for layer in layers:
        y = 0.0
        for name in layer:
            centre[name] = y + heights[name] / 2
            y += heights[name] + GAP_Y
    for sweep in range(2 * SWEEPS):
        for layer in layers if sweep % 2 == 0 else layers[::-1]:
            neighbours = tails if sweep % 2 == 0 else heads
            desired = {
                name: _middle([centre[other] for other in neighbours.get(name, [])], centre[name])
                for name in layer
            }
            _spread(layer, desired, heights, centre)
    top = min((centre[name] - heights[name] / 2 for name in centre), default=0.0)
    return {name: y - top for name, y in centre.items()}


def _middle(values: list[float], default: float) -> float:
    return sum(values) / len(values) if values else default


def _spread(
    layer: list[str], desired: Mapping[str, float], heights: Mapping[str, float], centre: dict[str, float]
) -> None:
    """Set the centres of a layer near to the desired ones, without overlap.

    The mean of a pass from the top down and one from the bottom up is used.
    """
    down: list[float] = []
    up: list[float] = []
    for names, found, sign in ((layer, down, 1.0), (layer[::-1], up, -1.0)):
        last, half = None, 0.0
        for name in names:
            y = desired[name] * sign
            min_y = y if last is None else last + half + heights[name] / 2 + GAP_Y
            last, half = max(y, min_y), heights[name] / 2
            found.append(last * sign)
    for name, a, b in zip(layer, down, up[::-1], strict=True):
        centre[name] = (a + b) / 2


def _columns(layers: list[list[str]], sizes: Mapping[str, tuple[float, float]]) -> tuple[list[float], float]:
    """Return the left edge of each layer, and the total width."""
    lefts, x = [], 0.0
    for layer in layers:
        lefts.append(x)
        x += max((sizes[name][0] for name in layer if name in sizes), default=0.0) + GAP_X
    return [*lefts, x], max(0.0, x - GAP_X)


def _points(
    chain: list[str],
    boxes: Mapping[str, LayoutBox],
    centres: Mapping[str, float],
    lefts: Sequence[float],
    layer_of: Mapping[str, int],
) -> list[tuple[float, float]]:
    """Return the points of an edge.

    They are the right edge of the first box, both sides of each layer passed, and the left edge of the last
    box.
    """
    first = boxes[chain[0]]
    points = [(first.x + first.width, centres[chain[0]])]
    for layer, name in enumerate(chain[1:-1], layer_of[chain[0]] + 1):
        points += [(lefts[layer], centres[name]), (lefts[layer + 1] - GAP_X, centres[name])]
    return [*points, (boxes[chain[-1]].x, centres[chain[-1]])]
