"""Bridge between a system's nodes and ROS 2: their messages are sent, received messages enter their loop.

The loop's thread only queues messages. A thread of the bridge serializes and sends them; received messages
are checked in Zenoh's threads and posted to the loop as device messages. So a slow or hostile network cannot
block control, and the recording contains what was received.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from functools import partial

from chefbot.bridge.inbox import WIRE_PUBLISHER, Inbox
from chefbot.bridge.local_only import LOCAL_TOPICS, MAIN_NODE_NAME, process_node
from chefbot.bridge.membership_health import MembershipHealth
from chefbot.bridge.node_proxies import NodeProxies, NodeWithPorts, tf_listener_name
from chefbot.bridge.ports import LaunchPorts, ports_of
from chefbot.bridge.rosout import is_for_operator
from chefbot.bridge.wire_health import WireHealth
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.rcl_interfaces import INFO
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.sensor_msgs import CompressedImage, Image
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.errors import QUEUE_FULL, ErrorCounter
from chefbot.ros2.rmw.liveliness import SUBSCRIPTION
from chefbot.ros2.rmw.message_queues import MessageQueues
from chefbot.ros2.rmw.names import resolve as full_topic
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.loop import Publication
from chefbot.runtime.node import Node
from chefbot.runtime.node_container import NodeContainer

DEPTH, ACTION_DEPTH, IMAGE_DEPTH = 10, 1000, 2
CLOCK_PERIOD_NS = 10_000_000
"""Minimum period of /clock messages, ns of simulated time."""
POLL_TIMEOUT = 0.2
"""Maximum time that the sender thread waits for a job, s."""
Job = Callable[[], None]


class Bridge:
    """Bridges `system` to `wire`; call `represent` with its nodes, and `close` at the end.

    namespace: of all its names, '/' or '/robot1'. simulated: whether its time is simulated. publishes_clock: whether
    this process publishes /clock then. node_name: of the node that represents the process itself.
    """

    def __init__(
        self,
        system: NodeContainer,
        wire: RmwContext,
        namespace: str = "/",
        *,
        simulated: bool = False,
        publishes_clock: bool = True,
        node_name: str = MAIN_NODE_NAME,
        membership: MembershipHealth | None = None,
    ) -> None:
        self.node_name = node_name
        self.errors: ErrorCounter = wire.rejected
        self._system, self._wire, self._namespace = system, wire, namespace
        self._publishes_clock = simulated and publishes_clock
        self._last_clock_ns = -CLOCK_PERIOD_NS
        self._jobs: MessageQueues[Job] = MessageQueues(self.errors, f"send {QUEUE_FULL}")
        self._inbox = Inbox(system.loop, self.errors)
        self._proxies = NodeProxies(wire, (namespace, node_name), self._inbox, system, simulated)
        if self._publishes_clock:
            self._proxies.advertise_clock()
        self._health = WireHealth(self.errors, wire.graph, self._proxies, self._inbox, membership)
        self._pending_nodes: tuple[list[NodeWithPorts], LaunchPorts] | None = None
        self._republish: list[Publication] = []
        self._graph_changed = threading.Event()
        wire.graph.on_change(self._graph_changed.set)
        self._has_nodes = threading.Event()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="wire sender", daemon=True)
        system.loop.add_observer(self._on_publication)
        self._thread.start()

    def represent(self, nodes: Iterable[Node], launch: LaunchPorts | None = None) -> None:
        """Represent these nodes on the wire, and no others.

        `launch`: what all nodes of the launch provide; if None, there are no other nodes.
        """
        described = [(node, ports_of(node)) for node in nodes]
        if launch is None:
            launch = LaunchPorts(
                frozenset(port.name for _, ports in described for port in ports.publishers if port.latched)
            )
        if self._has_nodes.is_set():  # otherwise it is still in the queue
            for publication in self._system.loop.latched():
                if publication.publisher != WIRE_PUBLISHER:
                    self._republish.append(publication)
        self._pending_nodes = (described, launch)
        self._has_nodes.set()
        self._jobs.put("nodes", lambda: None, 1)  # wakes the thread, which handles `_pending_nodes` first

    def report_process_down(self, process: str) -> None:
        """Report that a process of the launch has died or does not respond; thread-safe."""
        self._inbox.publish("process_lost", String(process))

    def report_process_up(self, process: str) -> None:
        """Report that a process responds and has all its nodes on the wire; thread-safe."""
        self._inbox.publish("process_back", String(process))

    def publish_notice(self, topic: str, text: str) -> None:
        """Publish a message for the operator on `<topic>/notice` of the loop and on /rosout; thread-safe."""
        self._inbox.publish(f"{topic}/notice", String(text))
        job = partial(self._proxies.own_rosout.log, INFO, text, self._system.loop.now_ns)
        self._jobs.put(f"{topic}/notice", job, DEPTH)

    @property
    def wire(self) -> RmwContext:
        """The wire session that the system is bridged to."""
        return self._wire

    def is_process_ready(self, process: str) -> bool:
        """Return whether all nodes of another process of the launch are on the wire."""
        last_topic = full_topic("tf_static", self._namespace)
        endpoints = self._wire.graph.endpoints_of(
            full_topic(tf_listener_name(process_node(process)), self._namespace)
        )
        return any(
            endpoint.info.kind == SUBSCRIPTION and endpoint.info.topic == last_topic for endpoint in endpoints
        )

    def flush(self, timeout: float = 5.0) -> bool:
        """Wait until all jobs queued so far are done; return False if that exceeds `timeout`, s."""
        done = threading.Event()
        self._jobs.put("settle", done.set, DEPTH)
        return done.wait(timeout)

    def close(self) -> None:
        """Take the nodes off the wire; the session stays open."""
        self._closing.set()
        self._has_nodes.set()
        self._thread.join()
        self._proxies.close()

    # -- in the loop's thread

    def _on_publication(self, publication: Publication) -> None:
        topic = publication.topic
        action, _, part = topic.partition("/_action/")
        if publication.publisher == WIRE_PUBLISHER and part != "send_goal":
            return  # received from the wire: do not send it back
        if topic in LOCAL_TOPICS:
            return
        if self._publishes_clock:
            self._publish_clock(publication.time_ns)
        if part:
            job = partial(self._send_action, action, part, publication)
            self._jobs.put(f"/{topic}", job, ACTION_DEPTH)
            return
        publisher = self._proxies.publishers.get((publication.publisher, topic))
        if publisher is None or publisher.has_subscribers or is_for_operator(publication):
            # Before a publisher is on the wire it has no subscribers, so a drop is no loss to anybody.
            job, depth = partial(self._send, publication), _depth(publication)
            self._jobs.put(f"/{topic}", job, depth, count_drops=publisher is not None)

    def _publish_clock(self, now_ns: int) -> None:
        if now_ns - self._last_clock_ns >= CLOCK_PERIOD_NS:
            self._last_clock_ns = now_ns
            clock = Clock(Time.of(now_ns))
            self._jobs.put("/clock", partial(self._proxies.publish_clock, clock), 1, count_drops=False)

    # -- in the bridge's thread

    def _run(self) -> None:
        """Send queued jobs, but nothing before the first nodes are there, in whose names it goes out."""
        self._has_nodes.wait()
        next_health_check = time.monotonic()
        while not self._closing.is_set():
            self._update_nodes()
            job = self._jobs.take(POLL_TIMEOUT)
            if job is not None:
                self._run_job(job)
            if time.monotonic() >= next_health_check:
                next_health_check = time.monotonic() + WireHealth.PERIOD
                self._check_health()

    def _update_nodes(self) -> None:
        pending, self._pending_nodes = self._pending_nodes, None
        if pending is not None:
            republish, self._republish = self._republish, []
            self._run_job(partial(self._proxies.update_nodes, *pending))
            for publication in republish:  # the old publishers are gone with their transient-local history
                self._run_job(partial(self._send, publication))

    def _check_health(self) -> None:
        if self._graph_changed.is_set():
            self._graph_changed.clear()
            self._run_job(self._health.check_graph)
            self._run_job(self._proxies.subscribe_to_latched)
        self._run_job(partial(self._health.publish, self._system.loop.now_ns))

    def _run_job(self, job: Job) -> None:
        """Run a job; an error is counted in diagnostics and must not end the thread."""
        try:
            job()
        except Exception as error:
            self.errors.add(f"sending: {type(error).__name__}: {error}")

    def _send(self, publication: Publication) -> None:
        self._proxies.publisher(publication).publish(publication.message)
        self._proxies.log(publication)

    def _send_action(self, action: str, part: str, publication: Publication) -> None:
        bridged = self._proxies.action(action, publication)
        if bridged is not None:
            bridged.forward(part, publication.message)


def _depth(publication: Publication) -> int:
    if publication.latched:
        return 1
    return IMAGE_DEPTH if isinstance(publication.message, (Image, CompressedImage)) else DEPTH
