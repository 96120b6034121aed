"""What a process of a launch said last to those who come late: kept by its launch, told to its next life."""

from __future__ import annotations

import threading
import typing
from functools import partial

import msgspec

from chefbot.bridge.parameters import from_value, with_values
from chefbot.config import build
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.rcl_interfaces import ParameterEvent
from chefbot.msgs.std_msgs import Empty
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos import LATCHED, PARAMETERS
from chefbot.runtime.launch import Launch, NodeEntry, node_class, node_params, split
from chefbot.runtime.live_params import changed_params, is_live
from chefbot.runtime.node import LAST_WORDS, LIFE, TopicSpec
from chefbot.runtime.node_container import PARAMS_TOPIC, System, params_message
from chefbot.runtime.transform_buffer import TransformError

FRAMES = "tf"
"""Where the map is, as its owner said last; the rest of the tree goes on being told by others."""


class Word(msgspec.Struct, frozen=True):
    """A message, as bytes, and the topic of the loop that it stands for."""

    topic: str
    kind: str
    """'nav_msgs/msg/OccupancyGrid'"""
    cdr: bytes

    @staticmethod
    def of(topic: str, message: Message) -> Word:
        """Of a message that is none yet."""
        return Word(topic, WireType.of(type(message)).name, message.to_cdr())

    def message(self) -> Message:
        """What was said."""
        return message_type(self.kind).from_cdr(self.cdr)


class LastWords:
    """Listens, as long as `node` is there, to what nodes of the launch's other processes declare with `last_words`,
    and to what their parameters were set to.

    A launch's own process hears it for them: what a publisher keeps for those who come late dies with it.
    """

    def __init__(self, node: WireNode, launch: Launch, system: System) -> None:
        self._system = system
        self._space = str(launch.args["namespace"]).rstrip("/")
        parts = split(launch)[1]
        self._said: dict[str, dict[str, Word]] = {}
        self._entries = {name: entry for part in parts.values() for name, entry in part.nodes.items()}
        self._params: dict[str, msgspec.Struct] = {}
        """Of nodes whose parameters were set while they ran."""
        self._lock = threading.Lock()
        node.subscription("/parameter_events", ParameterEvent, self._note, PARAMETERS)
        for process, part in parts.items():
            self._said[process] = {}
            for entry in part.nodes.values():
                self._listen(node, process, entry)

    def of(self, process: str) -> tuple[Word, ...]:
        """What its next life is told; any thread."""
        with self._lock:
            words = (*self._params_of(process), *self._said[process].values())
        return (*words, *self._frames(), Word.of(LIFE, Empty()))

    def _listen(self, node: WireNode, process: str, entry: NodeEntry) -> None:
        for topic, kind in wanted(entry):
            if topic not in (FRAMES, LIFE):
                wire_type = WireType.of(kind)
                keep = partial(self._keep, process, topic, wire_type.name)
                node.raw_subscription(entry.remap.get(topic, topic), wire_type, keep, LATCHED)

    def _keep(self, process: str, topic: str, kind: str, cdr: bytes, _: object) -> None:
        with self._lock:
            self._said[process][topic] = Word(topic, kind, cdr)

    def _note(self, event: ParameterEvent) -> None:
        """Parameters that a node has taken while it ran; WireError for what it cannot have taken."""
        space, _, name = event.node.rpartition("/")
        entry = self._entries.get(name)
        if space != self._space or entry is None:
            return
        values = {one.name: from_value(one.value) for one in event.changed_parameters}
        kind, where = node_class(entry.kind, "last words"), f"node {name}: params"
        with self._lock:
            known = self._params.get(name) or node_params(kind, entry.params, where)
            try:
                wanted = build(with_values(known, values), type(known), where)
            except (UserError, LookupError, TypeError) as error:
                raise WireError(f"not kept for the next life of {name}: {error}") from None
            if not all(is_live(one, kind.live_params) for one in changed_params(known, wanted)):
                raise WireError(f"not kept for the next life of {name}: it is read only when it starts")
            self._params[name] = wanted

    def _params_of(self, process: str) -> list[Word]:
        """All params of those nodes that no longer have what the launch file says."""
        return [
            Word.of(PARAMS_TOPIC, params_message(name, msgspec.to_builtins(self._params[name])))
            for name, entry in self._entries.items()
            if entry.process == process and name in self._params
        ]

    def _frames(self) -> tuple[Word, ...]:
        """The map's place, if anybody has ever said it."""
        try:
            pose = self._system.transforms.lookup("map", "odom")
        except TransformError:
            return ()
        stamp = self._system.loop.now_ns
        return (Word.of(FRAMES, TFMessage((TransformStamped.of(stamp, "map", "odom", pose),))),)


def wanted(entry: NodeEntry) -> list[tuple[str, type[Message]]]:
    """Topics, not remapped, whose last words a node wants to be told, and their types."""
    kind = node_class(entry.kind, "last words")
    ports = ((getattr(kind, name, None), hint) for name, hint in typing.get_type_hints(kind).items())
    return [
        (spec.name.removeprefix(LAST_WORDS), typing.get_args(hint)[0])
        for spec, hint in ports
        if isinstance(spec, TopicSpec) and spec.name.startswith(LAST_WORDS)
    ]
