"""Nodes: a thin shell round an algorithm, with typed ports.

    class Echo(Node):
        heard: In[String] = topic("chatter")
        said: Out[String]

        def on_heard(self, message: String) -> None:
            self.said.publish(message)

        @every(hz=1)
        def tick(self) -> None: ...

A port's topic is its name unless `topic` gives another; a launch file may remap it.
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
from chefbot.runtime.callback_faults import DRIVES
from chefbot.runtime.coroutines import Future, Task
from chefbot.runtime.loop import DEVICE, TIMER, Loop, Scheduled, Subscription
from chefbot.runtime.transform_buffer import Transforms

M = TypeVar("M", bound=Message)
T = TypeVar("T")
SECOND = 1_000_000_000


class NoParams(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """For a node that needs none."""


@dataclass(frozen=True)
class Context:
    """What a node is given when it is made."""

    name: str
    loop: Loop
    robot: Robot
    transforms: Transforms
    seed: int = 0
    remap: typing.Mapping[str, str] = field(default_factory=dict)

    def rng(self) -> np.random.Generator:
        """Chance of this node alone, from the launch's seed and the node's name."""
        return np.random.default_rng([self.seed, zlib.crc32(self.name.encode())])


@dataclass(frozen=True)
class TopicSpec:
    """What `topic(...)` says of a port."""

    name: str = ""
    latched: bool = False


def topic(name: str = "", *, latched: bool = False) -> Any:
    """A port's topic where it is not the port's name; `latched`: late listeners get the last message."""
    return TopicSpec(name, latched)


LAST_WORDS = "last_words/"
"""Topics of the loop that begin so are told by no node: see `last_words`."""


LIFE = "life"
"""The last of a node's last words: that it has lived before, whatever else is known of that."""


def last_words(name: str) -> Any:
    """An input for what was last said on the latched topic `name` by this node's life before, or by others.

    Told once, before any timer, where a node's process died and was started again: what goes on from there goes on.
    `tf` is told as it was when the process died; LIFE, an Empty, comes behind all others.
    """
    return TopicSpec(LAST_WORDS + name)


class PortSpec:
    """A port that is declared by a value, such as an action's."""

    def bind(self, node: Node, name: str) -> Any:
        """The port called `name` of one node."""
        raise TypeError(f"{type(self).__name__} cannot be the port {name} of {node.name}")


class In(Generic[M]):
    """A topic that the node listens to; `on_<port>` is called with each message."""

    def __init__(self, node: Node, name: str, handler: Callable[[M], None] | None) -> None:
        self.topic = name
        self.last: M | None = None
        """The newest message, None before the first."""
        self._handler = handler
        node.listen(name, self._receive)

    def _receive(self, message: Message) -> None:
        self.last = typing.cast(M, message)
        if self._handler is not None:
            self._handler(self.last)


class Out(Generic[M]):
    """A topic that the node speaks on."""

    def __init__(self, node: Node, name: str, kind: type[M], latched: bool) -> None:
        self.topic = name
        self.kind = kind
        self.latched = latched
        self.offered = True
        """Whether others are told of it."""
        self._node = node
        self._drives = issubclass(kind, DRIVES)

    def withdraw(self) -> None:
        """This robot's node will never say anything here: nobody should wait for it. Call it in `start`."""
        self.offered = False

    def publish(self, message: M) -> None:
        """To all who listen; a command of a node that fails again and again goes nowhere, see `faults`."""
        if type(message) is not self.kind:
            raise TypeError(f"{self.topic} carries {self.kind.__name__}, not {type(message).__name__}")
        if not (self._drives and self._node.is_silenced):
            self._node.speak(self.topic, message, self.latched)


@dataclass(frozen=True)
class _Timer:
    period_ns: int


def every(*, hz: float) -> Callable[[Callable[[Any], None]], Callable[[Any], None]]:
    """Call the method at a fixed rate, after all messages of that instant."""

    def mark(method: Callable[[Any], None]) -> Callable[[Any], None]:
        method.every = _Timer(round(SECOND / hz))  # type: ignore[attr-defined]
        return method

    return mark


