"""`chefbot topic bridge`: topics both ways between the robot and ROS 2 nodes that use DDS."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from threading import Event
from typing import TYPE_CHECKING

from chefbot.errors import UserError
from chefbot.ros2.rmw.environment import domain_from_environment, port_from_environment
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.names import resolve
from chefbot.ros2.rmw.session import MAX_DOMAIN, RmwContext
from chefbot.ros2.tools.common import console, errors, settle, stop_event

if TYPE_CHECKING:
    from chefbot.ros2.dds.bridge import DdsBridge

PERIOD = 1.0
"""Period of the report of changes, s."""
MISSING = "the bridge to DDS needs Cyclone DDS: pip install 'chefbot[dds]'"


def run_dds(domain: int | None, topics: Sequence[str], interface: str) -> None:
    """Bridge topics both ways until Ctrl-C.

    Raises UserError without the extra, for a second bridge on the same network, or if DDS cannot be opened.
    """
    try:
        from chefbot.ros2.dds.bridge import NODE, DdsBridge
        from chefbot.ros2.dds.domain import AUTO, DdsParticipant, interface_from_environment
    except ImportError as error:
        if not (error.name or "").startswith("cyclonedds"):
            raise
        raise UserError(MISSING) from None
    patterns = [_pattern(topic) for topic in topics]
    number = domain_from_environment() if domain is None else domain
    if not 0 <= number <= MAX_DOMAIN:
        raise UserError(f"DDS domain {number} must lie between 0 and {MAX_DOMAIN}")
    where = interface or interface_from_environment()
    with stop_event() as stop, RmwContext(domain_from_environment(), port=port_from_environment()) as wire:
        settle(wire.graph)
        _refuse_second(wire, NODE)
        bridge = DdsBridge(wire, DdsParticipant(number, where), lambda name: _is_selected(name, patterns))
        try:
            console.print(_announcement(number, where, where == AUTO))
            _report_changes(bridge, stop, lambda: _refuse_second(wire, NODE, wire.zid))
        finally:
            bridge.close()


def _refuse_second(wire: RmwContext, name: str, own: str = "") -> None:
    """Raise UserError if there is another bridge; of two that started together, in the one with the higher id."""
    others = [node.zid for node in wire.graph.nodes() if node.name == name and node.zid != own]
    if others and (not own or min(others) < own):
        raise UserError(
            f"a bridge to DDS, /{name}, runs on this network already; two would forward messages in a circle"
        )


def _pattern(text: str) -> str:
    """Return the pattern with a leading slash; `*` matches any text. Raises UserError if no topic can match."""
    full = text if text.startswith("/") else f"/{text}"
    try:
        resolve(full.replace("*", "x"))
    except RmwError as error:
        raise UserError(f"--topics {text}: {error}") from None
    return full


def _is_selected(name: str, patterns: Sequence[str]) -> bool:
    return not patterns or any(fnmatchcase(name, pattern) for pattern in patterns)


def _announcement(domain: int, interface: str, wide: bool) -> str:
    if not wide:
        return f"Bridge to DDS domain {domain} on {interface}. Ctrl-C ends it."
    return (
        f"Bridge to DDS domain {domain} on the network that Cyclone DDS selects. As in every such ROS 2 system, all "
        "computers in that network can read from and command the robot; --interface lo restricts it to this machine. "
        "Ctrl-C ends it."
    )


def _report_changes(bridge: DdsBridge, stop: Event, check: Callable[[], None]) -> None:
    """Print each topic when it appears or disappears, and what was rejected or lost."""
    outward: tuple[str, ...] = ()
    inward: tuple[str, ...] = ()
    left_out: dict[str, str] = {}
    counts: dict[str, int] = {}
    while not stop.wait(PERIOD):
        check()
        now = bridge.topics
        _print_changed("published on DDS", outward, now.outward)
        _print_changed("received from DDS", inward, now.inward)
        outward, inward = now.outward, now.inward
        _print_left_out(left_out, now.left_out)
        left_out = now.left_out
        previous, counts = counts, bridge.rejected.counts()
        for reason, count in counts.items():
            if previous.get(reason) != count:
                errors.print(f"chefbot: {reason} ({count} times)")


def _print_changed(direction: str, before: tuple[str, ...], after: tuple[str, ...]) -> None:
    for sign, names in (("+", set(after) - set(before)), ("-", set(before) - set(after))):
        if names:
            console.print(f"{sign} {direction}: {' '.join(sorted(names))}")


def _print_left_out(before: Mapping[str, str], after: Mapping[str, str]) -> None:
    for name, reason in after.items():
        if before.get(name) != reason:
            errors.print(f"chefbot: {name}: {reason}")
