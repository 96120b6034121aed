"""`chefbot topic echo` and `hz`: what is said, and how often."""

from __future__ import annotations

import re
import statistics
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from chefbot.commands.tools.common import SHOWN, console, errors, find, on_wire, stopping, to_yaml
from chefbot.commands.tools.foreign import definition_of
from chefbot.commands.tools.listen import Ear, Heard, why_silent
from chefbot.errors import UserError, nearest
from chefbot.msgs.base import Message
from chefbot.msgs.cdr import CdrError
from chefbot.msgs.plain import to_plain
from chefbot.wire.names import WireType
from chefbot.wire.node import WireNode
from chefbot.wire.offers import types_said

Show = Callable[[Heard], str]
_STEP = re.compile(r"([A-Za-z_]\w*)|\[?(\d+)\]?")
PREFIXES = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"), (1.0, "B"))


class Rate(NamedTuple):
    """What was measured of a topic. Intervals in seconds."""

    messages: int
    hz: float
    """0 with less than two messages."""
    shortest: float
    longest: float
    deviation: float
    bytes_per_second: float


def run_echo(topic: str, once: bool, field: str, whole: bool, seconds: float) -> int:
    """Messages as YAML documents. Exit code: 1 if `once` ended without a message."""
    with on_wire("echo") as node, stopping() as stop:
        named = find(node.wire.graph.topics(), topic, "topic")
        show = shower(node, topic, types_said(named), field, None if whole else SHOWN)
        ear = Ear(node, named)
        for heard in ear.samples(seconds or None, stop):
            console.print(show(heard))
            if once:
                return 0
            console.print("---")
    return 1 if once else 0


def run_hz(topic: str, seconds: float) -> int:
    """Rate, intervals and bandwidth. Exit code: 1 if nothing came."""
    with on_wire("hz") as node, stopping() as stop:
        named = find(node.wire.graph.topics(), topic, "topic")
        ear, heard = Ear(node, named), list[Heard]()
        for one in ear.samples(seconds or None, stop):
            heard.append(one)
            if seconds == 0 and len(heard) > 1 and heard[-1].at - heard[0].at >= 1.0:
                console.print(rate_line(named.name, measure(heard)))
                heard = [one]
        if seconds == 0:
            return 0
        console.print(rate_line(named.name, measure(heard)))
        if not heard and seconds <= 2.0:
            for sentence in why_silent(node.wire.graph, named.name):
                errors.print(f"chefbot: {sentence}")
    return 0 if heard else 1


def measure(heard: list[Heard]) -> Rate:
    """Of samples in the order in which they came."""
    gaps = [b.at - a.at for a, b in pairwise(heard)]
    span = sum(gaps)
    if span <= 0:
        return Rate(len(heard), 0.0, 0.0, 0.0, 0.0, 0.0)
    size = sum(len(one.data) for one in heard[1:])
    return Rate(len(heard), len(gaps) / span, min(gaps), max(gaps), statistics.pstdev(gaps), size / span)


def rate_line(topic: str, rate: Rate) -> str:
    """For people."""
    if rate.hz == 0.0:
        return f"{topic}: {('no message', 'one message, which makes no rate')[min(rate.messages, 1)]}"
    return (
        f"{topic}: {rate.hz:.2f} Hz, every {1e3 * rate.shortest:.1f} to {1e3 * rate.longest:.1f} ms "
        f"(std {1e3 * rate.deviation:.2f} ms), {quantity(rate.bytes_per_second)}/s, {rate.messages} messages"
    )


def quantity(size: float) -> str:
    """'12.3 kB'"""
    factor, unit = next((one for one in PREFIXES if size >= one[0]), PREFIXES[-1])
    return f"{size / factor:.1f} {unit}"


def shower(node: WireNode, topic: str, kinds: list[WireType], field: str, longest: int | None) -> Show:
    """From bytes to text. UserError when a type is unknown, or none of them has the field."""
    known = {kind: definition_of(node, kind, f"topic {topic}") for kind in kinds}

    def show(heard: Heard) -> str:
        try:
            message = known[heard.kind].from_cdr(heard.data)
        except CdrError as error:
            return f"# refused: {error}"
        value = _pick(message, field) if field else message
        plain = to_plain(value, longest) if isinstance(value, Message) else _plain_part(value, longest)
        return to_yaml(plain)

    for kind in known.values():
        if field:
            _pick(kind(), field)
    return show


def _pick(message: Message, path: str) -> Any:
    """Of 'pose.pose.position.x' or 'ranges[0]'."""
    value: Any = message
    for name, index in _steps(path):
        if name:
            if not isinstance(value, Message) or name not in value.__struct_fields__:
                names = value.__struct_fields__ if isinstance(value, Message) else ()
                raise UserError(f"--field {path}: there is no {name}{nearest(name, names)}")
            value = getattr(value, name)
        else:
            value = value[index] if index < len(value) else None
            if value is None:
                return None
    return value


def _steps(path: str) -> Iterator[tuple[str, int]]:
    for part in path.replace("[", ".").split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            raise UserError(
                f"--field {path}: write names and numbers with dots, as pose.position.x or ranges[0]"
            )
        yield match[1] or "", int(match[2] or 0)


def _plain_part(value: Any, longest: int | None) -> Any:
    """Of what is no message: a number, a text, or a list of either or of messages."""
    if isinstance(value, tuple):
        return [to_plain(one, longest) if isinstance(one, Message) else one for one in value[:longest]]
    if isinstance(value, np.ndarray):
        return [_plain_part(one, longest) for one in value[:longest]]
    return float(str(value)) if isinstance(value, np.floating) else getattr(value, "item", lambda: value)()
