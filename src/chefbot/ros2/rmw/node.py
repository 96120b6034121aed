"""A node on ROS 2's graph: what it has is declared on the wire and told by a token."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import zenoh

from chefbot.msgs.idl.cdr import decode
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.service import Service
from chefbot.ros2.rmw.attachment import unpack
from chefbot.ros2.rmw.names import (
    WireType,
    check_namespace,
    check_node_name,
    has_byte_array,
    resolve,
    topic_key,
)
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import DEFAULT, QoS
from chefbot.ros2.rmw.service import TIMEOUT, Call, Client, Server
from chefbot.ros2.rmw.session import Wire
from chefbot.ros2.rmw.subscription import Receive, Subscription, Take
from chefbot.ros2.rmw.tokens import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION, End, NodeId, Token

M = TypeVar("M", bound=Message)
Q = TypeVar("Q", bound=Message)
S = TypeVar("S", bound=Message)
CPU_BACKEND = "backends:cpu:"
"""Asks newer rmw_zenoh for plain bytes of types with `uint8[]`; older ones do not look at it."""


class WireNode:
    """One node; names are resolved in its namespace. WireError for a name that ROS would refuse.

    `remote_only`: its listeners and servers do not hear this very process.
    """

    def __init__(self, wire: Wire, name: str, namespace: str = "/", *, remote_only: bool = False) -> None:
        self.wire = wire
        self.id = NodeId(
            wire.domain, wire.zid, wire.next_id(), check_namespace(namespace), check_node_name(name)
        )
        self._remote_only = remote_only
        self._entities: dict[Any, zenoh.LivelinessToken] = {}
        """What it has, each with the token that tells of it."""
        self._tokens = [self._tell(Token(self.id))]
        """Of the node itself, and of what other entities serve."""

    @property
    def full_name(self) -> str:
        """'/robot1/base'"""
        return self.id.full_name

    def publisher(self, topic: str, kind: type[M], qos: QoS = DEFAULT) -> Publisher[M]:
        """A publisher of messages of class `kind`."""
        return self.raw_publisher(topic, WireType.of(kind), qos)

    def raw_publisher(self, topic: str, kind: WireType, qos: QoS = DEFAULT) -> Publisher[Any]:
        """A publisher of CDR bytes, by `publish_cdr`: also of types that we have no class of."""
        token = self._end(PUBLISHER, topic, kind, qos)
        return self._keep(Publisher[Any](self.wire, self._key(token), qos, token.gid), token)

    def subscription(
        self, topic: str, kind: type[M], callback: Callable[[M], None], qos: QoS = DEFAULT
    ) -> Subscription:
        """Call `callback(message)` in Zenoh's thread; what is no such message is counted and refused."""

        def take(data: bytes, _: bytes) -> None:
            callback(decode(kind, data))

        buffered = has_byte_array(kind) and not qos.latched
        return self._subscribe(topic, WireType.of(kind), take, qos, buffered)

    def raw_subscription(
        self, topic: str, kind: WireType, receive: Receive, qos: QoS = DEFAULT, *, buffered: bool = False
    ) -> Subscription:
        """Call `receive(cdr bytes, attachment)`: also for types that we have no class of."""

        def take(data: bytes, beside: bytes) -> None:
            receive(data, unpack(beside))

        return self._subscribe(topic, kind, take, qos, buffered)

    def _subscribe(self, topic: str, kind: WireType, take: Take, qos: QoS, buffered: bool) -> Subscription:
        backends = CPU_BACKEND if buffered else ""
        token = self._end(SUBSCRIPTION, topic, kind, qos, backends)
        made = Subscription(
            self.wire,
            self._key(token),
            qos,
            take,
            topic=_name(token),
            remote_only=self._remote_only,
            buffered=buffered,
        )
        return self._keep(made, token)

    def server(
        self,
        name: str,
        service: Service[Q, S],
        handler: Callable[[Call[Q, S]], None],
        qos: QoS = DEFAULT,
    ) -> Server[Q, S]:
        """Serve: `handler(call)` runs in Zenoh's thread; `call.answer(response)` now or later."""
        token = self._end(SERVER, name, WireType.of(service), qos)
        made = Server[Q, S](
            self.wire,
            self._key(token),
            service,
            handler,
            name=_name(token),
            remote_only=self._remote_only,
        )
        return self._keep(made, token)

    def client(
        self, name: str, service: Service[Q, S], qos: QoS = DEFAULT, timeout: float = TIMEOUT
    ) -> Client[Q, S]:
        """A client; each call ends after `timeout` seconds at the latest."""
        token = self._end(CLIENT, name, WireType.of(service), qos)
        made = Client[Q, S](
            self.wire, self._key(token), service, token.gid, name=_name(token), timeout=timeout
        )
        return self._keep(made, token)

    def announce(self, kind: str, name: str, wire_type: WireType, qos: QoS = DEFAULT) -> None:
        """Tell of an end that another entity of this session serves: `kind` MP, MS, SS or SC."""
        self._tokens.append(self._tell(self._end(kind, name, wire_type, qos)))

    def drop(self, entity: Any) -> None:
        """Take back the token of a publisher, subscription, server or client that it has made, then end it."""
        self._entities.pop(entity).undeclare()
        entity.close()

    def close(self) -> None:
        """Take all tokens back, then end what they told of."""
        for token in reversed([*self._tokens, *self._entities.values()]):
            token.undeclare()
        for entity in reversed(self._entities):
            entity.close()
        self._tokens, self._entities = [], {}

    def __enter__(self) -> WireNode:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _end(self, kind: str, name: str, wire_type: WireType, qos: QoS, backends: str = "") -> Token:
        full = resolve(name, self.id.namespace, self.full_name)
        return Token(self.id, End(self.wire.next_id(), kind, full, wire_type, qos, backends))

    def _key(self, token: Token) -> str:
        assert token.end is not None
        return topic_key(self.wire.domain, token.end.topic, token.end.type)

    def _keep(self, entity: Any, token: Token) -> Any:
        """First the data's end, then the token that promises it."""
        self._entities[entity] = self._tell(token)
        return entity

    def _tell(self, token: Token) -> zenoh.LivelinessToken:
        return self.wire.session.liveliness().declare_token(str(token))


def _name(token: Token) -> str:
    return token.end.topic if token.end else ""
