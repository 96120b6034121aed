"""The commands `chefbot topic echo` and `hz`: messages of a topic and their rate."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from chefbot.errors import name_hint
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.yaml_conversion import message_to_dict
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos_matching import offered_types
from chefbot.ros2.tools.common import (
    MAX_SHOWN_ELEMENTS,
    ToolError,
    UnknownTypeError,
    console,
    errors,
    find,
    graph_node,
    stop_event,
    to_yaml,
)
from chefbot.ros2.tools.meter import Meter, Rate
from chefbot.ros2.tools.remote_types import definition_of
from chefbot.ros2.tools.subscribe import NoMessageMonitor, ReceivedSample, SampleStream, subscribe_any

Show = Callable[[ReceivedSample], str]
_STEP = re.compile(r"([A-Za-z_]\w*)|\[?(\d+)\]?")
PREFIXES = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"), (1.0, "B"))


def run_echo(topic: str, once: bool, field: str, full_length: bool, seconds: float) -> int:
    """Print messages as YAML documents.

    Returns the exit code: 1 if `once` ended without a message.
    """
    with graph_node("echo") as node, stop_event() as stop:
        named = find(node.wire.graph.topics, topic, "topic")
        show = make_formatter(
            node, topic, offered_types(named), field, None if full_length else MAX_SHOWN_ELEMENTS
        )
        stream = SampleStream(node, named)
        for sample in stream.samples(seconds or None, stop):
            console.print(show(sample))
            if once:
                return 0
            console.print("---")
        if stream.missed:
            errors.print(
                f"chefbot: {stream.missed} messages were dropped: they came faster than can be shown"
            )
    return 1 if once else 0


def run_hz(topic: str, seconds: float) -> int:
    """Print rate, intervals and bandwidth of a topic.

    Returns the exit code: 1 if no message arrived.
    """
    with graph_node("hz") as node, stop_event() as stop:
        named = find(node.wire.graph.topics, topic, "topic")
        watch = NoMessageMonitor(node.wire.graph, named.name)
        meters = [Meter()]
        subscribe_any(node, named, lambda _, data: meters[-1].add(time.monotonic(), len(data)), stored=False)
        deadline = time.monotonic() + seconds
        while not stop.wait(0.05) and (seconds == 0 or time.monotonic() < deadline):
            watch.received |= meters[-1].rate().messages > 0
            watch.look()
            if seconds == 0 and meters[-1].span >= 1.0:
                meters.append(Meter())
                console.print(rate_line(named.name, meters.pop(0).rate()))
        rate = meters[-1].rate()
        if seconds > 0:
            console.print(rate_line(named.name, rate))
            watch.received |= rate.messages > 0
            watch.look(last=True)
    return 0 if watch.received and (rate.messages or seconds == 0) else 1


def rate_line(topic: str, rate: Rate) -> str:
    """Format a measured rate as a readable line."""
    if rate.hz == 0.0:
        return f"{topic}: {('no message', 'one message, too few for a rate')[min(rate.messages, 1)]}"
    return (
        f"{topic}: {rate.hz:.2f} Hz, every {1e3 * rate.min_interval:.1f} to {1e3 * rate.longest:.1f} ms "
        f"(std {1e3 * rate.deviation:.2f} ms), {quantity(rate.bytes_per_second)}/s, {rate.messages} messages"
    )


def quantity(size: float) -> str:
    """Format a number of bytes, such as '12.3 kB'."""
    factor, unit = next((prefix for prefix in PREFIXES if size >= prefix[0]), PREFIXES[-1])
    return f"{size / factor:.1f} {unit}"


def make_formatter(
    node: RmwNode, topic: str, kinds: list[InterfaceType], field: str, max_elements: int | None
) -> Show:
    """Return a function that converts received samples to text.

    Raises ToolError when all types are unknown, or none has the field.
    """
    known, unknown = _definitions(node, topic, kinds)

    def show(sample: ReceivedSample) -> str:
        if sample.kind not in known:
            return f"# not shown: {unknown[sample.kind]}"
        try:
            message = known[sample.kind].from_cdr(sample.data)
        except CdrError as error:
            return f"# refused: {error}"
        value = _pick(message, field) if field else message
        if value is None:
            return f"# {field}: this message has no such element"
        plain = (
            message_to_dict(value, max_elements)
            if isinstance(value, Message)
            else _plain_part(value, max_elements)
        )
        return to_yaml(plain)

    for kind in known.values():
        if field:
            _pick(kind(), field)
    return show


def _definitions(
    node: RmwNode, topic: str, kinds: list[InterfaceType]
) -> tuple[dict[InterfaceType, type[Message]], dict[InterfaceType, UnknownTypeError]]:
    """Return message classes by type, and for the other types the reason why there is none.

    Raises ToolError when there is no class at all.
    """
    known: dict[InterfaceType, type[Message]] = {}
    unknown: dict[InterfaceType, UnknownTypeError] = {}
    for kind in kinds:
        try:
            known[kind] = definition_of(node, kind, f"topic {topic}")
        except UnknownTypeError as error:
            unknown[kind] = error
    if unknown and not known:
        raise next(iter(unknown.values()))
    return known, unknown


def _pick(message: Message, path: str) -> Any:
    """Return the value at a path such as 'pose.pose.position.x' or 'ranges[0]'."""
    value: Any = message
    for name, index in _steps(path):
        if name:
            if not isinstance(value, Message) or name not in value.__struct_fields__:
                names = value.__struct_fields__ if isinstance(value, Message) else ()
                raise ToolError(f"--field {path}: there is no {name}{name_hint(name, names)}")
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
            raise ToolError(
                f"--field {path}: write names and numbers with dots, as pose.position.x or ranges[0]"
            )
        yield match[1] or "", int(match[2] or 0)


def _plain_part(value: Any, max_elements: int | None) -> Any:
    """Convert a value that is not a message to plain data: a number, a string or a list."""
    if isinstance(value, tuple):
        return [
            message_to_dict(element, max_elements) if isinstance(element, Message) else element
            for element in value[:max_elements]
        ]
    if isinstance(value, np.ndarray):
        return [_plain_part(element, max_elements) for element in value[:max_elements]]
    return float(str(value)) if isinstance(value, np.floating) else getattr(value, "item", lambda: value)()
