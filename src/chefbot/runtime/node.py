"""Nodes: thin wrappers around algorithms, with typed ports for topics and actions.

    class Echo(Node):
        chatter: In[String]
        echo: Out[String] = topic("chatter_echo")

        def on_chatter(self, message: String) -> None:
            self.echo.publish(message)

        @every(hz=1)
        def tick(self) -> None: ...

The attribute's name is the topic's name unless `topic` gives another; a launch file may remap it.
"""

from __future__ import annotations

import typing
import zlib
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Generic, TypeVar

import msgspec
import numpy as np

from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import MOTION_COMMANDS
from chefbot.runtime.coroutines import Future, Task
from chefbot.runtime.loop import DEVICE, TIMER, Loop, LoopSubscription, ScheduledEvent
from chefbot.runtime.transform_buffer import TransformBuffer

M = TypeVar("M", bound=Message)
T = TypeVar("T")
SECOND = 1_000_000_000


class NoParams(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The empty parameter struct of a node without parameters."""


@dataclass(frozen=True)
class Context:
    """Everything that a node is constructed with: its name, loop, robot, transforms, seed and remappings."""

    name: str
    loop: Loop
    robot: Robot
    transforms: TransformBuffer
    seed: int = 0
    remap: typing.Mapping[str, str] = field(default_factory=dict)

    def rng(self) -> np.random.Generator:
        """Return a random generator for this node, seeded by the launch's seed and the node's name."""
        return np.random.default_rng([self.seed, zlib.crc32(self.name.encode())])


@dataclass(frozen=True)
class TopicSpec:
    """The topic options that `topic(...)` declares for a port."""

    name: str = ""
    latched: bool = False


def topic(name: str = "", *, latched: bool = False) -> Any:
    """Declare a port's topic name, if it differs from the attribute's name, and its durability.

    `latched`: late-joining subscribers receive the last message (transient local).
    """
    return TopicSpec(name, latched)


RESTORED_PREFIX = "restored/"
"""Prefix of the loop's topics that carry state restored after a restart; no node publishes them."""


RESTARTED = "restarted"
"""Topic that signals, after all restored state, that the node's process was restarted."""


def restored(name: str) -> Any:
    """Declare an input that receives the last message on the latched topic `name` from before a restart.

    The message was published by the node itself or by another one. It is delivered once, before any timer, if
    the node's process died and was restarted, so that the node can continue where it was. `tf` holds the
    transforms of the moment when the process died; RESTARTED, an Empty, is delivered after all others.
    """
    return TopicSpec(RESTORED_PREFIX + name)


class PortSpec:
    """Declaration of a port as a class attribute's value, such as an action server's."""

    def bind(self, node: Node, name: str) -> Any:
        """Create the port called `name` of one node."""
        raise TypeError(f"{type(self).__name__} cannot be the port {name} of {node.name}")


class In(Generic[M]):
    """An input port: a subscription whose callback is the node's method `on_<port>`."""

    def __init__(self, node: Node, name: str, handler: Callable[[M], None] | None) -> None:
        self.topic = name
        self.last: M | None = None
        """The most recent message; None before the first."""
        self._handler = handler
        node.subscribe(name, self._receive)

    def _receive(self, message: Message) -> None:
        self.last = typing.cast(M, message)
        if self._handler is not None:
            self._handler(self.last)


class Out(Generic[M]):
    """An output port: a publisher on one topic."""

    def __init__(self, node: Node, name: str, kind: type[M], latched: bool) -> None:
        self.topic = name
        self.kind = kind
        self.latched = latched
        self.advertised = True
        """Whether the publisher is advertised to other processes."""
        self._node = node
        self._is_motion_command = issubclass(kind, MOTION_COMMANDS)

    def unadvertise(self) -> None:
        """Stop advertising a topic that this robot's node will never publish; call it in `start`."""
        self.advertised = False

    def publish(self, message: M) -> None:
        """Publish a message to all subscribers.

        Motion commands of a node that fails repeatedly are dropped, see `chefbot.runtime.callback_faults`.
        TypeError if the message is not of the port's type.
        """
        if type(message) is not self.kind:
            raise TypeError(f"{self.topic} carries {self.kind.__name__}, not {type(message).__name__}")
        if not (self._is_motion_command and self._node.is_silenced):
            self._node.publish(self.topic, message, self.latched)


@dataclass(frozen=True)
class _Timer:
    period_ns: int


def every(*, hz: float) -> Callable[[Callable[[Any], None]], Callable[[Any], None]]:
    """Call the decorated method at a fixed rate, after all messages of that instant."""

    def mark(method: Callable[[Any], None]) -> Callable[[Any], None]:
        method.every = _Timer(round(SECOND / hz))  # type: ignore[attr-defined]
        return method

    return mark


class Node:
    """Base class of all nodes.

    A subclass declares `params`, ports, callbacks and `start`, but no `__init__`.
    """

    is_device: ClassVar[bool] = False
    live_params: ClassVar[tuple[str, ...]] = ()
    """Parameters that can change at run time: dotted names, `*` for any part; others need a restart."""
    max_silence: ClassVar[float] = 0.0
    """Time without a sign of life of its process for which the robot may move on, s, if the supervisor's own limit
    is shorter; of the nodes of a process, the shortest counts."""
    params: Any

    def __init__(self, context: Context, params: Any) -> None:
        self.name = context.name
        self.robot = context.robot
        self.tf = context.transforms
        self.params = params
        self.context = context
        self._loop = context.loop
        self._subscriptions: list[LoopSubscription] = []
        self._timers: list[ScheduledEvent] = []
        self._tasks: list[Task[Any]] = []
        _bind_ports(self)
        self._start_timers()

    def start(self) -> None:
        """Set up the node; its ports are bound and all other nodes of the launch exist."""

    def reconfigure(self, params: Any) -> None:
        """Apply changed parameters at run time; only `live_params` differ from the current ones.

        UserError if the new values are inconsistent. The default suffices for a node that always reads
        `self.params`.
        """
        self.params = params

    def stop(self) -> None:
        """Cancel all tasks and timers and unsubscribe from all topics."""
        for task in list(self._tasks):
            task.cancel()
        for subscription in self._subscriptions:
            self._loop.unsubscribe(subscription)
        for timer in self._timers:
            timer.cancel()

    @property
    def now_ns(self) -> int:
        """Current time of the loop, ns."""
        return self._loop.now_ns

    @property
    def is_silenced(self) -> bool:
        """Whether the node fails so often that its motion commands are dropped."""
        return self._loop.faults is not None and self._loop.faults.is_silenced(self.name)

    def subscribe(self, name: str, handler: Callable[[Message], None]) -> None:
        """Subscribe to a topic for the lifetime of the node."""
        self._subscriptions.append(self._loop.subscribe(name, self.name, handler))

    def publish(self, name: str, message: Message, latched: bool = False) -> None:
        """Publish a message on any topic in the name of the node."""
        self._loop.publish(name, message, self.name, from_device=self.is_device, latched=latched)

    def resolve(self, name: str) -> str:
        """Return a topic's name after the launch file's remapping."""
        return self.context.remap.get(name, name)

    def spawn(self, work: Coroutine[Any, Any, T]) -> Task[T]:
        """Run a coroutine as a task of the node; it is cancelled when the node stops."""
        task = Task(work)
        self.adopt(task)
        return task.start()

    def adopt(self, task: Task[Any]) -> None:
        """Register a task to be cancelled when the node stops."""
        self._tasks.append(task)
        task.add_done_callback(lambda: self._tasks.remove(task))

    def sleep(self, seconds: float) -> Future[None]:
        """Return a future that completes after `seconds` of the loop's time; `await` it."""
        future: Future[None] = Future()
        timing = self._loop.timing(self.name, f"{self.name}.sleep")
        self._loop.schedule(
            self.now_ns + round(seconds * SECOND), TIMER, partial(future.set_result, None), timing
        )
        return future

    def _start_timers(self) -> None:
        for name in dir(type(self)):
            timer = getattr(getattr(type(self), name, None), "every", None)
            if isinstance(timer, _Timer):
                self._repeat(timer.period_ns, getattr(self, name), name)

    def _repeat(self, period_ns: int, action: Callable[[], None], name: str) -> None:
        """Schedule a timer on multiples of its period, so that timers with equal periods stay in phase."""
        rank = DEVICE if self.is_device else TIMER
        slot = len(self._timers)
        timing = self._loop.timing(self.name, f"{self.name}.{name}", from_device=self.is_device)
        first = -(-(self.now_ns + 1) // period_ns) * period_ns

        def fire() -> None:
            following = (self.now_ns // period_ns + 1) * period_ns
            self._timers[slot] = self._loop.schedule(following, rank, fire, timing)
            action()

        self._timers.append(self._loop.schedule(first, rank, fire, timing))


class Device(Node):
    """A node that accesses hardware or the simulator; in a replay its messages come from the log.

    It publishes only from timers and posted actions.
    """

    is_device = True

    def __init__(self, context: Context, params: Any) -> None:
        self._scheduled: list[ScheduledEvent] = []
        self._post_timing = context.loop.timing(
            context.name, f"{context.name} from outside", from_device=True
        )
        super().__init__(context, params)

    def post(self, action: Callable[[], None]) -> None:
        """Run `action` in the loop; safe from any thread."""
        self._loop.post(action, self._post_timing)

    def schedule_at(self, time_ns: int, action: Callable[[], None]) -> None:
        """Run `action` at a time of the loop, unless the device has been stopped by then."""
        self._scheduled = [event for event in self._scheduled if event.due_ns > self.now_ns]
        self._scheduled.append(self._loop.schedule(time_ns, DEVICE, action, self._post_timing))

    def stop(self) -> None:
        """Stop the node and cancel its scheduled actions."""
        super().stop()
        for event in self._scheduled:
            event.cancel()


def _bind_ports(node: Node) -> None:
    """Create the declared ports: inputs and outputs by annotation, action ports by value."""
    kind = type(node)
    for name, hint in typing.get_type_hints(kind).items():
        spec = getattr(kind, name, None)
        spec = spec if isinstance(spec, TopicSpec) else TopicSpec()
        full_name = node.resolve(spec.name or name)
        if typing.get_origin(hint) is In:
            setattr(node, name, In(node, full_name, getattr(node, f"on_{name}", None)))
        elif typing.get_origin(hint) is Out:
            setattr(node, name, Out(node, full_name, typing.get_args(hint)[0], spec.latched))
    for name in dir(kind):
        port = getattr(kind, name)
        if isinstance(port, PortSpec):
            setattr(node, name, port.bind(node, name))


def subscribes_to(kind: type[Node], message: type[Message]) -> bool:
    """Return whether nodes of this class subscribe to messages of that type."""
    return any(
        typing.get_origin(hint) is In and typing.get_args(hint)[0] is message
        for hint in typing.get_type_hints(kind).values()
    )


def params_type(kind: type[Node]) -> type[msgspec.Struct]:
    """Return the struct type that a node's parameters are parsed into."""
    return typing.cast(type[msgspec.Struct], typing.get_type_hints(kind)["params"])
