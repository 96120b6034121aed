"""A directed graph in layers, from left to right (Sugiyama, Tagawa, Toda 1981): where its boxes and lines go."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

SWEEPS = 12
GAP_X, GAP_Y = 42.0, 22.0
DUMMY_HEIGHT = 4.0

Edge = tuple[str, str]


class Box(NamedTuple):
    """Left, top, width, height; px, y down."""

    x: float
    y: float
    width: float
    height: float


class Layout(NamedTuple):
    """Boxes by name, and for each edge the points that its line passes, from its tail to its head."""

    boxes: dict[str, Box]
    lines: dict[Edge, list[tuple[float, float]]]
    width: float
    height: float


def lay_out(sizes: Mapping[str, tuple[float, float]], edges: Sequence[Edge]) -> Layout:
    """`sizes` are (width, height) by name; edges join names, no edge joins a name to itself.

    What is not joined stands apart: one under the other, it would push each other away for ever.
    """
    boxes: dict[str, Box] = {}
    lines: dict[Edge, list[tuple[float, float]]] = {}
    width = top = 0.0
    for part in _parts(sizes, edges):
        names = set(part)
        shown = _lay_out({name: sizes[name] for name in part}, [edge for edge in edges if edge[0] in names])
        boxes |= {name: box._replace(y=box.y + top) for name, box in shown.boxes.items()}
        lines |= {edge: [(x, y + top) for x, y in points] for edge, points in shown.lines.items()}
        width, top = max(width, shown.width), top + shown.height + GAP_X
    return Layout(boxes, lines, width, max(0.0, top - GAP_X))


def _parts(names: Iterable[str], edges: Sequence[Edge]) -> list[list[str]]:
    """Names that are joined, by whatever way; the largest part first."""
    near = _neighbours([*edges, *((b, a) for a, b in edges)])[1]
    left, parts = dict.fromkeys(names), list[list[str]]()
    while left:
        part = [next(iter(left))]
        del left[part[0]]
        for name in part:  # grows on the way
            found = [one for one in dict.fromkeys(near.get(name, [])) if one in left]
            part += found
            for one in found:
                del left[one]
        parts.append(part)
    return sorted(parts, key=len, reverse=True)


def _lay_out(sizes: Mapping[str, tuple[float, float]], edges: Sequence[Edge]) -> Layout:
    """Of what is joined."""
    backward = _backward(sizes, edges)
    forward = [(b, a) if (a, b) in backward else (a, b) for a, b in edges]
    layer_of = _layer(sizes, forward)
    layers, chains = _with_dummies(layer_of, list(dict.fromkeys(forward)))
    below = [edge for chain in chains.values() for edge in itertools.pairwise(chain)]
    _order(layers, below)
    heights = {name: sizes[name][1] if name in sizes else DUMMY_HEIGHT for layer in layers for name in layer}
    centres = _centres(layers, below, heights)
    lefts, width = _columns(layers, sizes)
    boxes = {
        name: Box(lefts[layer_of[name]], centres[name] - size[1] / 2, *size) for name, size in sizes.items()
    }
    lines = {}
    for edge in edges:
        chain = chains[edge[::-1] if edge in backward else edge]
        points = _points(chain, boxes, centres, lefts, layer_of)
        lines[edge] = points[::-1] if edge in backward else points
    return Layout(boxes, lines, width, max((box.y + box.height for box in boxes.values()), default=0.0))


def _backward(names: Iterable[str], edges: Sequence[Edge]) -> set[Edge]:
    """Few edges without which no cycle is left (Eades, Lin, Smyth 1993: sources first, sinks last)."""
    left, order, end = dict.fromkeys(names), list[str](), list[str]()
    while left:
        out = dict.fromkeys(left, 0)
        into = dict.fromkeys(left, 0)
        for a, b in edges:
            if a in left and b in left:
                out[a] += 1
                into[b] += 1
        sink = next((name for name in left if not out[name]), None)
        source = next((name for name in left if not into[name]), None)
        best = source or sink or max(left, key=lambda name: out[name] - into[name])
        (end if source is None and sink is not None else order).append(best)
        del left[best]
    rank = {name: index for index, name in enumerate([*order, *reversed(end)])}
    return {(a, b) for a, b in edges if rank[a] > rank[b]}


def _layer(names: Iterable[str], edges: Sequence[Edge]) -> dict[str, int]:
    """The longest way from a source; then sources as far to the right as their heads allow."""
    heads: dict[str, list[str]] = {name: [] for name in names}
    waiting = dict.fromkeys(heads, 0)
    for a, b in edges:
        heads[a].append(b)
        waiting[b] += 1
    layer = dict.fromkeys(heads, 0)
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
    """Names by layer, and each edge as a chain of names that pass one layer at a time."""
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


def _order(layers: list[list[str]], edges: list[Edge]) -> None:
    """Each layer by the mean place of its neighbours, forth and back; the order with fewest crossings stays."""
    tails, heads = _neighbours(edges)
    best, fewest = [list(layer) for layer in layers], _crossings(layers, heads)
    for sweep in range(SWEEPS):
        near, walk = (
            (tails, range(1, len(layers))) if sweep % 2 == 0 else (heads, range(len(layers) - 2, -1, -1))
        )
        for index in walk:
            other = layers[index - 1 if sweep % 2 == 0 else index + 1]
            place = {name: number for number, name in enumerate(other)}
            own = {name: number for number, name in enumerate(layers[index])}
            layers[index].sort(key=lambda name: _mean([place[one] for one in near.get(name, [])], own[name]))
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
    """Heights of the middles: each drawn to its neighbours, none over another."""
    tails, heads = _neighbours(edges)
    centre: dict[str, float] = {}
    for layer in layers:
        y = 0.0
        for name in layer:
            centre[name] = y + heights[name] / 2
            y += heights[name] + GAP_Y
    for sweep in range(2 * SWEEPS):
        for layer in layers if sweep % 2 == 0 else layers[::-1]:
            near = tails if sweep % 2 == 0 else heads
            wanted = {
                name: _middle([centre[one] for one in near.get(name, [])], centre[name]) for name in layer
            }
            _spread(layer, wanted, heights, centre)
    top = min((centre[name] - heights[name] / 2 for name in centre), default=0.0)
    return {name: y - top for name, y in centre.items()}


def _middle(values: list[float], default: float) -> float:
    return sum(values) / len(values) if values else default


def _spread(
    layer: list[str], wanted: Mapping[str, float], heights: Mapping[str, float], centre: dict[str, float]
) -> None:
    """Pushed down from above, then up from below, and the mean of both: no overlap, near to what is wanted."""
    down: list[float] = []
    up: list[float] = []
    for names, found, sign in ((layer, down, 1.0), (layer[::-1], up, -1.0)):
        last, half = None, 0.0
        for name in names:
            y = wanted[name] * sign
            least = y if last is None else last + half + heights[name] / 2 + GAP_Y
            last, half = max(y, least), heights[name] / 2
            found.append(last * sign)
    for name, a, b in zip(layer, down, up[::-1], strict=True):
        centre[name] = (a + b) / 2


def _columns(layers: list[list[str]], sizes: Mapping[str, tuple[float, float]]) -> tuple[list[float], float]:
    """Left edge of each layer, and the whole width."""
    lefts, x = [], 0.0
    for layer in layers:
        lefts.append(x)
        x += max((sizes[name][0] for name in layer if name in sizes), default=0.0) + GAP_X
    return [*lefts, x], max(0.0, x - GAP_X)


def _points(
    chain: list[str],
    boxes: Mapping[str, Box],
    centres: Mapping[str, float],
    lefts: Sequence[float],
    layer_of: Mapping[str, int],
) -> list[tuple[float, float]]:
    """Right edge of the first box, both sides of each layer passed, left edge of the last."""
    first = boxes[chain[0]]
    points = [(first.x + first.width, centres[chain[0]])]
    for layer, name in enumerate(chain[1:-1], layer_of[chain[0]] + 1):
        points += [(lefts[layer], centres[name]), (lefts[layer + 1] - GAP_X, centres[name])]
    return [*points, (boxes[chain[-1]].x, centres[chain[-1]])]
