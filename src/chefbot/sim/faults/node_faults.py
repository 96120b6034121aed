"""Injects faults of nodes and of the links between them into the loop, and into a launch."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from chefbot.config import build
from chefbot.errors import UserError, name_hint
from chefbot.msgs.std_msgs import String
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import DEVICE, Loop, Publication, ScheduledEvent
from chefbot.runtime.node import In, Node, Out, topic
from chefbot.runtime.node_container import RESTART_TOPIC
from chefbot.runtime.node_restart import LOST_TOPIC, PROCESS_BACK, PROCESS_LOST
from chefbot.sim.faults.callback_queue import CallbackQueue
from chefbot.sim.faults.events import (
    FaultEvent,
    LinkBlackHole,
    LinkCut,
    NodeFault,
    NodeHung,
    NodeKilled,
    Slow,
)
from chefbot.sim.faults.schedule import FaultSchedule, describe, parse_request, target_of, to_ns, to_plain

NODE = "faults"
"""Name of the node that injects faults into a launch."""
DETECTION_NS = 120_000_000
"""Time after which the loss of a node is reported, ns: as the launch notices that a process sends no heartbeat."""
KIND = "chefbot.sim.faults.node_faults:NodeFaultsNode"
SIMULATOR_KIND = "chefbot.sim.device:SimulatorDevice"


class NodeFaultsParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the injection of faults into nodes and links."""

    events: Annotated[
        tuple[NodeFault, ...], Meta(description="faults of nodes and links, see docs/faults.md")
    ] = ()


class NodeFaultInjector:
    """Intercepts the callbacks and deliveries of one loop."""

    def __init__(self, loop: Loop) -> None:
        self._loop = loop
        self._killed: set[str] = set()
        self._queues: dict[str, CallbackQueue] = {}
        self._links: dict[NodeFault, int] = {}
        """Active faults of links, with the time at which each began, ns."""

    def begin(self, event: NodeFault) -> None:
        """Begin a fault. Raises UserError if the node already has one."""
        if isinstance(event, (LinkCut, LinkBlackHole)) or (isinstance(event, Slow) and event.link):
            self._links[event] = self._loop.now_ns
            return
        if event.node in self._killed or event.node in self._queues:
            raise UserError(f"node {event.node} is killed, hung or slow already")
        if isinstance(event, NodeKilled):
            self._killed.add(event.node)
            return
        duration_ns = to_ns(event.seconds) if isinstance(event, Slow) else None
        self._queues[event.node] = CallbackQueue(self._loop, duration_ns)

    def end(self, event: NodeFault) -> None:
        """End a fault; a killed node stays dead until it is created again."""
        if event in self._links:
            began_ns = self._links.pop(event)
            if isinstance(event, LinkCut):
                self._redeliver_latched(event, began_ns)
        elif not isinstance(event, NodeKilled):
            self._queues.pop(target_of(event)).release()

    def _redeliver_latched(self, event: LinkCut, since_ns: int) -> None:
        for publication in self._loop.latched():
            if publication.time_ns >= since_ns:
                self._loop.redeliver(publication, partial(_hits, event, publication))

    # the interceptor of the loop

    def intercept(self, event: ScheduledEvent, rank: int) -> bool:
        """Return whether the due callback does not run now."""
        node = event.timing.owner
        if node in self._killed:
            event.cancel()
            return True
        queue = self._queues.get(node)
        return queue is not None and queue.intercept(event, rank)

    def delivery_ns(self, publication: Publication, subscriber: str) -> int | None:
        """Return when a publication reaches a node; None if it is lost."""
        time_ns = self._loop.now_ns
        for event in self._links:
            if _hits(event, publication, subscriber):
                if not isinstance(event, Slow):
                    return None
                time_ns = max(time_ns, self._loop.now_ns + to_ns(event.seconds))
        return time_ns

    def silences(self, publisher: str) -> bool:
        """Return whether the node is dead."""
        return publisher in self._killed

    def restarted(self, node: str) -> None:
        """Let the node run, which has been created again."""
        self._killed.discard(node)


def _hits(event: NodeFault, publication: Publication, subscriber: str) -> bool:
    """Return whether a delivery passes over the link of a fault: one of its ends is the named node."""
    assert isinstance(event, (LinkCut, LinkBlackHole, Slow))
    named = not event.topics or publication.topic in event.topics
    return named and (publication.publisher == event.link) != (subscriber == event.link)


