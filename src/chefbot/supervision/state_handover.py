"""State of a launch's worker processes, kept by the launch process and restored after a restart."""

from __future__ import annotations

import threading
import typing
from functools import partial

import msgspec

from chefbot.config import build
from chefbot.errors import ChefbotError
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.rcl_interfaces import ParameterEvent
from chefbot.msgs.std_msgs import Empty
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import PARAMETERS, TRANSIENT_LOCAL_QOS
from chefbot.runtime.launch import Launch, NodeEntry, node_class, node_params, split_by_process
from chefbot.runtime.live_params import changed_params, is_live
from chefbot.runtime.node import RESTARTED, RESTORED_PREFIX, TopicSpec
from chefbot.runtime.node_container import PARAMS_TOPIC, NodeContainer, params_message
from chefbot.runtime.param_values import with_values
from chefbot.runtime.transform_buffer import TransformError

MAP_TRANSFORM_TOPIC = "tf"
"""Topic of the map's transform, restored from the transform buffer; other processes keep publishing the rest
of the tree."""


class StoredMessage(msgspec.Struct, frozen=True):
    """A serialized message and the loop's topic on which it is restored."""

    topic: str
    type_name: str
    """Message type, as 'nav_msgs/msg/OccupancyGrid'."""
    cdr: bytes

    @staticmethod
    def serialize(topic: str, message: Message) -> StoredMessage:
        """Serialize a message for a topic."""
        return StoredMessage(topic, InterfaceType.of(type(message)).name, message.to_cdr())

    def deserialize(self) -> Message:
        """Deserialize the stored message and return it."""
        return message_type(self.type_name).from_cdr(self.cdr)


class StateHandover:
    """Stores the last messages and parameter changes of nodes in the launch's worker processes.

    As long as `node` exists it subscribes to the topics that these nodes declare with `restored`, and to
    /parameter_events. The launch process stores them because a transient-local publisher's history dies with
    its process.
    """

    def __init__(self, node: RmwNode, launch: Launch, system: NodeContainer) -> None:
        self._system = system
        self._namespace = str(launch.args["namespace"]).rstrip("/")
        parts = split_by_process(launch)[1]
        self._messages: dict[str, dict[str, StoredMessage]] = {}
        self._entries = {name: entry for part in parts.values() for name, entry in part.nodes.items()}
        self._params: dict[str, msgspec.Struct] = {}
        """Parameters of nodes that were changed at run time, by node name."""
        self._lock = threading.Lock()
        node.subscription("/parameter_events", ParameterEvent, self._on_parameter_event, PARAMETERS)
        for process, part in parts.items():
            self._messages[process] = {}
            for entry in part.nodes.values():
                self._subscribe(node, process, entry)

    def restored_messages(self, process: str) -> tuple[StoredMessage, ...]:
        """Return the messages that restore the state of a process after a restart (thread-safe)."""
        with self._lock:
            messages = (*self._changed_params_of(process), *self._messages[process].values())
        return (*messages, *self._map_transform(), StoredMessage.serialize(RESTARTED, Empty()))

    def _subscribe(self, node: RmwNode, process: str, entry: NodeEntry) -> None:
        for topic, kind in restored_topics(entry):
            if topic not in (MAP_TRANSFORM_TOPIC, RESTARTED):
                wire_type = InterfaceType.of(kind)
                callback = partial(self._store, process, topic, wire_type.name)
                node.raw_subscription(entry.remap.get(topic, topic), wire_type, callback, TRANSIENT_LOCAL_QOS)

    def _store(self, process: str, topic: str, kind: str, cdr: bytes, _: object) -> None:
        with self._lock:
            self._messages[process][topic] = StoredMessage(topic, kind, cdr)

    def _on_parameter_event(self, event: ParameterEvent) -> None:
        """Store parameters that a node accepted at run time.

        Raises RmwError for values that the node cannot have accepted.
        """
        namespace, _, name = event.node.rpartition("/")
        entry = self._entries.get(name)
        if namespace != self._namespace or entry is None:
            return
        values = {parameter.name: parameter.value.plain for parameter in event.changed_parameters}
        node_type, where = node_class(entry.kind, "state handover"), f"node {name}: params"
        with self._lock:
            current = self._params.get(name) or node_params(node_type, entry.params, where)
            try:
                requested = build(with_values(current, values), type(current), where)
            except (ChefbotError, LookupError, TypeError) as error:
                raise RmwError(f"not stored for a restart of {name}: {error}") from None
            if not all(
                is_live(parameter, node_type.live_params) for parameter in changed_params(current, requested)
            ):
                raise RmwError(f"not stored for a restart of {name}: it is read only when it starts")
            self._params[name] = requested

    def _changed_params_of(self, process: str) -> list[StoredMessage]:
        """Return all parameters of each node of `process` whose values differ from the launch file."""
        return [
            StoredMessage.serialize(
                PARAMS_TOPIC, params_message(name, msgspec.to_builtins(self._params[name]))
            )
            for name, entry in self._entries.items()
            if entry.process == process and name in self._params
        ]

    def _map_transform(self) -> tuple[StoredMessage, ...]:
        """Return the last map-to-odom transform, if one was ever published."""
        try:
            pose = self._system.transforms.lookup("map", "odom")
        except TransformError:
            return ()
        stamp = self._system.loop.now_ns
        return (
            StoredMessage.serialize(
                MAP_TRANSFORM_TOPIC, TFMessage((TransformStamped.of(stamp, "map", "odom", pose),))
            ),
        )


def restored_topics(entry: NodeEntry) -> list[tuple[str, type[Message]]]:
    """Return the topics (before remapping) whose last message a node wants restored, with their types."""
    node_type = node_class(entry.kind, "state handover")
    ports = (
        (getattr(node_type, name, None), hint) for name, hint in typing.get_type_hints(node_type).items()
    )
    return [
        (spec.name.removeprefix(RESTORED_PREFIX), typing.get_args(hint)[0])
        for spec, hint in ports
        if isinstance(spec, TopicSpec) and spec.name.startswith(RESTORED_PREFIX)
    ]
