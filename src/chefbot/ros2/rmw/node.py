"""A node in the ROS graph: it creates endpoints and announces them with liveliness tokens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import zenoh

from chefbot.msgs.idl.cdr import decode
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.service import Service
from chefbot.ros2.rmw.attachment import parse
from chefbot.ros2.rmw.liveliness import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION, EndpointInfo, NodeId, Token
from chefbot.ros2.rmw.names import (
    InterfaceType,
    check_namespace,
    check_node_name,
    has_byte_array,
    may_have_byte_array,
    resolve,
    topic_key,
)
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import DEFAULT, QoS
from chefbot.ros2.rmw.service import TIMEOUT, Client, Server, ServiceCall
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.rmw.subscription import RawSampleCallback, SampleCallback, Subscription

M = TypeVar("M", bound=Message)
Q = TypeVar("Q", bound=Message)
S = TypeVar("S", bound=Message)
CPU_BACKEND = "backends:cpu:"
"""Requests plain bytes for types with `uint8[]` from newer rmw_zenoh; older versions ignore it."""


class RmwNode:
    """A node in the ROS graph; names are resolved in its namespace.

    With `remote_only` its subscriptions and servers ignore data from this process. Raises RmwError for a
    name that ROS would reject.
    """

    def __init__(
        self, wire: RmwContext, name: str, namespace: str = "/", *, remote_only: bool = False
    ) -> None:
        self.wire = wire
        self.id = NodeId(
            wire.domain, wire.zid, wire.next_id(), check_namespace(namespace), check_node_name(name)
        )
        self._remote_only = remote_only
        self._entities: dict[Any, zenoh.LivelinessToken] = {}
        """Publishers, subscriptions, servers and clients, each with its liveliness token."""
        self._tokens = [self._declare(Token(self.id))]
        """Tokens of the node itself and of endpoints that other entities serve."""

    @property
    def full_name(self) -> str:
        """Full name of the node, such as '/robot1/base'."""
        return self.id.full_name

    def publisher(self, topic: str, kind: type[M], qos: QoS = DEFAULT) -> Publisher[M]:
        """Create a publisher of messages of class `kind`."""
        return self.raw_publisher(topic, InterfaceType.of(kind), qos)

    def raw_publisher(self, topic: str, kind: InterfaceType, qos: QoS = DEFAULT) -> Publisher[Any]:
        """Create a publisher of CDR bytes (`publish_cdr`), also for types without a message class here."""
        token = self._endpoint_token(PUBLISHER, topic, kind, qos)
        return self._add_entity(Publisher[Any](self.wire, self._key(token), qos, token.gid), token)

    def subscription(
        self, topic: str, kind: type[M], callback: Callable[[M], None], qos: QoS = DEFAULT
    ) -> Subscription:
        """Create a subscription that calls `callback(message)` in a Zenoh thread.

        Data that is not a valid message of the type is counted and rejected.
        """

        def on_sample(data: bytes, _: bytes) -> None:
            callback(decode(kind, data))

        return self._subscribe(topic, InterfaceType.of(kind), on_sample, qos, has_byte_array(kind))

    def raw_subscription(
        self, topic: str, kind: InterfaceType, receive: SampleCallback, qos: QoS = DEFAULT
    ) -> Subscription:
        """Create a subscription that calls `receive(cdr bytes, attachment)` in a Zenoh thread.

        Types without a message class here can be received too.
        """

        def on_sample(data: bytes, attachment: bytes) -> None:
            receive(data, parse(attachment))

        return self._subscribe(topic, kind, on_sample, qos, may_have_byte_array(kind))

    def _subscribe(
        self, topic: str, kind: InterfaceType, on_sample: RawSampleCallback, qos: QoS, byte_array: bool
    ) -> Subscription:
        buffered = byte_array and not qos.latched
        backends = CPU_BACKEND if buffered else ""
        token = self._endpoint_token(SUBSCRIPTION, topic, kind, qos, backends)
        subscription = Subscription(
            self.wire,
            self._key(token),
            qos,
            on_sample,
            topic=_topic_of(token),
            remote_only=self._remote_only,
            buffered=buffered,
        )
        return self._add_entity(subscription, token)

    def server(
        self,
        name: str,
        service: Service[Q, S],
        handler: Callable[[ServiceCall[Q, S]], None],
        qos: QoS = DEFAULT,
    ) -> Server[Q, S]:
        """Create a service server; `handler(call)` runs in a Zenoh thread.

        `call.answer(response)` may be called at once or later.
        """
        token = self._endpoint_token(SERVER, name, InterfaceType.of(service), qos)
        server = Server[Q, S](
            self.wire,
            self._key(token),
            service,
            handler,
            name=_topic_of(token),
            remote_only=self._remote_only,
        )
        return self._add_entity(server, token)

    def client(
        self, name: str, service: Service[Q, S], qos: QoS = DEFAULT, timeout: float = TIMEOUT
    ) -> Client[Q, S]:
        """Create a service client; each call times out after `timeout` seconds."""
        token = self._endpoint_token(CLIENT, name, InterfaceType.of(service), qos)
        client = Client[Q, S](
            self.wire, self._key(token), service, token.gid, name=_topic_of(token), timeout=timeout
        )
        return self._add_entity(client, token)

    def announce(self, kind: str, name: str, wire_type: InterfaceType, qos: QoS = DEFAULT) -> None:
        """Announce an endpoint that another entity of this session serves: `kind` is MP, MS, SS or SC."""
        self._tokens.append(self._declare(self._endpoint_token(kind, name, wire_type, qos)))

    def destroy(self, entity: Any) -> None:
        """Withdraw the token of a publisher, subscription, server or client of this node, then close it."""
        self._entities.pop(entity).undeclare()
        entity.close()

    def close(self) -> None:
        """Withdraw all tokens of the node, then close its endpoints."""
        for token in reversed([*self._tokens, *self._entities.values()]):
            token.undeclare()
        for entity in reversed(self._entities):
            entity.close()
        self._tokens, self._entities = [], {}

    def __enter__(self) -> RmwNode:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _endpoint_token(
        self, kind: str, name: str, wire_type: InterfaceType, qos: QoS, backends: str = ""
    ) -> Token:
        full = resolve(name, self.id.namespace, self.full_name)
        return Token(self.id, EndpointInfo(self.wire.next_id(), kind, full, wire_type, qos, backends))

    def _key(self, token: Token) -> str:
        assert token.endpoint is not None
        return topic_key(self.wire.domain, token.endpoint.topic, token.endpoint.type)

    def _add_entity(self, entity: Any, token: Token) -> Any:
        """Register an endpoint and declare its token; the endpoint exists before it is announced."""
        self._entities[entity] = self._declare(token)
        return entity

    def _declare(self, token: Token) -> zenoh.LivelinessToken:
        return self.wire.session.liveliness().declare_token(str(token))


def _topic_of(token: Token) -> str:
    return token.endpoint.topic if token.endpoint else ""
