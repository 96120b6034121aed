"""Proxies of a loop's nodes in the ROS 2 graph: publishers, subscriptions, actions, parameters, logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from chefbot.bridge.bridged_actions import ActionClientBridge, ActionServerBridge
from chefbot.bridge.inbox import WIRE_PUBLISHER, Inbox
from chefbot.bridge.local_only import LOCAL_ONLY_TYPES, LOCAL_TOPICS, MAP_TYPES, LocalProcessFilter
from chefbot.bridge.parameters import ParameterServices, to_value
from chefbot.bridge.ports import LaunchPorts, Ports, Topic
from chefbot.bridge.rosout import Rosout
from chefbot.errors import ChefbotError, UserError
from chefbot.msgs.action_msgs import CancelGoal, GoalStatusArray
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.msgs.rcl_interfaces import Parameter, ParameterEvent
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.validity import check, check_stamp
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.graph import EndpointGroup
from chefbot.ros2.rmw.liveliness import CLIENT, SUBSCRIPTION
from chefbot.ros2.rmw.names import InterfaceType, resolve
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import (
    CLOCK,
    DEFAULT,
    PARAMETERS,
    SENSOR_DATA,
    SENSOR_TYPES,
    TF,
    TF_STATIC,
    TRANSIENT_LOCAL_QOS,
    QoS,
)
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.rmw.subscription import Subscription
from chefbot.ros2.rmw.type_description import serve_type_descriptions
from chefbot.runtime.loop import Publication
from chefbot.runtime.node import Node
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.param_values import with_values

LATCHED_BY_CONVENTION = frozenset({"map", "tf_static", "robot_description"})
NodeWithPorts = tuple[Node, Ports]


class _SharedSubscription(NamedTuple):
    """The one subscription to a topic for all nodes of the process."""

    node: RmwNode
    topic: Topic
    subscription: Subscription
    latched: bool


def _subscription_qos(topic: Topic, latched: bool) -> QoS:
    if topic.kind is TFMessage:
        return TF_STATIC if latched else TF
    return TRANSIENT_LOCAL_QOS if latched else SENSOR_DATA if topic.kind in SENSOR_TYPES else DEFAULT


def _publisher_qos(kind: type[Message], latched: bool) -> QoS:
    return TRANSIENT_LOCAL_QOS if latched else TF if kind is TFMessage else DEFAULT


def _is_latched(endpoints: EndpointGroup, own: str) -> bool:
    """Return whether a session other than `own` has a transient-local publisher there."""
    return any(publisher.info.qos.latched for publisher in endpoints.providers if publisher.node.zid != own)


def _announce_action_client(node: RmwNode, name: str, action: Action[Any, Any, Any]) -> None:
    """Announce the endpoints of a ROS 2 action client (rcl_action/graph.c).

    `ros2 node info` recognizes one by its subscription to the feedback topic.
    """
    for part, kind, end, qos in (
        ("send_goal", InterfaceType.of(action.send_goal_service), CLIENT, DEFAULT),
        ("get_result", InterfaceType.of(action.get_result_service), CLIENT, DEFAULT),
        ("cancel_goal", InterfaceType.of(CancelGoal), CLIENT, DEFAULT),
        ("feedback", InterfaceType.of(action.feedback_message), SUBSCRIPTION, DEFAULT),
        ("status", InterfaceType.of(GoalStatusArray), SUBSCRIPTION, TRANSIENT_LOCAL_QOS),
    ):
        node.announce(end, f"{name}/_action/{part}", kind, qos)


def tf_listener_name(own: str) -> str:
    """Return the name of the node that subscribes to transforms for a process.

    It is created after all other nodes of the process.
    """
    return f"{own}_tf"


class NodeProxies:
    """Proxies of the loop's nodes in the ROS 2 graph.

    Only the bridge's thread may use it, except `publishers`, which the loop's thread reads.

    `names`: the namespace of all, and the name of the node that represents the process itself.
    """

    def __init__(
        self, wire: RmwContext, names: tuple[str, str], inbox: Inbox, system: NodeContainer, simulated: bool
    ) -> None:
        self._wire, (self._namespace, self._own_name), self._inbox = wire, names, inbox
        self._system, self._simulated = system, simulated
        self.publishers: dict[tuple[str, str], Publisher[Any]] = {}
        """Publishers by the loop's names of node and topic."""
        self._nodes: dict[str, RmwNode] = {}
        self._rosout: dict[str, Rosout] = {}
        self._actions: dict[str, ActionServerBridge | ActionClientBridge] = {}
        self._subscriptions: dict[str, _SharedSubscription] = {}
        self._launch = LaunchPorts(LATCHED_BY_CONVENTION)
        self._own_latched: frozenset[str] = frozenset()
        self._process_filter = LocalProcessFilter(wire.graph, self._namespace)
        self.own = self._add(self._own_name)
        self.own_rosout = self._rosout[self._own_name] = Rosout(self.own)
        self._clock: Publisher[Clock] | None = None

    def foreign_publishers(self, topic: str) -> list[str]:
        """Return the full names of foreign nodes that publish on a topic.

        The list is empty if no node of this process publishes on it.
        """
        if all(name != topic for _, name in self.publishers):
            return []
        return self._process_filter.foreign_publishers(resolve(topic, self._namespace))

    def update_nodes(self, described: Sequence[NodeWithPorts], launch: LaunchPorts) -> None:
        """Represent these nodes, and the process itself, as parts of the launch."""
        self._abandon_goals()
        for name in [name for name in self._nodes if name != self._own_name]:
            self._remove(name)
        self._actions.clear()
        self._subscriptions.clear()
        self._launch = launch._replace(latched=launch.latched | LATCHED_BY_CONVENTION)
        self._own_latched = launch.latched
        served = {name for _, ports in described for name, _ in ports.action_servers}
        for node, ports in described:
            self._add_proxy(node, ports, served)
        tf_listener = self._add(
            tf_listener_name(self._own_name)
        )  # created again with the others, else each launch would add two subscriptions
        for topic in ("tf", "tf_static"):
            self._subscribe(tf_listener, Topic(topic, TFMessage))
        self.subscribe_to_latched()

    def close(self) -> None:
        """Remove all nodes from the graph."""
        self._abandon_goals()
        for name in list(self._nodes):
            self._remove(name)

    def publisher(self, publication: Publication) -> Publisher[Any]:
        """Return the publisher for a message; it is created now if the node did not declare it."""
        key = (publication.publisher, publication.topic)
        if key not in self.publishers:
            node = self._nodes.get(publication.publisher, self.own)
            kind = type(publication.message)
            qos = _publisher_qos(kind, publication.latched)
            self.publishers[key] = node.publisher(publication.topic, kind, qos)
        return self.publishers[key]

    def action(self, name: str, publication: Publication) -> ActionServerBridge | ActionClientBridge | None:
        """Return the bridged action that handles a message.

        None for a call that was received from the wire.
        """
        bridged = self._actions.get(name)
        from_outside = publication.publisher == WIRE_PUBLISHER
        return None if from_outside and isinstance(bridged, ActionClientBridge) else bridged

    def advertise_clock(self) -> None:
        """Advertise /clock from the start, so that those who join see that this robot is simulated.

        The topic is in the robot's namespace, as each of several simulated robots has a time of its own.
        """
        self._clock = self.own.publisher("clock", Clock, CLOCK)

    def publish_clock(self, clock: Clock) -> None:
        """Publish the simulation's time on the clock topic."""
        assert self._clock is not None, "it was offered"
        self._clock.publish(clock)

    def log(self, publication: Publication) -> None:
        """Publish the message on /rosout if it is to be logged there."""
        rosout = self._rosout.get(publication.publisher, self._rosout[self._own_name])
        rosout.log_publication(publication)

    def _add_proxy(self, node: Node, ports: Ports, served: set[str]) -> None:
        wire_node = self._add(node.name)
        for topic in (port for port in ports.publishers if port.name not in LOCAL_TOPICS):
            qos = _publisher_qos(topic.kind, topic.latched)
            self.publishers[node.name, topic.name] = wire_node.publisher(topic.name, topic.kind, qos)
        for topic in ports.subscriptions:
            self._subscribe(wire_node, topic)
        for name, action in ports.action_servers:
            self._actions[name] = ActionServerBridge(wire_node, name, action, self._post_action)
        for name, action in ports.action_clients:
            self._add_action_client(wire_node, name, action, name in served)
        self._rosout[node.name] = Rosout(wire_node)
        self._serve_params(wire_node, node)
        serve_type_descriptions(wire_node)

    def _serve_params(self, wire_node: RmwNode, node: Node) -> None:
        events = wire_node.publisher("/parameter_events", ParameterEvent, PARAMETERS)
        setter = partial(self._set_params, node, events)
        ParameterServices(
            wire_node,
            lambda: self._running(node).params,
            setter,
            live=node.live_params,
            simulated=self._simulated,
        )

    def _running(self, node: Node) -> Node:
        """Return the node of that name that runs now: it may have been created again."""
        return self._system.nodes.get(node.name, node)

    def subscribe_to_latched(self) -> None:
        """Subscribe transient local, and so receive stored messages, where others publish so.

        The other publishers are not known at the start: another machine's launch, a ROS 2 node, a robot that
        comes later.
        """
        topics = self._wire.graph.topics()
        for name, shared in self._subscriptions.items():
            endpoints = topics.get(resolve(name, self._namespace))
            if not shared.latched and endpoints is not None and _is_latched(endpoints, self._wire.zid):
                shared.node.destroy(shared.subscription)
                self._subscriptions[name] = self._subscribe_once(shared.node, shared.topic, latched=True)

    def _subscribe(self, node: RmwNode, topic: Topic) -> None:
        """Subscribe once for all nodes of the process: the loop passes each message to every node."""
        if topic.name in LOCAL_TOPICS:
            return
        latched = topic.name in self._launch.latched
        if topic.name in self._subscriptions:
            node.announce(
                SUBSCRIPTION, topic.name, InterfaceType.of(topic.kind), _subscription_qos(topic, latched)
            )
        else:
            self._subscriptions[topic.name] = self._subscribe_once(node, topic, latched)

    def _subscribe_once(self, node: RmwNode, topic: Topic, latched: bool) -> _SharedSubscription:
        callback, qos = partial(self._on_message, topic.name, latched), _subscription_qos(topic, latched)
        own_map = topic.kind in MAP_TYPES and topic.name in self._own_latched
        if topic.kind in LOCAL_ONLY_TYPES or own_map:
            accept = self._process_filter.check_map if own_map else self._process_filter.check
            filtered = partial(self._on_filtered_message, topic, accept, callback)
            subscription = node.raw_subscription(topic.name, InterfaceType.of(topic.kind), filtered, qos)
        else:
            subscription = node.subscription(topic.name, topic.kind, callback, qos)
        return _SharedSubscription(node, topic, subscription, latched)

    def _on_message(self, name: str, latched: bool, message: Message) -> None:
        """Post a received message to the loop; runs in Zenoh's thread.

        An invalid message raises, and is counted by the subscription.
        """
        check(message)
        if name != "tf_static":
            check_stamp(message, self._system.loop.now_ns)
        self._inbox.publish(name, message, latched=latched)

    def _on_filtered_message(
        self,
        topic: Topic,
        accept: Callable[[str, bytes], None],
        callback: Callable[[Message], None],
        data: bytes,
        attachment: Attachment,
    ) -> None:
        """Post a received message to the loop if its publisher may send it; `accept` raises RmwError if not."""
        accept(resolve(topic.name, self._namespace), attachment.gid)
        callback(topic.kind.from_cdr(data))

    def _add_action_client(
        self, node: RmwNode, name: str, action: Action[Any, Any, Any], served_here: bool
    ) -> None:
        if served_here or name in self._actions:
            _announce_action_client(node, name, action)
            return
        now = lambda: self._system.loop.now_ns  # noqa: E731
        self._actions[name] = ActionClientBridge(
            node, name, action, self._post_action, now, server_starts=name in self._launch.actions
        )

    def _abandon_goals(self) -> None:
        """Stop waiting for action servers, before the clients of these actions are closed."""
        for bridged in self._actions.values():
            if isinstance(bridged, ActionClientBridge):
                bridged.close()

    def _post_action(self, topic: str, message: Message) -> None:
        self._inbox.publish(topic, message, depth=1000)

    def _set_params(
        self, node: Node, events: Publisher[ParameterEvent], values: dict[str, Any], done: Any
    ) -> None:
        """Set parameters of a node from any thread: the change itself is made in the loop."""

        def change() -> None:
            try:
                plain = with_values(self._running(node).params, values)
                self._system.set_params(node.name, plain, WIRE_PUBLISHER)
            except ChefbotError as error:
                done(str(error))
                return
            changed = tuple(Parameter(name, to_value(value)) for name, value in values.items())
            stamp = Time.of(self._system.loop.now_ns)
            full_name = f"{self._namespace.rstrip('/')}/{node.name}"
            events.publish(ParameterEvent(stamp, full_name, changed_parameters=changed))
            done("")

        loop = self._system.loop
        loop.post(change, loop.timing(node.name, f"{node.name} <- parameters"))

    def _add(self, name: str) -> RmwNode:
        try:
            self._nodes[name] = RmwNode(self._wire, name, self._namespace, remote_only=True)
        except RmwError as error:
            raise UserError(f"node {name!r} cannot be on the wire: {error}") from None
        return self._nodes[name]

    def _remove(self, name: str) -> None:
        self._rosout.pop(name, None)
        self.publishers = {key: publisher for key, publisher in self.publishers.items() if key[0] != name}
        self._nodes.pop(name).close()
