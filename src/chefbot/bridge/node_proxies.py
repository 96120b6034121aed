"""The nodes of a loop as nodes of ROS 2's graph: their publishers, subscriptions, actions, parameters, logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from chefbot.bridge.bridged_actions import CalledAction, ServedAction
from chefbot.bridge.inbox import WIRE, Inbox
from chefbot.bridge.local_only import INNER, NEVER_HEARD, Insiders
from chefbot.bridge.parameters import ParameterServices, to_value, with_values
from chefbot.bridge.ports import Ports, Topic
from chefbot.bridge.rosout import Rosout
from chefbot.errors import UserError
from chefbot.msgs.action_msgs import CancelGoal, GoalStatusArray
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.msgs.rcl_interfaces import Parameter, ParameterEvent
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.validity import check, check_stamp
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.graph import Named
from chefbot.ros2.rmw.names import WireType, resolve
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import (
    CLOCK,
    DEFAULT,
    FIXED_FRAMES,
    FRAMES,
    LATCHED,
    PARAMETERS,
    SENSOR,
    SENSOR_TYPES,
    QoS,
)
from chefbot.ros2.rmw.session import Wire
from chefbot.ros2.rmw.subscription import Subscription
from chefbot.ros2.rmw.tokens import CLIENT, SUBSCRIPTION
from chefbot.ros2.rmw.type_description import TypeDescriptions
from chefbot.runtime.loop import Publication
from chefbot.runtime.node import Node
from chefbot.runtime.node_container import System

LATCHED_BY_CUSTOM = frozenset({"map", "tf_static", "robot_description"})
Described = tuple[Node, Ports]


class _Ear(NamedTuple):
    """What hears a topic for all nodes of the process."""

    node: WireNode
    topic: Topic
    subscription: Subscription
    latched: bool


def _asked(topic: Topic, latched: bool) -> QoS:
    if topic.kind is TFMessage:
        return FIXED_FRAMES if latched else FRAMES
    return LATCHED if latched else SENSOR if topic.kind in SENSOR_TYPES else DEFAULT


def _offered(kind: type[Message], latched: bool) -> QoS:
    return LATCHED if latched else FRAMES if kind is TFMessage else DEFAULT


def _is_latched(named: Named, own: str) -> bool:
    """Whether some other session than `own` keeps there what it said."""
    return any(one.end.qos.latched for one in named.givers if one.node.zid != own)


def _announce_calls(node: WireNode, name: str, action: Action[Any, Any, Any]) -> None:
    """What a client of ROS 2 has; by the feedback that it hears `ros2 node info` knows it (rcl_action/graph.c)."""
    for part, kind, end, qos in (
        ("send_goal", WireType.of(action.send_goal_service), CLIENT, DEFAULT),
        ("get_result", WireType.of(action.get_result_service), CLIENT, DEFAULT),
        ("cancel_goal", WireType.of(CancelGoal), CLIENT, DEFAULT),
        ("feedback", WireType.of(action.feedback_message), SUBSCRIPTION, DEFAULT),
        ("status", WireType.of(GoalStatusArray), SUBSCRIPTION, LATCHED),
    ):
        node.announce(end, f"{name}/_action/{part}", kind, qos)


def ears_of(own: str) -> str:
    """The node that hears transforms for all of a process; it comes last of its nodes."""
    return f"{own}_tf"


class Represented:
    """Belongs to the bridge's thread, but for `publishers`, which the loop's thread looks into.

    `names`: the namespace of all, and the name of the node that speaks for the process itself.
    """

    def __init__(
        self, wire: Wire, names: tuple[str, str], inbox: Inbox, system: System, simulated: bool
    ) -> None:
        self._wire, (self._namespace, self._self), self._inbox = wire, names, inbox
        self._system, self._simulated = system, simulated
        self.publishers: dict[tuple[str, str], Publisher[Any]] = {}
        """By the loop's names of node and topic."""
        self._nodes: dict[str, WireNode] = {}
        self._rosout: dict[str, Rosout] = {}
        self._actions: dict[str, ServedAction | CalledAction] = {}
        self._heard: dict[str, _Ear] = {}
        self._latched = LATCHED_BY_CUSTOM
        self._insiders = Insiders(wire.graph, self._namespace)
        self.own = self._add(self._self)
        self.own_rosout = self._rosout[self._self] = Rosout(self.own)
        self._clock: Publisher[Clock] | None = None

    def strangers(self, topic: str) -> list[str]:
        """Who else publishes on a topic that a node of this process publishes on; full names of nodes."""
        if all(name != topic for _, name in self.publishers):
            return []
        return self._insiders.strangers(resolve(topic, self._namespace))

    def show(self, described: Sequence[Described], latched: frozenset[str]) -> None:
        """These nodes, and the launch's own; `latched` topics are asked for what was said before."""
        for name in [name for name in self._nodes if name != self._self]:
            self._remove(name)
        self._actions.clear()
        self._heard.clear()
        self._latched = latched | LATCHED_BY_CUSTOM
        served = {name for _, ports in described for name, _ in ports.serves}
        for node, ports in described:
            self._show_node(node, ports, served)
        ears = self._add(ears_of(self._self))  # anew with the others, else each launch would add two more
        for topic in ("tf", "tf_static"):
            self._listen(ears, Topic(topic, TFMessage))
        self.listen_again()

    def close(self) -> None:
        """All go."""
        for name in list(self._nodes):
            self._remove(name)

    def publisher(self, publication: Publication) -> Publisher[Any]:
        """The end through which this goes out; made now if the node never told of it."""
        key = (publication.publisher, publication.topic)
        if key not in self.publishers:
            node = self._nodes.get(publication.publisher, self.own)
            kind = type(publication.message)
            qos = _offered(kind, publication.latched)
            self.publishers[key] = node.publisher(publication.topic, kind, qos)
        return self.publishers[key]

    def action(self, name: str, publication: Publication) -> ServedAction | CalledAction | None:
        """Who carries an action's message out; nobody if it is a call that came from outside."""
        bridged = self._actions.get(name)
        from_outside = publication.publisher == WIRE
        return None if from_outside and isinstance(bridged, CalledAction) else bridged

    def offer_clock(self) -> None:
        """From the start: whoever joins sees by it that this robot is simulated.

        Below the namespace, as each of several simulated robots has a time of its own.
        """
        self._clock = self.own.publisher("clock", Clock, CLOCK)

    def tell_clock(self, clock: Clock) -> None:
        """The simulation's."""
        assert self._clock is not None, "it was offered"
        self._clock.publish(clock)

    def log(self, publication: Publication) -> None:
        """/rosout, if it is something to be told there."""
        rosout = self._rosout.get(publication.publisher, self._rosout[self._self])
        rosout.hear(publication)

    def _show_node(self, node: Node, ports: Ports, served: set[str]) -> None:
        wire_node = self._add(node.name)
        for topic in ports.outs:
            qos = _offered(topic.kind, topic.latched)
            self.publishers[node.name, topic.name] = wire_node.publisher(topic.name, topic.kind, qos)
        for topic in ports.ins:
            self._listen(wire_node, topic)
        for name, action in ports.serves:
            self._actions[name] = ServedAction(wire_node, name, action, self._say_action)
        for name, action in ports.calls:
            self._call(wire_node, name, action, name in served)
        self._rosout[node.name] = Rosout(wire_node)
        events = wire_node.publisher("/parameter_events", ParameterEvent, PARAMETERS)
        setter = partial(self._set_params, node, events)
        ParameterServices(
            wire_node, lambda: node.params, setter, live=node.live_params, simulated=self._simulated
        )
        TypeDescriptions(wire_node)

    def listen_again(self) -> None:
        """Where others speak to those who come late, too, ask for what was said before.

        Who they are is not known at the start: another machine's launch, a ROS 2 node, a robot that comes later.
        """
        topics = self._wire.graph.topics()
        for name, ear in self._heard.items():
            said = topics.get(resolve(name, self._namespace))
            if not ear.latched and said is not None and _is_latched(said, self._wire.zid):
                ear.node.drop(ear.subscription)
                self._heard[name] = self._open_ear(ear.node, ear.topic, latched=True)

    def _listen(self, node: WireNode, topic: Topic) -> None:
        """Samples come once for all nodes that listen: the loop gives them to each."""
        if topic.name in NEVER_HEARD:
            return
        latched = topic.name in self._latched
        if topic.name in self._heard:
            node.announce(SUBSCRIPTION, topic.name, WireType.of(topic.kind), _asked(topic, latched))
        else:
            self._heard[topic.name] = self._open_ear(node, topic, latched)

    def _open_ear(self, node: WireNode, topic: Topic, latched: bool) -> _Ear:
        take, qos = partial(self._take, topic.name, latched), _asked(topic, latched)
        if topic.kind in INNER:
            judged = partial(self._take_inner, topic, take)
            subscription = node.raw_subscription(topic.name, WireType.of(topic.kind), judged, qos)
        else:
            subscription = node.subscription(topic.name, topic.kind, take, qos)
        return _Ear(node, topic, subscription, latched)

    def _take(self, name: str, latched: bool, message: Message) -> None:
        """From outside, in Zenoh's thread; what is invalid is counted by the subscription."""
        check(message)
        if name != "tf_static":
            check_stamp(message, self._system.loop.now_ns)
        self._inbox.say(name, message, latched=latched)

    def _take_inner(
        self, topic: Topic, take: Callable[[Message], None], data: bytes, attachment: Attachment
    ) -> None:
        """The same from a process of this robot, and from nobody else."""
        self._insiders.check(resolve(topic.name, self._namespace), attachment.gid)
        take(topic.kind.from_cdr(data))

    def _call(self, node: WireNode, name: str, action: Action[Any, Any, Any], served_here: bool) -> None:
        if served_here or name in self._actions:
            _announce_calls(node, name, action)
            return
        now = lambda: self._system.loop.now_ns  # noqa: E731
        self._actions[name] = CalledAction(node, name, action, self._say_action, now)

    def _say_action(self, topic: str, message: Message) -> None:
        self._inbox.say(topic, message, depth=1000)

    def _set_params(
        self, node: Node, events: Publisher[ParameterEvent], values: dict[str, Any], done: Any
    ) -> None:
        """Any thread: the change itself is made by the loop."""

        def change() -> None:
            try:
                plain = with_values(node.params, values)
                self._system.set_params(node.name, plain, WIRE)
            except UserError as error:
                done(str(error))
                return
            changed = tuple(Parameter(name, to_value(value)) for name, value in values.items())
            stamp = Time.of(self._system.loop.now_ns)
            full_name = f"{self._namespace.rstrip('/')}/{node.name}"
            events.publish(ParameterEvent(stamp, full_name, changed_parameters=changed))
            done("")

        loop = self._system.loop
        loop.post(change, loop.timing(node.name, f"{node.name} <- parameters"))

    def _add(self, name: str) -> WireNode:
        try:
            self._nodes[name] = WireNode(self._wire, name, self._namespace, remote_only=True)
        except WireError as error:
            raise UserError(f"node {name!r} cannot be on the wire: {error}") from None
        return self._nodes[name]

    def _remove(self, name: str) -> None:
        self._rosout.pop(name, None)
        self.publishers = {key: one for key, one in self.publishers.items() if key[0] != name}
        self._nodes.pop(name).close()
