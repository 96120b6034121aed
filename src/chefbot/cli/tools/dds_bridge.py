"""`chefbot dds`: the robot among nodes of ROS 2 that speak DDS, and they among its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
"""Seconds between two looks for something new to tell."""
MISSING = "the bridge to DDS needs Cyclone DDS: pip install 'chefbot[dds]'"


def run_dds(domain: int | None, topics: Sequence[str], interface: str) -> None:
    """Until Ctrl-C. UserError without the extra, in a second bridge on one wire, or when DDS cannot be opened."""
    try:
        from chefbot.ros2.dds.bridge import NODE, DdsBridge
        from chefbot.ros2.dds.domain import AUTO, DdsParticipant, interface_from_environment
    except ImportError as error:
        if not (error.name or "").startswith("cyclonedds"):
            raise
        raise UserError(MISSING) from None
    patterns = [_pattern(one) for one in topics]
    number = domain_from_environment() if domain is None else domain
    if not 0 <= number <= MAX_DOMAIN:
        raise UserError(f"DDS domain {number} must lie between 0 and {MAX_DOMAIN}")
    where = interface or interface_from_environment()
    with stop_event() as stop, RmwContext(domain_from_environment(), port=port_from_environment()) as wire:
        settle(wire.graph)
        if any(one.name == NODE for one in wire.graph.nodes()):
            raise UserError(
                f"a bridge to DDS, /{NODE}, runs on this wire already; two would copy in a circle"
            )
        bridge = DdsBridge(wire, DdsParticipant(number, where), lambda name: _chosen(name, patterns))
        try:
            console.print(_place(number, where, where == AUTO))
            _tell(bridge, stop, lambda: _refuse_second(wire, NODE, wire.zid))
        finally:
            bridge.close()


def _refuse_second(wire: RmwContext, name: str, own: str = "") -> None:
    """UserError if there is another bridge, and of two that began together in the one whose id is higher."""
    others = [one.zid for one in wire.graph.nodes() if one.name == name and one.zid != own]
    if others and (not own or min(others) < own):
        raise UserError(f"a bridge to DDS, /{name}, runs on this wire already; two would copy in a circle")


def _pattern(text: str) -> str:
    """With its slash; stars stand for anything. UserError if no topic could be called so."""
    full = text if text.startswith("/") else f"/{text}"
    try:
        resolve(full.replace("*", "x"))
    except RmwError as error:
        raise UserError(f"--topics {text}: {error}") from None
    return full


def _chosen(name: str, patterns: Sequence[str]) -> bool:
    return not patterns or any(fnmatchcase(name, one) for one in patterns)


def _place(domain: int, interface: str, wide: bool) -> str:
    if not wide:
        return f"Bridge to DDS domain {domain} on {interface}. Ctrl-C ends it."
    return (
        f"Bridge to DDS domain {domain} on the network that Cyclone DDS takes. As in every such ROS 2 system all who "
        "reach that network can hear and command the robot; --interface lo keeps it on this machine. Ctrl-C ends it."
    )


def _tell(bridge: DdsBridge, stop: Event, check: Callable[[], None]) -> None:
    """Each topic when it comes or goes, from the robot's side; and what was refused or lost."""
    outward: tuple[str, ...] = ()
    inward: tuple[str, ...] = ()
    left_out: dict[str, str] = {}
    counts: dict[str, int] = {}
    while not stop.wait(PERIOD):
        check()
        now = bridge.topics
        for arrow, before, after in (
            ("said on DDS", outward, now.outward),
            ("heard on DDS", inward, now.inward),
        ):
            for word, names in (("+", set(after) - set(before)), ("-", set(before) - set(after))):
                if names:
                    console.print(f"{word} {arrow}: {' '.join(sorted(names))}")
        outward, inward = now.outward, now.inward
        for name, why in now.left_out.items():
            if left_out.get(name) != why:
                errors.print(f"chefbot: {name}: {why}")
        left_out = now.left_out
        known, counts = counts, bridge.rejected.counts()
        for reason, count in counts.items():
            if known.get(reason) != count:
                errors.print(f"chefbot: {reason} ({count} times)")
