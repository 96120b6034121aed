"""Liveliness tokens, which announce nodes and endpoints, and the GID derived from each."""

from __future__ import annotations

from typing import NamedTuple

import xxhash

from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.names import InterfaceType, ros_name
from chefbot.ros2.rmw.qos import QoS, parse_qos

ROOT = "@ros2_lv"
NODE, PUBLISHER, SUBSCRIPTION, SERVER, CLIENT = "NN", "MP", "MS", "SS", "SC"
_ENDS = (PUBLISHER, SUBSCRIPTION, SERVER, CLIENT)
_NODE_FIELDS, _END_FIELDS = 9, 13


class NodeId(NamedTuple):
    """A node and the Zenoh session that it belongs to."""

    domain: int
    zid: str
    """Id of the session as Zenoh writes it; opaque."""
    nid: str
    """Number of the node within the session."""
    namespace: str
    """Namespace, '/' or such as '/robot1'."""
    name: str
    enclave: str = "/"

    @property
    def full_name(self) -> str:
        """Full name of the node, such as '/robot1/base'."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


class EndpointInfo(NamedTuple):
    """A publisher, subscription, server or client of a node, as described in its token."""

    id: str
    kind: str
    """MP publisher, MS subscription, SS service server, SC service client."""
    topic: str
    """Full name of the topic or service, such as '/robot1/scan'."""
    type: InterfaceType
    qos: QoS
    backends: str = ""
    """Buffer backends of newer rmw_zenoh, such as 'backends:cpu:'."""


class Token(NamedTuple):
    """A liveliness token of a node, or of one of its endpoints."""

    node: NodeId
    endpoint: EndpointInfo | None = None

    def __str__(self) -> str:
        """Return the token's key expression."""
        node, end = self.node, self.endpoint
        head = f"{ROOT}/{node.domain}/{node.zid}/{node.nid}/{end.id if end else node.nid}"
        node_part = f"{_mangle(node.enclave)}/{_mangle(node.namespace)}/{node.name}"
        if end is None:
            return f"{head}/{NODE}/{node_part}"
        tail = f"{_mangle(end.topic)}/{end.type.dds}/{end.type.hash}/{end.qos}"
        return f"{head}/{end.kind}/{node_part}/{tail}" + (f"/{end.backends}" if end.backends else "")

    @property
    def gid(self) -> bytes:
        """GID of the endpoint, 16 bytes: XXH3-128 of the token, low half first."""
        return gid_of(str(self))


def gid_of(token: str) -> bytes:
    """Return the GID of a token's text."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")


def all_tokens(domain: int) -> str:
    """Return the key expression that matches every token of a domain."""
    return f"{ROOT}/{domain}/**"


def parse_token(text: str) -> Token:
    """Parse a token's key expression; additional trailing fields are allowed.

    Raises RmwError when it is malformed, e.g. with an empty field.
    """
    fields = text.split("/")
    if fields[0] != ROOT:
        raise RmwError(f"{text!r} is not a liveliness token: it does not begin with {ROOT}")
    if len(fields) < _NODE_FIELDS or not all(fields[:_END_FIELDS]):
        raise RmwError(f"{text!r} is not a liveliness token: a field is missing or empty")
    _, domain, zid, nid, entity_id, kind, enclave, namespace, name = fields[:_NODE_FIELDS]
    if not (domain.isascii() and domain.isdigit() and len(domain) <= 4):
        raise RmwError(f"{text!r} is not a liveliness token: {domain!r} is not a domain")
    node = NodeId(int(domain), zid, nid, _demangle(namespace), name, _demangle(enclave))
    if kind == NODE:
        return Token(node)
    if kind not in _ENDS:
        raise RmwError(f"{text!r} is not a liveliness token: {kind!r} is not a kind of end")
    if len(fields) < _END_FIELDS:
        raise RmwError(
            f"{text!r} is not a liveliness token: an end has {_END_FIELDS} fields, not {len(fields)}"
        )
    # Fields of endpoints only
    topic, dds, type_hash, qos = fields[_NODE_FIELDS:_END_FIELDS]
    backends = "/".join(fields[_END_FIELDS:])
    return Token(
        node,
        EndpointInfo(
            entity_id,
            kind,
            _demangle(topic),
            InterfaceType(ros_name(dds), type_hash),
            parse_qos(qos),
            backends,
        ),
    )


def _mangle(name: str) -> str:
    return name.replace("/", "%")


def _demangle(name: str) -> str:
    return name.replace("%", "/")