class Node:
    """Base of all nodes. Subclasses declare `params`, ports, handlers and `start`, and have no `__init__`."""

    is_device: ClassVar[bool] = False
    live_params: ClassVar[tuple[str, ...]] = ()
    """Params that it can take while it runs: dotted names, `*` for any part; all others need a new start."""
    params: Any

    def __init__(self, context: Context, params: Any) -> None:
        self.name = context.name
        self.robot = context.robot
        self.tf = context.transforms
        self.params = params
        self.context = context
        self._loop = context.loop
        self._subscriptions: list[Subscription] = []
        self._timers: list[Scheduled] = []
        self._tasks: list[Task[Any]] = []
        _bind_ports(self)
        self._start_timers()

    def start(self) -> None:
        """Set up; all ports are there and the other nodes of the launch exist."""

    def reconfigure(self, params: Any) -> None:
        """Take other params while running; only `live_params` differ. UserError where they do not go together.

        Enough for a node that reads `self.params` whenever it needs them.
        """
        self.params = params

    def stop(self) -> None:
        """Tasks are cancelled, nothing is heard any more."""
        for task in list(self._tasks):
            task.cancel()
        for subscription in self._subscriptions:
            self._loop.unsubscribe(subscription)
        for timer in self._timers:
            timer.cancel()

    @property
    def now_ns(self) -> int:
        """The loop's time."""
        return self._loop.now_ns

    @property
    def is_silenced(self) -> bool:
        """Whether it fails so often that it must not drive."""
        return self._loop.faults is not None and self._loop.faults.is_silenced(self.name)

    def listen(self, name: str, handler: Callable[[Message], None]) -> None:
        """Subscribe for the node's life."""
        self._subscriptions.append(self._loop.subscribe(name, self.name, handler))

    def speak(self, name: str, message: Message, latched: bool = False) -> None:
        """Publish in the node's name."""
        self._loop.publish(name, message, self.name, from_device=self.is_device, latched=latched)

    def resolve(self, name: str) -> str:
        """A topic's name after the launch file's remapping."""
        return self.context.remap.get(name, name)

    def spawn(self, work: Coroutine[Any, Any, T]) -> Task[T]:
        """Run a coroutine in the node's name; it ends with the node."""
        task = Task(work)
        self.adopt(task)
        return task.start()

    def adopt(self, task: Task[Any]) -> None:
        """Cancel the task when the node stops."""
        self._tasks.append(task)
        task.then(lambda: self._tasks.remove(task))

    def sleep(self, seconds: float) -> Future[None]:
        """`await` it: as long as a timer, in the loop's time."""
        future: Future[None] = Future()
        timing = self._loop.timing(self.name, f"{self.name}.sleep")
        self._loop.at(self.now_ns + round(seconds * SECOND), TIMER, partial(future.set, None), timing)
        return future

    def _start_timers(self) -> None:
        for name in dir(type(self)):
            timer = getattr(getattr(type(self), name, None), "every", None)
            if isinstance(timer, _Timer):
                self._repeat(timer.period_ns, getattr(self, name), name)

    def _repeat(self, period_ns: int, action: Callable[[], None], name: str) -> None:
        """Timers fall on multiples of their period, so two runs that start together stay together."""
        rank = DEVICE if self.is_device else TIMER
        slot = len(self._timers)
        timing = self._loop.timing(self.name, f"{self.name}.{name}", from_device=self.is_device)
        first = -(-(self.now_ns + 1) // period_ns) * period_ns

        def fire() -> None:
            self._timers[slot] = self._loop.at(self.now_ns + period_ns, rank, fire, timing)
            action()

        self._timers.append(self._loop.at(first, rank, fire, timing))


class Device(Node):
    """A node that touches the world; replays take it from the log. It publishes in timers and posts only."""

    is_device = True

    def __init__(self, context: Context, params: Any) -> None:
        self._later: list[Scheduled] = []
        self._outside = context.loop.timing(context.name, f"{context.name} from outside", from_device=True)
        super().__init__(context, params)

    def post(self, action: Callable[[], None]) -> None:
        """From any thread: do `action` in the loop."""
        self._loop.post(action, self._outside)

    def at(self, time_ns: int, action: Callable[[], None]) -> None:
        """Do `action` at that time of the loop's, unless the device has been stopped."""
        self._later = [event for event in self._later if event.due_ns > self.now_ns]
        self._later.append(self._loop.at(time_ns, DEVICE, action, self._outside))

    def stop(self) -> None:
        """Also what it meant to do later does not happen."""
        super().stop()
        for event in self._later:
            event.cancel()


def _bind_ports(node: Node) -> None:
    """Make what the class declares: In and Out by annotation, actions by value."""
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


def listens_to(kind: type[Node], message: type[Message]) -> bool:
    """Whether nodes of this class have an input of that type."""
    return any(
        typing.get_origin(hint) is In and typing.get_args(hint)[0] is message
        for hint in typing.get_type_hints(kind).values()
    )


def params_type(kind: type[Node]) -> type[msgspec.Struct]:
    """The struct that a node's parameters are read into."""
    return typing.cast(type[msgspec.Struct], typing.get_type_hints(kind)["params"])