class NodeFaultsNode(Node):
    """Injects faults of nodes and links into the loop that it runs on.

    It is a node of the launch and no device, so that a replay injects the same faults at the same times.
    """

    params: NodeFaultsParams
    fault: In[String] = topic("simulation/fault")
    notice: Out[String] = topic("simulation/notice")

    def start(self) -> None:
        """Begin to intercept the loop's callbacks."""
        self._injector = self._loop.interceptor = NodeFaultInjector(self._loop)
        self._lost: set[NodeFault] = set()
        self._schedule = FaultSchedule[NodeFault](
            self.params.events,
            self._begin,
            self._end,
            lambda text: self.notice.publish(String(text)),
        )
        timing = self._loop.timing(self.name, f"{self.name}.advance")
        for time_ns in self._schedule.times_ns():
            self._timers.append(self._loop.schedule(time_ns, DEVICE, self._advance, timing))

    def stop(self) -> None:
        """Release all callbacks; dead nodes stay dead."""
        super().stop()
        for event in [event for event in self._schedule.active if not isinstance(event, NodeKilled)]:
            self._injector.end(event)
        self._loop.interceptor = None

    def on_fault(self, request: String) -> None:
        """Begin a fault of a node or link now, as 'hung planner' or 'slow link=page seconds=2'; 'none' ends it."""
        try:
            requested = parse_request(request.data, self.now_ns)
        except UserError:
            return  # the simulator answers it
        if isinstance(requested, str):
            self._schedule.end_all(requested)
        elif isinstance(requested, NodeFault):
            self._schedule.begin(requested)

    def _advance(self) -> None:
        self._schedule.advance(self.now_ns)

    def _begin(self, event: NodeFault) -> None:
        self._injector.begin(event)
        if isinstance(event, (NodeKilled, NodeHung)):
            timing = self._loop.timing(self.name, f"{self.name}.report_loss")
            report = partial(self._report_loss, event)
            self._timers.append(self._loop.schedule(self.now_ns + DETECTION_NS, DEVICE, report, timing))

    def _report_loss(self, event: NodeKilled | NodeHung) -> None:
        """Report the loss of a node as the launch reports that of a process, which stops the robot."""
        if event not in self._schedule.active:
            return
        self._lost.add(event)
        self.publish(PROCESS_LOST, String(event.node))
        if isinstance(event, NodeKilled):
            self.publish(LOST_TOPIC, String(event.node))

    def _end(self, event: NodeFault) -> None:
        self._injector.end(event)
        if isinstance(event, NodeKilled):
            self.publish(RESTART_TOPIC, String(event.node))
        if event in self._lost:
            self._lost.discard(event)
            self.publish(PROCESS_BACK, String(target_of(event)))


def inject(launch: Launch, events: Iterable[FaultEvent]) -> Launch:
    """Return the launch with the events: those of the simulated robot in the simulator's parameters, those of
    nodes and links in a node of their own. The log of a run contains its launch, and so the events.

    UserError for a node that the launch does not have.
    """
    events = list(events)
    of_nodes = [event for event in events if isinstance(event, NodeFault)]
    for event in of_nodes:
        _check_node(launch, event)
    nodes = dict(launch.nodes)
    simulator = _simulator(launch)
    _extend(nodes, simulator, [event for event in events if not isinstance(event, NodeFault)])
    nodes.setdefault(NODE, NodeEntry(kind=KIND))
    _extend(nodes, NODE, of_nodes)
    return msgspec.structs.replace(launch, nodes=nodes)


def fault_events(launch: Launch) -> list[FaultEvent]:
    """Return all fault events of a launch, as a log contains it, in the order of their begin."""
    plain = [
        item
        for entry in launch.nodes.values()
        if entry.kind in (KIND, SIMULATOR_KIND)
        for item in _plain(entry)
    ]
    events = build(plain, list[FaultEvent], f"launch {launch.name}: events")
    return sorted(events, key=lambda event: event.at)


def _plain(entry: NodeEntry) -> list[Any]:
    return list(entry.params.get("events", []))


def _extend(nodes: dict[str, NodeEntry], name: str, events: Iterable[FaultEvent]) -> None:
    entry = nodes[name]
    params = {**entry.params, "events": [*_plain(entry), *to_plain(events)]}
    nodes[name] = msgspec.structs.replace(entry, params=params)


def _simulator(launch: Launch) -> str:
    for name, entry in launch.nodes.items():
        if entry.kind == SIMULATOR_KIND:
            return name
    raise UserError(f"launch {launch.name} has no simulator; faults are injected into a simulated robot only")


def _check_node(launch: Launch, event: NodeFault) -> None:
    name, names = target_of(event), set(launch.nodes) - {_simulator(launch), NODE}
    if name not in names:
        raise UserError(
            f"launch {launch.name}: {describe(event)}: no node {name!r} can fail{name_hint(name, names)}"
        )
