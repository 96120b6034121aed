"""A system's nodes on the wire: what they say goes out, what others say comes into their loop.

The loop's thread only puts messages into queues. One thread of the bridge's own encodes and sends them; what
comes in is checked in Zenoh's threads and handed to the loop as a device's message. So a slow or hostile wire
cannot stop control, and a log holds what came in.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from functools import partial

from chefbot.bridge.inbox import WIRE, Inbox
from chefbot.bridge.local_only import LEADER, process_node
from chefbot.bridge.node_proxies import Described, Represented, ears_of
from chefbot.bridge.ports import ports_of
from chefbot.bridge.rosout import is_for_people
from chefbot.bridge.wire_health import Health
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.rcl_interfaces import INFO
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.sensor_msgs import CompressedImage, Image
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.errors import Tally
from chefbot.ros2.rmw.names import resolve as full_topic
from chefbot.ros2.rmw.queues import Queues
from chefbot.ros2.rmw.session import Wire
from chefbot.ros2.rmw.tokens import SUBSCRIPTION
from chefbot.runtime.loop import Publication
from chefbot.runtime.node import Node
from chefbot.runtime.node_container import System

DEPTH, ACTION_DEPTH, IMAGE_DEPTH = 10, 1000, 2
CLOCK_NS = 10_000_000
"""/clock is told at most so often, in its own time."""
TURN = 0.2
Job = Callable[[], None]


class Bridge:
    """Puts `system` on `wire`; then `represent` its nodes, and in the end `close`.

    `namespace`: of all its names, '/' or '/robot1'. `simulated`: its time is not the calendar's. `leads`: it is
    this process that tells /clock then. `own`: the node that speaks for the process itself.
    """

    def __init__(
        self,
        system: System,
        wire: Wire,
        namespace: str = "/",
        *,
        simulated: bool = False,
        leads: bool = True,
        own: str = LEADER,
    ) -> None:
        self.own = own
        self.tally: Tally = wire.refused
        self._system, self._wire, self._namespace = system, wire, namespace
        self._tells_clock = simulated and leads
        self._clock_ns = -CLOCK_NS
        self._jobs: Queues[Job] = Queues(self.tally, "more is said than can be sent, the oldest is lost")
        self._inbox = Inbox(system.loop, self.tally)
        self._there = Represented(wire, (namespace, own), self._inbox, system, simulated)
        if self._tells_clock:
            self._there.offer_clock()
        self._health = Health(self.tally, wire.graph, self._there, self._inbox)
        self._wanted: tuple[list[Described], frozenset[str]] | None = None
        self._again: list[Publication] = []
        self._crowd_changed = threading.Event()
        wire.graph.on_change(self._crowd_changed.set)
        self._represented = threading.Event()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, name="wire sender", daemon=True)
        system.loop.tap(self._hear)
        self._thread.start()

    def represent(self, nodes: Iterable[Node], latched: frozenset[str] | None = None) -> None:
        """These nodes are there now, and no others. `latched`: topics that are so in the whole launch."""
        described = [(node, ports_of(node)) for node in nodes]
        if latched is None:
            latched = frozenset(one.name for _, ports in described for one in ports.outs if one.latched)
        if self._represented.is_set():  # else it waits in the queue still
            for said in self._system.loop.latched():
                if said.publisher != WIRE:
                    self._again.append(said)
        self._wanted = (described, latched)
        self._represented.set()
        self._jobs.put("nodes", lambda: None, 1)  # wakes the thread, which looks for `_wanted` first

    def lose(self, process: str) -> None:
        """A process of the launch has died or does not answer: its commands must not go on; any thread."""
        self._inbox.say("process_lost", String(process))

    def regain(self, process: str) -> None:
        """It is there, all its nodes on the wire, and answers; any thread."""
        self._inbox.say("process_back", String(process))

    def remark(self, topic: str, text: str) -> None:
        """A sentence for people, on `<topic>/remark` of the loop and on /rosout; any thread."""
        self._inbox.say(f"{topic}/remark", String(text))
        job = partial(self._there.own_rosout.say, INFO, text, self._system.loop.now_ns)
        self._jobs.put(f"{topic}/remark", job, DEPTH)

    @property
    def wire(self) -> Wire:
        """What it puts the system on."""
        return self._wire

    def sees(self, process: str) -> bool:
        """Whether all nodes of another process of this launch are on the wire, their ports too."""
        listened = full_topic("tf_static", self._namespace)
        ends = self._wire.graph.ends_of(full_topic(ears_of(process_node(process)), self._namespace))
        return any(one.end.kind == SUBSCRIPTION and one.end.topic == listened for one in ends)

    def settle(self, timeout: float = 5.0) -> bool:
        """Wait until everything so far has been done; False if it takes longer."""
        done = threading.Event()
        self._jobs.put("settle", done.set, DEPTH)
        return done.wait(timeout)

    def close(self) -> None:
        """Take the nodes off the wire; the wire itself stays open."""
        self._closing.set()
        self._represented.set()
        self._thread.join()
        self._there.close()

    # -- in the loop's thread

    def _hear(self, publication: Publication) -> None:
        topic = publication.topic
        action, _, part = topic.partition("/_action/")
        if publication.publisher == WIRE and part != "send_goal":
            return  # it came from there
        if self._tells_clock:
            self._tell_clock(publication.time_ns)
        if part:
            job = partial(self._send_action, action, part, publication)
            self._jobs.put(f"/{topic}", job, ACTION_DEPTH)
            return
        publisher = self._there.publishers.get((publication.publisher, topic))
        if publisher is None or publisher.heard or is_for_people(publication):
            self._jobs.put(f"/{topic}", partial(self._send, publication), _depth(publication))

    def _tell_clock(self, now_ns: int) -> None:
        if now_ns - self._clock_ns >= CLOCK_NS:
            self._clock_ns = now_ns
            clock = Clock(Time.of(now_ns))
            self._jobs.put("/clock", partial(self._there.tell_clock, clock), 1, newest=True)

    # -- in the bridge's thread

    def _work(self) -> None:
        """Nothing goes out before the first nodes are there: then it goes out in their names."""
        self._represented.wait()
        look_at = time.monotonic()
        while not self._closing.is_set():
            wanted, self._wanted = self._wanted, None
            if wanted is not None:
                again, self._again = self._again, []
                self._do(partial(self._there.show, *wanted))
                for said in again:  # the publishers that said it are gone, with all that they kept
                    self._do(partial(self._send, said))
            job = self._jobs.take(TURN)
            if job is not None:
                self._do(job)
            if time.monotonic() >= look_at:
                look_at = time.monotonic() + Health.PERIOD
                if self._crowd_changed.is_set():
                    self._crowd_changed.clear()
                    self._do(self._health.look)
                    self._do(self._there.listen_again)
                self._do(partial(self._health.tell, self._system.loop.now_ns))

    def _do(self, job: Job) -> None:
        """Whatever goes wrong here is told in diagnostics and must not end the sending."""
        try:
            job()
        except Exception as fault:
            self.tally.add(f"sending: {type(fault).__name__}: {fault}")

    def _send(self, publication: Publication) -> None:
        self._there.publisher(publication).publish(publication.message)
        self._there.log(publication)

    def _send_action(self, action: str, part: str, publication: Publication) -> None:
        bridged = self._there.action(action, publication)
        if bridged is not None:
            bridged.hear(part, publication.message)


def _depth(publication: Publication) -> int:
    if publication.latched:
        return 1
    return IMAGE_DEPTH if isinstance(publication.message, (Image, CompressedImage)) else DEPTH
