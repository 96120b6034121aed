"""`chefbot topic echo` and `hz`: what is said, and how often."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from chefbot.errors import UserError, nearest
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.yaml_conversion import to_plain
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos_matching import types_said
from chefbot.ros2.tools.common import SHOWN, console, errors, find, on_wire, stopping, to_yaml
from chefbot.ros2.tools.listen import Ear, Heard, SilenceWatch, listen
from chefbot.ros2.tools.meter import Meter, Rate
from chefbot.ros2.tools.remote_types import definition_of

Show = Callable[[Heard], str]
_STEP = re.compile(r"([A-Za-z_]\w*)|\[?(\d+)\]?")
PREFIXES = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"), (1.0, "B"))


def run_echo(topic: str, once: bool, field: str, whole: bool, seconds: float) -> int:
    """Messages as YAML documents. Exit code: 1 if `once` ended without a message."""
    with on_wire("echo") as node, stopping() as stop:
        named = find(node.wire.graph.topics, topic, "topic")
        show = shower(node, topic, types_said(named), field, None if whole else SHOWN)
        ear = Ear(node, named)
        for heard in ear.samples(seconds or None, stop):
            console.print(show(heard))
            if once:
                return 0
            console.print("---")
        if ear.missed:
            errors.print(f"chefbot: {ear.missed} messages came faster than they could be shown")
    return 1 if once else 0


def run_hz(topic: str, seconds: float) -> int:
    """Rate, intervals and bandwidth. Exit code: 1 if nothing came."""
    with on_wire("hz") as node, stopping() as stop:
        named = find(node.wire.graph.topics, topic, "topic")
        watch = SilenceWatch(node.wire.graph, named.name)
        meters = [Meter()]
        listen(node, named, lambda _, data: meters[-1].add(time.monotonic(), len(data)))
        until = time.monotonic() + seconds
        while not stop.wait(0.05) and (seconds == 0 or time.monotonic() < until):
            watch.heard |= meters[-1].rate().messages > 0
            watch.look()
            if seconds == 0 and meters[-1].span >= 1.0:
                meters.append(Meter())
                console.print(rate_line(named.name, meters.pop(0).rate()))
        rate = meters[-1].rate()
        if seconds > 0:
            console.print(rate_line(named.name, rate))
            watch.heard |= rate.messages > 0
            watch.look(last=True)
    return 0 if watch.heard and (rate.messages or seconds == 0) else 1


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
    known, unknown = _definitions(node, topic, kinds)

    def show(heard: Heard) -> str:
        if heard.kind not in known:
            return f"# not shown: {unknown[heard.kind]}"
        try:
            message = known[heard.kind].from_cdr(heard.data)
        except CdrError as error:
            return f"# refused: {error}"
        value = _pick(message, field) if field else message
        if value is None:
            return f"# {field}: this message has no such element"
        plain = to_plain(value, longest) if isinstance(value, Message) else _plain_part(value, longest)
        return to_yaml(plain)

    for kind in known.values():
        if field:
            _pick(kind(), field)
    return show


def _definitions(
    node: WireNode, topic: str, kinds: list[WireType]
) -> tuple[dict[WireType, type[Message]], dict[WireType, UserError]]:
    """Classes by type, and why there is none. UserError when there is none at all."""
    known: dict[WireType, type[Message]] = {}
    unknown: dict[WireType, UserError] = {}
    for kind in kinds:
        try:
            known[kind] = definition_of(node, kind, f"topic {topic}")
        except UserError as error:
            unknown[kind] = error
    if unknown and not known:
        raise next(iter(unknown.values()))
    return known, unknown


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
