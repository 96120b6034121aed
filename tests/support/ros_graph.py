"""Builds a ROS graph from liveliness tokens without a network."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import zenoh

from chefbot.ros2.rmw.errors import ErrorCounter
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.liveliness import EndpointInfo, NodeId, Token
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import DEFAULT, QoS


def node(name: str, number: int = 0) -> NodeId:
    """Return a node of the root namespace."""
    return NodeId(0, "1a", str(number), "/", name, "/")


def token(name: str, kind: str, topic: str, message: InterfaceType, qos: QoS = DEFAULT) -> Token:
    """Return the token of an endpoint of a node; kind: MP, MS, SS or SC."""
    number = str(sum(map(ord, name + kind + topic)))
    return Token(node(name, 0), EndpointInfo(number, kind, topic, message, qos))


class Session:
    """A session without a network that passes liveliness tokens to its subscriber."""

    def __init__(self) -> None:
        self.callback: Any = None

    def liveliness(self) -> Any:
        return self

    def declare_subscriber(self, _: str, callback: Any, history: bool) -> Any:
        assert history
        self.callback = callback
        return SimpleNamespace(undeclare=lambda: None)

    def send(self, text: str, kind: Any = zenoh.SampleKind.PUT) -> None:
        self.callback(SimpleNamespace(key_expr=text, kind=kind))


def graph_of(*tokens: Token) -> tuple[Graph, Session, ErrorCounter]:
    """Return a graph that has received the tokens, its session, and its counter of invalid tokens."""
    session, errors = Session(), ErrorCounter()
    zenoh_session: Any = session
    graph = Graph(zenoh_session, 0, errors)
    for received in tokens:
        session.send(str(received))
    return graph, session, errors
